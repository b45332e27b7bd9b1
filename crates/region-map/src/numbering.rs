//! Labels without gaps.

use crate::{options::SegmentError, plane::Plane};

/// Labels from 1 without gaps, and the new label of every old one.
pub(crate) struct Numbered {
    pub(crate) labels: Plane<u16>,
    pub(crate) names: Vec<u16>,
    pub(crate) count: usize,
}

impl Numbered {
    /// Takes the label from the cells of regions, told by their new labels, in the plane that was numbered.
    pub(crate) fn drop_from(&self, labels: &mut Plane<u32>, unfit: impl Fn(usize) -> bool) {
        let gone = |label: u32| match usize::from(self.names[label as usize]) {
            0 => false,
            name => unfit(name),
        };
        labels.cells.iter_mut().filter(|label| gone(**label)).for_each(|label| *label = 0);
    }
}

/// Takes the label from pieces of fewer than `least` cells, so that what lies beside them can take them over.
pub(crate) fn drop_crumbs(labels: &mut Plane<u32>, least: f64) {
    let keep: Vec<bool> = large_enough(labels, least).collect();
    labels.cells.iter_mut().filter(|label| !keep[**label as usize]).for_each(|label| *label = 0);
}

/// Numbers the labels from 1 in reading order; regions of fewer than `least` cells become 0.
pub(crate) fn number(labels: &Plane<u32>, least: f64) -> Result<Numbered, SegmentError> {
    let mut count = 0_usize;
    let mut names = Vec::new();
    for keep in large_enough(labels, least) {
        count += usize::from(keep);
        names.push(if keep { count } else { 0 });
    }
    if count > usize::from(u16::MAX) {
        return Err(SegmentError::TooManyRegions(count));
    }
    #[expect(clippy::cast_possible_truncation, reason = "checked just before")]
    let names: Vec<u16> = names.into_iter().map(|name| name as u16).collect();
    let cells = labels.cells.iter().map(|&label| names[label as usize]).collect();
    Ok(Numbered { labels: Plane { rows: labels.rows, columns: labels.columns, cells }, names, count })
}

/// For every label whether it has cells, and at least `least` of them; label 0 never does.
fn large_enough(labels: &Plane<u32>, least: f64) -> impl Iterator<Item = bool> {
    let mut sizes = vec![0_usize; labels.cells.iter().max().copied().unwrap_or(0) as usize + 1];
    labels.cells.iter().for_each(|&label| sizes[label as usize] += 1);
    #[expect(clippy::cast_precision_loss, reason = "grids have fewer than 2^52 cells")]
    let large = move |(label, size): (usize, usize)| label > 0 && size > 0 && size as f64 >= least;
    sizes.into_iter().enumerate().map(large)
}

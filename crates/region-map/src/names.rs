//! Names that people give to regions, and how they outlive a new map.

pub(crate) mod overlay;

use std::collections::BTreeMap;

use local_grid::nalgebra::Isometry2;

use crate::RegionMap;

/// There is no region with this label.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("there is no region {label}; the regions are 1 to {count}")]
pub struct NoSuchRegion {
    /// The label asked for.
    pub label: u16,
    /// How many regions there are.
    pub count: usize,
}

/// A region of the new map takes the name of an old one only if they share at least this much of the smaller of them.
const SHARED: f64 = 0.5;

impl RegionMap {
    /// Gives a region a name.
    ///
    /// # Errors
    ///
    /// No region has this label.
    pub fn name(&mut self, label: u16, name: impl Into<String>) -> Result<(), NoSuchRegion> {
        let count = self.regions.len();
        let region = usize::from(label).checked_sub(1).and_then(|index| self.regions.get_mut(index));
        region.ok_or(NoSuchRegion { label, count })?.name = Some(name.into());
        Ok(())
    }

    /// The region with this name, letters compared without their case.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<&crate::Region> {
        let wanted = name.to_lowercase();
        self.regions.iter().find(|region| region.name.as_ref().is_some_and(|name| name.to_lowercase() == wanted))
    }
}

/// Gives the regions of a new map the names that the regions in their place had in an old one. Returns the names that
/// found no region.
///
/// `old_from_new` takes points of the new map to the old one, in metres: the identity for two maps in one frame,
/// [`lay_over`](crate::lay_over) for maps of two runs through one building. The grids may differ. Pairs are matched one to
/// one by the area they share, largest first; a name that the new map already has stays.
pub fn carry_names(old: &RegionMap, new: &mut RegionMap, old_from_new: &Isometry2<f64>) -> Vec<String> {
    let mut pairs: Vec<((u16, u16), usize)> = shared_cells(old, new, old_from_new).into_iter().collect();
    pairs.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
    let mut sizes = vec![0_usize; new.regions.len() + 1];
    new.labels.cells().iter().for_each(|&label| sizes[usize::from(label)] += 1);
    let cell = new.labels.frame().resolution().powi(2);
    let mut carried = vec![false; old.regions.len()];
    for ((from, to), shared) in pairs {
        let (Some(source), Some(target)) = (old.region(from), new.regions.get_mut(usize::from(to) - 1)) else {
            continue;
        };
        #[expect(clippy::cast_precision_loss, reason = "areas are far below 2^52 cells")]
        let (shared, size) = (shared as f64 * cell, sizes[usize::from(to)] as f64 * cell);
        if carried[usize::from(from) - 1] || target.name.is_some() || shared < SHARED * size.min(source.area) {
            continue;
        }
        if let Some(name) = &source.name {
            target.name = Some(name.clone());
            carried[usize::from(from) - 1] = true;
        }
    }
    let lost = old.regions.iter().zip(carried).filter(|(_, carried)| !carried);
    lost.filter_map(|(region, _)| region.name.clone()).collect()
}

/// How many cells of the new map each pair of an old and a new label shares.
fn shared_cells(old: &RegionMap, new: &RegionMap, old_from_new: &Isometry2<f64>) -> BTreeMap<(u16, u16), usize> {
    let frame = new.labels.frame();
    let mut shared = BTreeMap::new();
    for (index, &to) in new.labels.cells().iter().enumerate().filter(|(_, label)| **label > 0) {
        let center = frame.center(index / frame.columns(), index % frame.columns());
        if let Some(&from) = old.labels.at(old_from_new * center).filter(|label| **label > 0) {
            *shared.entry((from, to)).or_default() += 1;
        }
    }
    shared
}

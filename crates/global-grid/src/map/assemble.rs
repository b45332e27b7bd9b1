use local_grid::Scan;
use nalgebra::Isometry2;

use crate::draw::sums::Sums;
use crate::draw::{Direction, Pen};
use crate::{GridError, GridMap, GridOptions};

/// All scans at their poses in one map, under one key.
///
/// # Errors
///
/// As [`GridMap::new`] and [`GridMap::insert`].
pub fn assemble<'a>(
    posed_scans: impl IntoIterator<Item = (&'a Isometry2<f64>, &'a Scan)>,
    options: &GridOptions,
) -> Result<GridMap, GridError> {
    let mut map = GridMap::new(options.clone())?;
    map.insert_all(posed_scans.into_iter().map(|(map_from_robot, scan)| (0, map_from_robot, scan)))?;
    Ok(map)
}

/// Scans that a thread should have at least; with fewer, starting it costs more than it saves.
#[cfg(feature = "parallel")]
const LEAST_SHARE: usize = 64;

/// Draws scans on all cores, each into sums of its own; integers add up to the same whatever the order.
#[cfg(feature = "parallel")]
pub(crate) fn draw_all(sums: &mut Sums, pen: &mut Pen, options: &GridOptions, scans: &[(&Isometry2<f64>, &Scan)]) {
    use rayon::prelude::*;

    let share = scans.len().div_ceil(rayon::current_num_threads()).max(LEAST_SHARE);
    let (own, others) = scans.split_at(share.min(scans.len()));
    let draw_others = || -> Vec<Sums> { others.par_chunks(share).map(|share| apart(options, share)).collect() };
    let ((), others) = rayon::join(|| draw_in_turn(sums, pen, options, own), draw_others);
    others.into_iter().for_each(|more| sums.add(more));
}

/// What a share of the scans says.
#[cfg(feature = "parallel")]
fn apart(options: &GridOptions, scans: &[(&Isometry2<f64>, &Scan)]) -> Sums {
    let mut pen = Pen::new(options);
    let mut sums = Sums::new(pen.worth());
    draw_in_turn(&mut sums, &mut pen, options, scans);
    sums
}

/// Draws scans one after the other.
#[cfg(not(feature = "parallel"))]
pub(crate) fn draw_all(sums: &mut Sums, pen: &mut Pen, options: &GridOptions, scans: &[(&Isometry2<f64>, &Scan)]) {
    draw_in_turn(sums, pen, options, scans);
}

fn draw_in_turn(sums: &mut Sums, pen: &mut Pen, options: &GridOptions, scans: &[(&Isometry2<f64>, &Scan)]) {
    for scan in scans {
        pen.draw(sums, options, *scan, Direction::In);
    }
}

use local_grid::Scan;
use nalgebra::Isometry2;

use crate::SharedEcho;
use crate::plane::{Plane, SHIFT, TILE, TILE_CELLS, Window, undo_differences};
use crate::sonar::{Arcs, count_echoes};
use crate::sums::Sums;
use crate::tally::UNITS_PER_NAT;

/// Scans whose arcs are kept at a time; with more readings than that the arcs are drawn again in every round.
const BLOCK: usize = 1 << 18;

/// Cells that an arc can be expected to have; a guess that saves moving them while they are drawn.
const CELLS_PER_ARC: usize = 64;

/// Shares the echoes of sonar scans out among the cells of their arcs. See [`SharedEcho`] for the equations.
///
/// Sums are integers and saturate, so that the order of the scans does not matter.
pub(crate) fn share_echoes(
    sums: &Sums,
    (model, resolution): (&SharedEcho, f64),
    scans: &[(&Isometry2<f64>, &Scan)],
) -> Plane {
    let blocks = blocks(model, scans);
    let mut plane = Plane::default();
    let mut arcs = Arcs::default();
    let mut occupied = Vec::new();
    let first = round_of(model.occupied);
    for block in &blocks {
        draw(&mut arcs, &mut plane, (model, resolution), block);
        occupied.resize(plane.len() * TILE_CELLS, 0u32);
        for &(cell, weight) in &arcs.cells {
            add(&mut occupied, cell, weight * first);
        }
    }
    let empty = empty_sums(sums, &plane);
    let mut pull = vec![0.0; empty.len()];
    for _ in 0..model.rounds {
        pulls(model, &empty, &occupied, &mut pull);
        occupied.fill(0);
        for block in &blocks {
            if blocks.len() > 1 {
                draw(&mut arcs, &mut plane, (model, resolution), block);
            }
            arcs.iter().for_each(|arc| share(model, arc, &pull, &mut occupied));
        }
    }
    for (slot, sums) in occupied.chunks_exact(TILE_CELLS).enumerate() {
        plane.tile_mut(u32::try_from(slot).expect("slots are 32-bit numbers")).copy_from_slice(sums);
    }
    plane
}

/// Shares one echo out.
fn share(model: &SharedEcho, arc: &[(u32, f32)], pull: &[f32], occupied: &mut [u32]) {
    // Four sums at a time, because each addition waits for the one before.
    let mut totals = [0.0f32; 4];
    for cells in arc.chunks(4) {
        for (total, &(cell, weight)) in totals.iter_mut().zip(cells) {
            *total += weight * pull[cell as usize];
        }
    }
    let total = (totals[0] + totals[1]) + (totals[2] + totals[3]);
    let each = round_of(model.echo) / (total + single(model.doubt));
    for &(cell, weight) in arc {
        add(occupied, cell, weight * pull[cell as usize] * each);
    }
}

/// What speaks for each cell being the cause of an echo: `O ((O + prior)/(O + E + prior))^contrast`, in nats.
fn pulls(model: &SharedEcho, empty: &[u32], occupied: &[u32], pulls: &mut [f32]) {
    let (per_unit, prior) = (single(1.0 / UNITS_PER_NAT), single(model.prior));
    let mut ratios = [0.0f32; TILE];
    let rows = empty.chunks_exact(TILE).zip(occupied.chunks_exact(TILE)).zip(pulls.chunks_exact_mut(TILE));
    for ((empty, occupied), pulls) in rows {
        for ((ratio, pull), (empty, occupied)) in ratios.iter_mut().zip(&mut *pulls).zip(empty.iter().zip(occupied)) {
            // Sums below 2³¹ convert in one instruction; 24 bits of them are enough for a ratio.
            #[expect(clippy::cast_precision_loss, reason = "see above")]
            let nats = |units: u32| units.min(u32::MAX >> 1).cast_signed() as f32 * per_unit;
            let (e, o) = (nats(*empty), nats(*occupied));
            *ratio = (o + prior) / (o + e + prior);
            *pull = o;
        }
        for _ in 0..model.contrast {
            pulls.iter_mut().zip(&ratios).for_each(|(pull, ratio)| *pull *= ratio);
        }
    }
}

/// The empty sums of the tiles of `plane`, slot by slot.
fn empty_sums(sums: &Sums, plane: &Plane) -> Vec<u32> {
    let mut empty = vec![0; plane.len() * TILE_CELLS];
    for (key, cells) in plane.keys().iter().zip(empty.chunks_exact_mut(TILE_CELLS)) {
        if let Some(tile) = sums.empty.get(*key) {
            undo_differences(tile, cells);
        }
    }
    empty
}

/// Draws the arcs of one block of scans, in place of those drawn before.
fn draw(arcs: &mut Arcs, plane: &mut Plane, model: (&SharedEcho, f64), block: &[(&Isometry2<f64>, &Scan)]) {
    arcs.cells.clear();
    arcs.ends.clear();
    arcs.cells.reserve(CELLS_PER_ARC * block.iter().map(|(_, scan)| count_echoes(model.0, scan)).sum::<usize>());
    let mut window = Window::default();
    for scan in block {
        arcs.push(plane, &mut window, model, *scan);
    }
    debug_assert!(plane.len() < 1 << (32 - 2 * SHIFT));
}

/// Cuts the scans into blocks of at most about [`BLOCK`] echoes.
fn blocks<'a, 'b>(
    model: &SharedEcho,
    scans: &'a [(&'b Isometry2<f64>, &'b Scan)],
) -> Vec<&'a [(&'b Isometry2<f64>, &'b Scan)]> {
    let (mut blocks, mut start, mut echoes) = (Vec::new(), 0, 0);
    for (at, (_, scan)) in scans.iter().enumerate() {
        echoes += count_echoes(model, scan);
        if echoes > BLOCK {
            blocks.push(&scans[start..=at]);
            (start, echoes) = (at + 1, 0);
        }
    }
    blocks.push(&scans[start..]);
    blocks
}

/// Adds evidence, already in units, to a cell.
fn add(sums: &mut [u32], cell: u32, units: f32) {
    let sum = &mut sums[cell as usize];
    // Below 2²² units, as `SharedEcho::validate` sees to: 100 nats are 1.6 million.
    *sum = sum.saturating_add(crate::cone::nearest(units).cast_unsigned());
}

/// Nats as units, not rounded yet.
fn round_of(nats: f64) -> f32 {
    single(nats * UNITS_PER_NAT)
}

#[expect(clippy::cast_possible_truncation, reason = "a factor")]
fn single(x: f64) -> f32 {
    x as f32
}

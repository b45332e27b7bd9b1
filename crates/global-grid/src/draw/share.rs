use local_grid::Scan;
use nalgebra::Isometry2;

use crate::SharedEcho;
use crate::draw::arcs::{Arcs, count_echoes};
use crate::draw::cone::nearest;
use crate::draw::sums::{ALL_ROWS, Sums};
use crate::draw::window::Window;
use crate::plane::{Plane, SHIFT, TILE, TILE_CELLS};
use crate::tally::UNITS_PER_NAT;

/// Echoes whose arcs are drawn at a time; with more than that the arcs are drawn a second time for the first round.
const BLOCK: usize = 1 << 18;

/// The share of an echo below which a cell gets nothing and is not asked again; see [`SharedEcho`].
const NEGLIGIBLE: f64 = 1.0 / 256.0;

/// Cells that an arc can be expected to have; a guess that saves moving them while they are drawn.
const CELLS_PER_ARC: usize = 96;

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
    let mut causes = Vec::new();
    for block in &blocks {
        draw_whole(&mut arcs, (&mut plane, &mut causes), (model, resolution), block);
    }
    for round in 0..model.rounds {
        weigh(model, (sums, &plane), &mut causes);
        if round > 0 || blocks.len() == 1 {
            share(model, &mut arcs, &mut causes);
        } else {
            arcs = share_blocks((model, resolution), &blocks, &mut plane, &mut causes);
        }
    }
    for (slot, causes) in causes.chunks_exact(TILE_CELLS).enumerate() {
        let tile = plane.tile_mut(u32::try_from(slot).expect("slots are 32-bit numbers"));
        tile.iter_mut().zip(causes).for_each(|(sum, cause)| *sum = cause.heard);
    }
    plane
}

/// A cell that may have caused echoes.
#[derive(Debug, Clone, Copy, Default)]
struct Cause {
    /// What speaks for it, in nats.
    pull: f32,
    /// Its share of all echoes so far, in units.
    heard: u32,
}

/// Draws the arcs of one block of scans, in place of those drawn before, and adds up all of them at full length: `O₀`.
fn draw_whole(
    arcs: &mut Arcs,
    (plane, causes): (&mut Plane, &mut Vec<Cause>),
    model: (&SharedEcho, f64),
    block: &[(&Isometry2<f64>, &Scan)],
) {
    let first = round_of(model.0.occupied);
    arcs.clear();
    arcs.cells.reserve(CELLS_PER_ARC * block.iter().map(|(_, scan)| count_echoes(model.0, scan)).sum::<usize>());
    let mut window = Window::default();
    for scan in block {
        let start = arcs.cells.len();
        arcs.push(plane, &mut window, model, *scan);
        causes.resize(plane.len() * TILE_CELLS, Cause::default());
        for &(cell, weight) in &arcs.cells[start..] {
            let cause = &mut causes[cell as usize];
            cause.heard = cause.heard.saturating_add(units(weight * first));
        }
    }
    debug_assert!(plane.len() < 1 << (32 - 2 * SHIFT));
}

/// The first round over arcs that are too many to be kept whole: draws each block again and keeps what counts of it.
fn share_blocks(
    model: (&SharedEcho, f64),
    blocks: &[&[(&Isometry2<f64>, &Scan)]],
    plane: &mut Plane,
    causes: &mut [Cause],
) -> Arcs {
    let (mut kept, mut arcs) = (Arcs::default(), Arcs::default());
    for block in blocks {
        arcs.clear();
        let mut window = Window::default();
        block.iter().for_each(|scan| arcs.push(plane, &mut window, model, *scan));
        share(model.0, &mut arcs, causes);
        kept.append(&arcs);
    }
    kept
}

/// Shares each echo out, and forgets the cells that got next to nothing of it.
fn share(model: &SharedEcho, arcs: &mut Arcs, causes: &mut [Cause]) {
    let (echo, doubt, least) = (round_of(model.echo), single(model.doubt), round_of(model.echo * NEGLIGIBLE));
    let (mut start, mut kept) = (0, 0);
    for end in &mut arcs.ends {
        let each = echo / (total(&arcs.cells[start..*end], causes) + doubt);
        for at in start..*end {
            let (cell, weight) = arcs.cells[at];
            let cause = &mut causes[cell as usize];
            let share = weight * cause.pull * each;
            // Without a branch, which could not be foreseen.
            let counts = share >= least;
            cause.heard = cause.heard.saturating_add(units(if counts { share } else { 0.0 }));
            arcs.cells[kept] = (cell, weight);
            kept += usize::from(counts);
        }
        (start, *end) = (*end, kept);
    }
    arcs.cells.truncate(kept);
}

/// What speaks for all cells of an arc together.
fn total(cells: &[(u32, f32)], causes: &[Cause]) -> f32 {
    let of = |&(cell, weight): &(u32, f32)| weight * causes[cell as usize].pull;
    // Four sums side by side, because each addition waits for the one before.
    let (mut a, mut b, mut c, mut d) = (0.0f32, 0.0f32, 0.0f32, 0.0f32);
    let (fours, rest) = cells.as_chunks::<4>();
    for four in fours {
        a += of(&four[0]);
        b += of(&four[1]);
        c += of(&four[2]);
        d += of(&four[3]);
    }
    (a + b) + (c + d) + rest.iter().map(of).sum::<f32>()
}

/// Finds what speaks for each cell being the cause of an echo, `O ((O + prior)/(O + E + prior))^contrast` in nats, and
/// starts its share anew.
fn weigh(model: &SharedEcho, (sums, plane): (&Sums, &Plane), causes: &mut [Cause]) {
    sums.each_empty(plane.keys(), ALL_ROWS, |key, empty| {
        let Some(slot) = plane.find(key) else { return };
        let causes = &mut causes[slot as usize * TILE_CELLS..][..TILE_CELLS];
        for (empty, causes) in empty.as_chunks::<TILE>().0.iter().zip(causes.chunks_exact_mut(TILE)) {
            weigh_row(model, empty, causes);
        }
    });
}

/// Does so for one row of a tile.
fn weigh_row(model: &SharedEcho, empty: &[u32; TILE], causes: &mut [Cause]) {
    let (per_unit, prior) = (single(1.0 / UNITS_PER_NAT), single(model.prior));
    // Sums below 2³¹ convert in one instruction; 24 bits of them are enough for a ratio.
    #[expect(clippy::cast_precision_loss, reason = "see above")]
    let nats = |units: u32| units.min(u32::MAX >> 1).cast_signed() as f32 * per_unit;
    let (mut pulls, mut ratios) = ([0.0f32; TILE], [0.0f32; TILE]);
    for ((pull, ratio), (empty, cause)) in pulls.iter_mut().zip(&mut ratios).zip(empty.iter().zip(&*causes)) {
        let (e, o) = (nats(*empty), nats(cause.heard));
        (*pull, *ratio) = (o, (o + prior) / (o + e + prior));
    }
    let mut exponent = model.contrast; // by squaring
    while exponent > 0 {
        if exponent % 2 == 1 {
            pulls.iter_mut().zip(&ratios).for_each(|(pull, ratio)| *pull *= ratio);
        }
        ratios.iter_mut().for_each(|ratio| *ratio *= *ratio);
        exponent /= 2;
    }
    causes.iter_mut().zip(&pulls).for_each(|(cause, &pull)| *cause = Cause { pull, heard: 0 });
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

/// Evidence in units, rounded. Below 2²², as `SharedEcho::validate` sees to: 100 nats are 1.6 million.
fn units(units: f32) -> u32 {
    nearest(units).cast_unsigned()
}

/// Nats as units, not rounded yet.
fn round_of(nats: f64) -> f32 {
    single(nats * UNITS_PER_NAT)
}

#[expect(clippy::cast_possible_truncation, reason = "a factor")]
fn single(x: f64) -> f32 {
    x as f32
}

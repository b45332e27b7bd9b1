//! Watershed of the distance function, and flooding of what is left over.

use std::{cmp::Reverse, collections::BinaryHeap};

use crate::{distance::DistanceField, plane::Plane};

/// Basins around the maxima of the distance to walls, labelled from 1.
///
/// Free cells are visited from the widest to the narrowest. One without labelled neighbours begins a basin; one between
/// two basins is the saddle between them, and the basin with the lower peak is swallowed if that peak is less than `depth`
/// above the saddle (the h-maxima of the distance) or the saddle more than `ratio` of it (no real bottleneck: the border is
/// nearly as wide as what it borders).
pub(crate) fn watershed(field: &DistanceField, depth: f64, ratio: f64) -> Plane<u32> {
    let squared = &field.squared;
    let columns = squared.columns;
    let mut order: Vec<usize> = (0..squared.cells.len()).filter(|&cell| squared.cells[cell] > 0).collect();
    order.sort_unstable_by_key(|&cell| (Reverse(squared.cells[cell]), cell));
    let mut labels = Plane::like(squared, 0_u32);
    let mut basins = Basins { parents: vec![0], peaks: vec![0.0] };
    for cell in order {
        let distance = f64::from(squared.cells[cell]).sqrt();
        let mut mine = 0;
        for neighbour in [cell - columns, cell - 1, cell + 1, cell + columns] {
            if labels.cells[neighbour] == 0 {
                continue;
            }
            let other = basins.find(labels.cells[neighbour]);
            if mine == 0 {
                mine = other;
            } else if other != mine {
                let low = basins.peaks[mine as usize].min(basins.peaks[other as usize]);
                if low - distance < depth || distance > ratio * low {
                    mine = basins.swallow(mine, other);
                }
            }
        }
        labels.cells[cell] = if mine == 0 { basins.begin(distance) } else { mine };
    }
    labels.cells.iter_mut().for_each(|label| *label = basins.find(*label));
    labels
}

/// Basins that swallow one another.
struct Basins {
    parents: Vec<u32>,
    peaks: Vec<f64>,
}

impl Basins {
    #[expect(clippy::cast_possible_truncation, reason = "there are fewer basins than cells, fewer than 2^32")]
    fn begin(&mut self, peak: f64) -> u32 {
        self.parents.push(self.parents.len() as u32);
        self.peaks.push(peak);
        self.parents.len() as u32 - 1
    }

    fn find(&mut self, mut basin: u32) -> u32 {
        while self.parents[basin as usize] != basin {
            self.parents[basin as usize] = self.parents[self.parents[basin as usize] as usize];
            basin = self.parents[basin as usize];
        }
        basin
    }

    /// The basin with the higher peak swallows the other.
    fn swallow(&mut self, a: u32, b: u32) -> u32 {
        let higher = self.peaks[a as usize] > self.peaks[b as usize]
            || (self.peaks[a as usize] >= self.peaks[b as usize] && a < b);
        let (winner, loser) = if higher { (a, b) } else { (b, a) };
        self.parents[loser as usize] = winner;
        winner
    }
}

/// Floods the unlabelled cells of `free` from the labelled ones, the widest places first.
pub(crate) fn flood(free: &Plane<bool>, field: &DistanceField, labels: &mut Plane<u32>) {
    let columns = free.columns;
    let mut queue = BinaryHeap::new();
    let mut order = 0_u64;
    let around = |cell: usize| [cell - columns, cell - 1, cell + 1, cell + columns];
    for cell in columns..free.cells.len() - columns {
        if free.cells[cell] && labels.cells[cell] == 0 {
            for label in around(cell).map(|neighbour| labels.cells[neighbour]).into_iter().filter(|&label| label > 0) {
                queue.push((field.squared.cells[cell], Reverse(order), cell, label));
                order += 1;
            }
        }
    }
    while let Some((_, _, cell, label)) = queue.pop() {
        if labels.cells[cell] != 0 {
            continue;
        }
        labels.cells[cell] = label;
        for neighbour in around(cell) {
            if free.cells[neighbour] && labels.cells[neighbour] == 0 {
                queue.push((field.squared.cells[neighbour], Reverse(order), neighbour, label));
                order += 1;
            }
        }
    }
}

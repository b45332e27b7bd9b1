//! Connected components of runs of cells.

use std::ops::Range;

use crate::{distance::runs, plane::Plane};

/// A horizontal run of cells.
#[derive(Debug, Clone)]
pub(crate) struct Run {
    pub(crate) row: usize,
    pub(crate) columns: Range<usize>,
}

/// Runs and the number of the component that each belongs to; components are counted in reading order.
#[derive(Debug)]
pub(crate) struct Components {
    pub(crate) runs: Vec<Run>,
    pub(crate) of_run: Vec<u32>,
    pub(crate) count: usize,
}

/// Sets that grow together (union by smaller number, path halving).
#[derive(Debug, Default)]
pub(crate) struct DisjointSets(Vec<u32>);

impl DisjointSets {
    #[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32 runs")]
    pub(crate) fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    pub(crate) fn find(&mut self, mut item: u32) -> u32 {
        while self.0[item as usize] != item {
            self.0[item as usize] = self.0[self.0[item as usize] as usize];
            item = self.0[item as usize];
        }
        item
    }

    /// Joins two sets under the smaller of their names.
    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        let (low, high) = (a.min(b), a.max(b));
        self.0[high as usize] = low;
    }
}

/// The components of the cells where `mask` is true; cells up to `gap` cells apart still touch (0: only edges of cells
/// connect, 4-connected; 1: corners connect, too, 8-connected).
#[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32 runs")]
pub(crate) fn components(mask: &Plane<bool>, gap: usize) -> Components {
    let mut all = Vec::new();
    let mut row_starts = Vec::with_capacity(mask.rows + 1);
    let mut pairs = Vec::new();
    let reach = gap.max(1);
    for row in 0..mask.rows {
        let first = all.len();
        row_starts.push(first);
        for columns in runs(mask.row(row)) {
            if gap > 1 && all.len() > first {
                let last: &Run = &all[all.len() - 1];
                if columns.start < last.columns.end + gap {
                    pairs.push((all.len() as u32 - 1, all.len() as u32));
                }
            }
            all.push(Run { row, columns });
        }
        for back in 1..=reach.min(row) {
            let above = row_starts[row - back]..row_starts[row - back + 1].max(row_starts[row - back]);
            link(&all, above, first..all.len(), gap, &mut pairs);
        }
    }
    number(all, &pairs)
}

/// Notes which runs of two rows touch.
#[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32 runs")]
fn link(all: &[Run], above: Range<usize>, below: Range<usize>, gap: usize, pairs: &mut Vec<(u32, u32)>) {
    let mut first = above.start;
    for lower in below {
        let columns = &all[lower].columns;
        while first < above.end && all[first].columns.end + gap <= columns.start {
            first += 1;
        }
        let mut upper = first;
        while upper < above.end && all[upper].columns.start < columns.end + gap {
            pairs.push((upper as u32, lower as u32));
            upper += 1;
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32 runs")]
fn number(runs: Vec<Run>, pairs: &[(u32, u32)]) -> Components {
    let mut sets = DisjointSets::new(runs.len());
    for &(a, b) in pairs {
        sets.join(a, b);
    }
    let mut names = vec![0; runs.len()];
    let mut count = 0;
    for run in 0..runs.len() as u32 {
        let root = sets.find(run);
        if root == run {
            names[run as usize] = count;
            count += 1;
        } else {
            names[run as usize] = names[root as usize];
        }
    }
    Components { runs, of_run: names, count: count as usize }
}

impl Components {
    /// Labels from 1, and 0 where there is no component.
    pub(crate) fn labels(&self, rows: usize, columns: usize) -> Plane<u32> {
        let mut labels = Plane::filled(rows, columns, 0);
        for (run, &component) in self.runs.iter().zip(&self.of_run) {
            let start = run.row * columns;
            labels.cells[start + run.columns.start..start + run.columns.end].fill(component + 1);
        }
        labels
    }

    /// The number of cells of each component.
    pub(crate) fn sizes(&self) -> Vec<usize> {
        let mut sizes = vec![0; self.count];
        for (run, &component) in self.runs.iter().zip(&self.of_run) {
            sizes[component as usize] += run.columns.len();
        }
        sizes
    }
}

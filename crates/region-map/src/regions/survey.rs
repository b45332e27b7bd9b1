//! Measures regions: one pass over the cells for sums, a second for those that are bent.

use local_grid::{
    Grid,
    nalgebra::{Point2, Vector2},
};

use crate::{
    distance::DistanceField,
    plane::Plane,
    regions::{Moments, Region},
};

/// What regions are measured on.
pub(crate) struct Survey<'a> {
    pub(crate) labels: &'a Plane<u16>,
    pub(crate) field: &'a DistanceField,
    pub(crate) free: &'a Grid<f32>,
    pub(crate) unknown: Option<&'a Grid<bool>>,
    pub(crate) threshold: f32,
    /// Row and column of the grid where the plane begins, rim left out.
    pub(crate) origin: (usize, usize),
}

/// Sums over the cells of one region.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    moments: Moments,
    /// Edges of cells to walls and to the unexplored.
    wall: usize,
    frontier: usize,
    /// The cell farthest from walls.
    inside: usize,
    /// Sums of squared widths and of widths along the middle line: each place counts by the floor beside it, so that the
    /// short lines into corners hardly do.
    width: f64,
    ridge: f64,
}

/// A region that fills less of the rectangle with its moments than this is bent, and its length is measured along it.
const BENT: f64 = 0.75;

impl Survey<'_> {
    /// Describes regions 1 to `count`.
    pub(crate) fn regions(&self, count: usize) -> Vec<Region> {
        let mut sums = vec![Sums::default(); count];
        for row in 1..self.labels.rows - 1 {
            for column in 1..self.labels.columns - 1 {
                let index = row * self.labels.columns + column;
                if let Some(region) = usize::from(self.labels.cells[index]).checked_sub(1) {
                    self.add(&mut sums[region], row, column);
                }
            }
        }
        let bent: Vec<bool> = sums.iter().map(|sums| is_bent(&sums.moments)).collect();
        if bent.contains(&true) {
            self.add_ridges(&mut sums, &bent);
        }
        (1..=u16::MAX).zip(sums).map(|(label, sums)| self.describe(label, &sums)).collect()
    }

    #[expect(clippy::cast_precision_loss, reason = "rows and columns are far below 2^52")]
    fn add(&self, sums: &mut Sums, row: usize, column: usize) {
        let columns = self.labels.columns;
        let index = row * columns + column;
        // What is labelled and not free is furniture: floor for this purpose.
        let membership = self.free.cells()[self.grid_index(row, column).unwrap_or(0)];
        let weight = if membership > self.threshold { f64::from(membership.min(1.0)) } else { 1.0 };
        sums.moments.add(column as f64, row as f64, weight);
        if self.field.squared.cells[index] > self.field.squared.cells[sums.inside] {
            sums.inside = index;
        }
        for (row, column) in [(row - 1, column), (row, column - 1), (row, column + 1), (row + 1, column)] {
            if self.labels.cells[row * columns + column] == 0 {
                let unknown = |mask: &Grid<bool>| self.grid_index(row, column).is_none_or(|cell| mask.cells()[cell]);
                if self.unknown.is_some_and(unknown) {
                    sums.frontier += 1;
                } else {
                    sums.wall += 1;
                }
            }
        }
    }

    /// The cell of the grid under a cell of the plane; the rim may lie outside.
    fn grid_index(&self, row: usize, column: usize) -> Option<usize> {
        let (row, column) = ((row + self.origin.0).checked_sub(1)?, (column + self.origin.1).checked_sub(1)?);
        self.free.frame().index(row, column)
    }

    /// Adds the widths `2 D` where the nearest walls of neighbouring cells lie on opposite sides: on the middle line.
    fn add_ridges(&self, sums: &mut [Sums], bent: &[bool]) {
        let (squared, nearest) = (&self.field.squared, &self.field.nearest);
        for index in 0..self.labels.cells.len() - self.labels.columns {
            let Some(region) = usize::from(self.labels.cells[index]).checked_sub(1).filter(|&k| bent[k]) else {
                continue;
            };
            let (a, b) = (squared.position(nearest.cells[index] as usize), index + self.labels.columns);
            let faces = [index + 1, b].into_iter().any(|other| {
                let b = squared.position(nearest.cells[other] as usize);
                let span = f64::from(a.0 - b.0).powi(2) + f64::from(a.1 - b.1).powi(2);
                squared.cells[other] > 0 && span > 3.6 * f64::from(squared.cells[index])
            });
            if faces {
                // From wall to wall it is 2 D − 1 cells where the number of cells is odd, 2 D where it is even.
                let width = 2.0 * f64::from(squared.cells[index]).sqrt() - 0.5;
                sums[region].width += width * width;
                sums[region].ridge += width;
            }
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "counts of cells are far below 2^52")]
    fn describe(&self, label: u16, sums: &Sums) -> Region {
        let frame = self.free.frame();
        let resolution = frame.resolution();
        let point = |x: f64, y: f64| {
            let shift = Vector2::new(self.origin.1 as f64 - 0.5, self.origin.0 as f64 - 0.5);
            Point2::from(frame.origin().coords + (Vector2::new(x, y) + shift) * resolution)
        };
        let (center, mut length, mut width, orientation) = sums.moments.rectangle();
        if is_bent(&sums.moments) && sums.ridge > 0.0 {
            // The moments of an L are not those of a strip: its width is measured across, its length follows from the area.
            width = (sums.width / sums.ridge).max(1.0);
            length = (sums.moments.weight / width).max(width);
        }
        let (length, width) = (length * resolution, (width * resolution).max(resolution));
        let elongation = (length / width).max(1.0);
        let corridor = corridor(elongation, width);
        let (row, column) = self.labels.position(sums.inside);
        Region {
            label,
            name: None,
            area: sums.moments.weight * resolution * resolution,
            centroid: point(center.x, center.y),
            inside: point(f64::from(column), f64::from(row)),
            length,
            width,
            orientation,
            elongation,
            corridor,
            room: 1.0 - corridor,
            frontier: sums.frontier as f64 * resolution,
            wall: sums.wall as f64 * resolution,
        }
    }
}

fn is_bent(moments: &Moments) -> bool {
    let (_, length, width, _) = moments.rectangle();
    moments.weight < BENT * length * width
}

/// Rises from 0 at `low` to 1 at `high`.
fn ramp(value: f64, low: f64, high: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}

/// Membership in "corridor": long for its width, and narrow.
fn corridor(elongation: f64, width: f64) -> f64 {
    ramp(elongation, 2.5, 4.0).min(1.0 - ramp(width, 2.5, 3.5))
}

use nalgebra::{Isometry2, Point2};

use crate::{CellClass, GridFrame, Signature};

/// What a wall of another signature meets at each cell of this one: nearness to a wall, and whether anything is known.
#[derive(Debug, Clone)]
pub(crate) struct WallTable {
    frame: GridFrame,
    cells_per_metre: f64,
    near: Vec<f32>,
    known: Vec<bool>,
}

/// Totals over a set of walls.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    /// Sum of nearness to walls, over the walls that met known space.
    pub(super) near: f64,
    /// How many met known space.
    pub(super) known: f64,
    /// How many met known space far from any wall.
    pub(super) contradictory: f64,
    /// How many there were.
    pub(super) all: f64,
}

impl WallTable {
    /// How near a wall must be for an echo not to contradict free space.
    const CONTRADICTS_BELOW: f32 = 0.1;

    /// A table of given nearness and known-ness, row by row.
    pub(crate) fn of(frame: GridFrame, cells: impl Iterator<Item = (f32, bool)>) -> Self {
        let (near, known) = cells.unzip();
        Self { frame, cells_per_metre: 1.0 / frame.resolution(), near, known }
    }

    pub(crate) fn new(signature: &Signature, wall_sigma: f64) -> Self {
        let frame = *signature.frame();
        let mut near = vec![0.0; frame.n_cells()];
        let kernel = kernel(frame.resolution(), wall_sigma);
        let columns = frame.columns();
        for (index, _) in signature.classes().iter().enumerate().filter(|(_, class)| **class == CellClass::Occupied) {
            stamp(&mut near, &frame, &kernel, index / columns, index % columns);
        }
        let seen = |(class, near): (&CellClass, &f32)| *class != CellClass::Unknown || *near > 0.5;
        let known = signature.classes().iter().zip(&near).map(seen).collect();
        Self { frame, cells_per_metre: 1.0 / frame.resolution(), near, known }
    }

    pub(crate) fn frame(&self) -> &GridFrame {
        &self.frame
    }

    /// Nearness and known-ness of a cell.
    pub(super) fn cell(&self, index: usize) -> (f32, bool) {
        (self.near[index], self.known[index])
    }

    /// Nearness to a wall, bilinear between cell centres, and whether the cell is known; `None` outside.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked against the frame")]
    fn sample(&self, point: Point2<f64>) -> Option<(f64, bool)> {
        let (rows, columns) = (self.frame.rows(), self.frame.columns());
        let at = (point - self.frame.origin()) * self.cells_per_metre;
        if !(at.x >= 0.0 && at.y >= 0.0) {
            return None;
        }
        let (column, row) = (at.x as usize, at.y as usize);
        if column >= columns || row >= rows {
            return None;
        }
        let known = self.known[row * columns + column];
        // The four centres around the point; at the border the outermost cell stands for those beyond.
        let (x, y) = ((at.x - 0.5).max(0.0), (at.y - 0.5).max(0.0));
        let (left, low) = (x as usize, y as usize);
        let (right, high) = ((left + 1).min(columns - 1), (low + 1).min(rows - 1));
        let near = |row: usize, column: usize| f64::from(self.near[row * columns + column]);
        let (fx, fy) = (x - as_f64(left), y - as_f64(low));
        let below = near(low, left) * (1.0 - fx) + near(low, right) * fx;
        let above = near(high, left) * (1.0 - fx) + near(high, right) * fx;
        Some((below * (1.0 - fy) + above * fy, known))
    }

    /// What `walls`, carried by `here_from_there`, meet here.
    pub(super) fn tally(&self, walls: &[Point2<f64>], here_from_there: &Isometry2<f64>) -> Tally {
        let mut tally = Tally::default();
        for wall in walls {
            tally.all += 1.0;
            let Some((near, known)) = self.sample(here_from_there * wall) else { continue };
            if !known && near < 0.5 {
                continue;
            }
            tally.known += 1.0;
            tally.near += near;
            if near < f64::from(Self::CONTRADICTS_BELOW) {
                tally.contradictory += 1.0;
            }
        }
        tally
    }
}

#[expect(clippy::cast_precision_loss, reason = "cells of a local grid are few")]
fn as_f64(count: usize) -> f64 {
    count as f64
}

/// Nearness of the cells around a wall, as `(row step, column step, nearness)`.
#[expect(clippy::cast_possible_truncation, reason = "a few cells")]
fn kernel(resolution: f64, sigma: f64) -> Vec<(i64, i64, f32)> {
    let radius = (3.0 * sigma / resolution).floor().clamp(0.0, 64.0) as i64;
    let steps = move |row: i64| (-radius..=radius).map(move |column| (row, column));
    let nearness = |(row, column): (i64, i64)| {
        #[expect(clippy::cast_precision_loss, reason = "a few cells")]
        let distance = ((row * row + column * column) as f64).sqrt() * resolution;
        let bell = if distance == 0.0 { 1.0 } else { (-0.5 * (distance / sigma).powi(2)).exp() };
        (row, column, bell as f32)
    };
    (-radius..=radius).flat_map(steps).map(nearness).filter(|step| step.2 > 0.01).collect()
}

fn stamp(near: &mut [f32], frame: &GridFrame, kernel: &[(i64, i64, f32)], row: usize, column: usize) {
    for &(down, right, value) in kernel {
        let shifted = |at: usize, step: i64| i64::try_from(at).ok().and_then(|at| usize::try_from(at + step).ok());
        let (Some(row), Some(column)) = (shifted(row, down), shifted(column, right)) else { continue };
        if let Some(index) = frame.index(row, column) {
            near[index] = near[index].max(value);
        }
    }
}

use nalgebra::{Isometry2, Point2};

use crate::{CellClass, GridFrame, Signature};

/// What a wall of another signature meets at each cell of this one: nearness to a wall, and whether anything is known.
#[derive(Debug, Clone)]
pub(crate) struct WallTable {
    frame: GridFrame,
    cells_per_metre: f64,
    /// Row by row with a border of one cell, in which the outermost cells stand for those beyond.
    near: Vec<f32>,
    /// The same cells; what lies beyond is not known.
    known: Vec<bool>,
    /// From row to row of the two.
    stride: usize,
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
        let (near, known): (Vec<f32>, Vec<bool>) = cells.unzip();
        Self::bordered(frame, &near, &known)
    }

    fn bordered(frame: GridFrame, near: &[f32], known: &[bool]) -> Self {
        let (rows, columns) = (frame.rows(), frame.columns());
        let stride = columns + 2;
        let mut table = Self {
            frame,
            cells_per_metre: 1.0 / frame.resolution(),
            near: Vec::with_capacity(stride * (rows + 2)),
            known: Vec::with_capacity(stride * (rows + 2)),
            stride,
        };
        if near.is_empty() {
            return table;
        }
        for row in 0..rows + 2 {
            let inside = row.saturating_sub(1).min(rows - 1) * columns;
            let near = &near[inside..inside + columns];
            table.near.push(near[0]);
            table.near.extend_from_slice(near);
            table.near.push(near[columns - 1]);
            table.known.push(false);
            table.known.extend_from_slice(&known[inside..inside + columns]);
            table.known.push(false);
        }
        table
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
        let known: Vec<bool> = signature.classes().iter().zip(&near).map(seen).collect();
        Self::bordered(frame, &near, &known)
    }

    pub(crate) fn frame(&self) -> &GridFrame {
        &self.frame
    }

    /// Nearness and known-ness of the cells of a row.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = (f32, bool)> + '_ {
        let first = (row + 1) * self.stride + 1;
        let cells = first..first + self.frame.columns();
        self.near[cells.clone()].iter().copied().zip(self.known[cells].iter().copied())
    }

    /// Nearness to a wall, bilinear between cell centres, and whether the cell is known; `None` outside.
    #[inline]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked against the frame")]
    fn sample(&self, point: Point2<f64>) -> Option<(f64, bool)> {
        let at = (point - self.frame.origin()) * self.cells_per_metre;
        if !(at.x >= 0.0 && at.y >= 0.0) {
            return None;
        }
        let (column, row) = (at.x as u32, at.y as u32);
        if column as usize >= self.frame.columns() || row as usize >= self.frame.rows() {
            return None;
        }
        let known = self.known[(row as usize + 1) * self.stride + column as usize + 1];
        // The four centres around the point, counted with the border.
        let (x, y) = (at.x + 0.5, at.y + 0.5);
        let (left, low) = (x as u32, y as u32);
        let (fx, fy) = (x - f64::from(left), y - f64::from(low));
        let first = low as usize * self.stride + left as usize;
        let [below, above] = [first, first + self.stride].map(|at| {
            let pair = &self.near[at..at + 2];
            f64::from(pair[0]) * (1.0 - fx) + f64::from(pair[1]) * fx
        });
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

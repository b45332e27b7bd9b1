use nalgebra::{Point2, Vector2};

use crate::GridFrame;

/// One cell that a ray crosses, and where along the ray: distances from the ray's start in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayCell {
    /// Row-major index of the cell.
    pub index: usize,
    /// Where the ray enters the cell (not less than 0).
    pub enter: f64,
    /// Where the ray leaves it (not more than the ray's length).
    pub leave: f64,
}

/// Walks through every cell that a ray crosses, in order, each once (Amanatides & Woo 1987).
///
/// The ray is clipped to the frame first, so a ray from far outside costs no more than the cells it crosses inside.
#[derive(Debug, Clone)]
pub struct RayCells {
    index: usize,
    /// By how much the index changes from one column, and from one row, to the next.
    step_column: isize,
    step_row: isize,
    /// Columns and rows ahead before the ray leaves the frame.
    columns_ahead: usize,
    rows_ahead: usize,
    next_column: f64,
    next_row: f64,
    per_column: f64,
    per_row: f64,
    at: f64,
    end: f64,
    done: bool,
}

impl RayCells {
    /// The cells that the ray from `start` along `direction` (a unit vector) crosses within `length` metres.
    ///
    /// Nothing is crossed by a ray that misses the frame, or whose numbers are not finite.
    #[must_use]
    pub fn new(frame: &GridFrame, start: Point2<f64>, direction: Vector2<f64>, length: f64) -> Self {
        let resolution = frame.resolution();
        let local = (start - frame.origin()) / resolution; // in cells
        let (columns, rows) = (frame.columns(), frame.rows());
        #[expect(clippy::cast_precision_loss, reason = "grids have far fewer than 2^52 columns")]
        let size = Vector2::new(columns as f64, rows as f64);
        let (x_in, x_out) = slab(local.x, direction.x, size.x);
        let (y_in, y_out) = slab(local.y, direction.y, size.y);
        let enter = x_in.max(y_in).max(0.0);
        let leave = x_out.min(y_out).min(length / resolution);
        let valid = leave >= enter && length >= 0.0 && local.x.is_finite() && local.y.is_finite(); // false for NaN
        let entry = if valid { local + direction * enter } else { Vector2::zeros() };
        let column = cell_of(entry.x, columns);
        let row = cell_of(entry.y, rows);
        let (step_column, next_column, per_column) = steps(local.x, direction.x, column);
        let (step_row, next_row, per_row) = steps(local.y, direction.y, row);
        Self {
            index: row * columns + column,
            step_column,
            step_row: step_row * columns.cast_signed(),
            columns_ahead: ahead(step_column, column, columns),
            rows_ahead: ahead(step_row, row, rows),
            next_column: next_column * resolution,
            next_row: next_row * resolution,
            per_column: per_column * resolution,
            per_row: per_row * resolution,
            at: enter * resolution,
            end: leave * resolution,
            done: !valid || columns == 0 || rows == 0,
        }
    }
}

/// Where a line `start + t · direction` lies between 0 and `size`.
fn slab(start: f64, direction: f64, size: f64) -> (f64, f64) {
    if direction == 0.0 {
        let inside = (0.0..size).contains(&start);
        return if inside { (f64::NEG_INFINITY, f64::INFINITY) } else { (f64::INFINITY, f64::NEG_INFINITY) };
    }
    let (a, b) = (-start / direction, (size - start) / direction);
    (a.min(b), a.max(b))
}

/// The cell that holds a coordinate which rounding may have put a hair outside.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is clamped to the grid")]
fn cell_of(at: f64, n: usize) -> usize {
    (at as usize).min(n.saturating_sub(1))
}

/// How many cells follow on one axis before the border of the frame.
fn ahead(step: isize, cell: usize, n: usize) -> usize {
    if step > 0 { n.saturating_sub(cell + 1) } else { cell }
}

/// The step to the next cell along one axis, the ray's distance to that border, and the distance between borders.
#[expect(clippy::cast_precision_loss, reason = "cell numbers stay far below 2^52")]
fn steps(start: f64, direction: f64, cell: usize) -> (isize, f64, f64) {
    if direction == 0.0 {
        return (0, f64::INFINITY, f64::INFINITY);
    }
    let step = if direction > 0.0 { 1 } else { -1 };
    let border = if direction > 0.0 { cell as f64 + 1.0 } else { cell as f64 };
    (step, (border - start) / direction, 1.0 / direction.abs())
}

impl Iterator for RayCells {
    type Item = RayCell;

    #[inline]
    fn next(&mut self) -> Option<RayCell> {
        if self.done {
            return None;
        }
        let (index, enter) = (self.index, self.at);
        let (border, ahead) = if self.next_column < self.next_row {
            let passed = (self.next_column, self.columns_ahead);
            self.next_column += self.per_column;
            self.columns_ahead = self.columns_ahead.wrapping_sub(1);
            self.index = self.index.wrapping_add_signed(self.step_column);
            passed
        } else {
            let passed = (self.next_row, self.rows_ahead);
            self.next_row += self.per_row;
            self.rows_ahead = self.rows_ahead.wrapping_sub(1);
            self.index = self.index.wrapping_add_signed(self.step_row);
            passed
        };
        let leave = if border < self.end { border } else { self.end };
        self.at = if leave > enter { leave } else { enter };
        self.done = self.at >= self.end || ahead == 0;
        Some(RayCell { index, enter, leave: self.at })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> GridFrame {
        GridFrame::new(Point2::new(-1.0, -1.0), 0.1, 20, 20).unwrap()
    }

    #[test]
    fn every_cell_on_the_way_is_crossed_once_and_joined() {
        let frame = frame();
        for degrees in [0.0f64, 17.0, 45.0, 90.0, 133.0, 180.0, 271.0, 315.5] {
            let direction = Vector2::new(degrees.to_radians().cos(), degrees.to_radians().sin());
            let start = Point2::new(0.013, -0.027);
            let cells: Vec<_> = RayCells::new(&frame, start, direction, 0.83).collect();
            approx::assert_relative_eq!(cells.last().unwrap().leave, 0.83, epsilon = 1e-9);
            for pair in cells.windows(2) {
                approx::assert_relative_eq!(pair[0].leave, pair[1].enter, epsilon = 1e-12);
            }
            for cell in &cells {
                let middle = start + direction * (0.5 * (cell.enter + cell.leave));
                let (row, column) = frame.cell_at(middle).unwrap();
                if cell.leave - cell.enter > 1e-9 {
                    assert_eq!(frame.index(row, column), Some(cell.index), "{degrees} degrees");
                }
            }
        }
    }

    #[test]
    fn rays_are_clipped_to_the_grid() {
        let frame = frame();
        let through: Vec<_> = RayCells::new(&frame, Point2::new(-5.0, 0.05), Vector2::x(), 100.0).collect();
        assert_eq!(through.len(), 20);
        approx::assert_relative_eq!(through[0].enter, 4.0, epsilon = 1e-9);
        assert_eq!(RayCells::new(&frame, Point2::new(-5.0, 3.0), Vector2::x(), 100.0).count(), 0);
        assert_eq!(RayCells::new(&frame, Point2::new(-5.0, 0.0), Vector2::x(), 1.0).count(), 0);
    }

    #[test]
    fn nonsense_crosses_nothing() {
        let frame = frame();
        assert_eq!(RayCells::new(&frame, Point2::new(f64::NAN, 0.0), Vector2::x(), 1.0).count(), 0);
        assert_eq!(RayCells::new(&frame, Point2::origin(), Vector2::x(), f64::NAN).count(), 0);
    }
}

use nalgebra::{Isometry2, Point2, Vector2};

use crate::GridFrame;

/// Sweeps over every cell whose centre lies in a cone: yields `(index, distance, bearing)`, metres and radians from
/// the cone's apex and axis.
#[derive(Debug, Clone)]
pub struct ConeCells {
    frame: GridFrame,
    apex: Point2<f64>,
    axis: Vector2<f64>,
    half_width: f64,
    cos_half_width: f64,
    reach: f64,
    columns: (usize, usize),
    rows: (usize, usize),
    row: usize,
    column: usize,
}

impl ConeCells {
    /// The cone with its apex at `grid_from_sensor`, its axis along the sensor's `+x`, `half_width` radians (up to π) to
    /// either side, up to `reach` metres.
    #[must_use]
    pub fn new(frame: &GridFrame, grid_from_sensor: &Isometry2<f64>, half_width: f64, reach: f64) -> Self {
        let apex = Point2::from(grid_from_sensor.translation.vector);
        let axis = grid_from_sensor.rotation * Vector2::x();
        let (low, high) = bounds(apex, axis, half_width, reach);
        let rows = span(low.y - frame.origin().y, high.y - frame.origin().y, frame.resolution(), frame.rows());
        let cos_half_width = half_width.cos();
        let mut cells = Self {
            frame: *frame,
            apex,
            axis,
            half_width,
            cos_half_width,
            reach,
            columns: (0, 0),
            rows,
            row: rows.0,
            column: 0,
        };
        cells.enter_row();
        cells
    }

    /// Narrows the columns to those that the current row can have in common with the cone.
    fn enter_row(&mut self) {
        let up = self.frame.center(self.row, 0).y - self.apex.y;
        let half_chord = (self.reach * self.reach - up * up).max(0.0).sqrt();
        let (mut low, mut high) = (-half_chord, half_chord);
        if self.half_width < std::f64::consts::FRAC_PI_2 {
            // A cone narrower than a half plane lies to the left of its right edge, and to the right of its left one.
            for side in [-1.0, 1.0] {
                let edge = nalgebra::Rotation2::new(side * self.half_width) * self.axis;
                let inward = Vector2::new(edge.y, -edge.x) * side;
                if inward.x > 1e-9 {
                    low = low.max(-inward.y * up / inward.x);
                } else if inward.x < -1e-9 {
                    high = high.min(-inward.y * up / inward.x);
                }
            }
        }
        let (left, slack) = (self.apex.x - self.frame.origin().x, self.frame.resolution());
        self.columns = span(left + low - slack, left + high + slack, self.frame.resolution(), self.frame.columns());
        self.column = self.columns.0;
    }

    /// Distance and bearing of the centre of the current cell, if it lies in the cone.
    fn judge(&self) -> Option<(f64, f64)> {
        let to = self.frame.center(self.row, self.column) - self.apex;
        let distance = to.norm();
        let along = to.dot(&self.axis);
        if distance > self.reach || along < distance * self.cos_half_width {
            return None;
        }
        Some((distance, self.axis.perp(&to).atan2(along)))
    }
}

/// The box around the sector: its apex, its two far corners, and those poles of its circle that it holds.
fn bounds(apex: Point2<f64>, axis: Vector2<f64>, half_width: f64, reach: f64) -> (Point2<f64>, Point2<f64>) {
    let (mut low, mut high) = (apex, apex);
    let mut grow = |point: Point2<f64>| {
        low = low.inf(&point);
        high = high.sup(&point);
    };
    for side in [-half_width, half_width] {
        grow(apex + nalgebra::Rotation2::new(side) * axis * reach);
    }
    let cos_half_width = half_width.cos();
    for pole in [Vector2::x(), Vector2::y(), -Vector2::x(), -Vector2::y()] {
        if axis.dot(&pole) >= cos_half_width {
            grow(apex + pole * reach);
        }
    }
    (low, high)
}

/// The cells `[first, last)` whose centres can lie between `low` and `high`.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturating by the language's rule, then clamped to the grid"
)]
fn span(low: f64, high: f64, resolution: f64, n: usize) -> (usize, usize) {
    let first = (low / resolution - 0.5).ceil().max(0.0) as usize;
    let last = (high / resolution - 0.5).floor();
    let last = if last >= 0.0 { (last as usize).saturating_add(1) } else { 0 };
    (first.min(n), last.min(n))
}

impl Iterator for ConeCells {
    type Item = (usize, f64, f64);

    fn next(&mut self) -> Option<Self::Item> {
        while self.row < self.rows.1 {
            if self.column >= self.columns.1 {
                self.row += 1;
                self.enter_row();
                continue;
            }
            let found = self.judge();
            let index = self.row * self.frame.columns() + self.column;
            self.column += 1;
            if let Some((distance, bearing)) = found {
                return Some((index, distance, bearing));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_holds_the_cells_that_a_full_search_finds() {
        let frame = GridFrame::new(Point2::new(-2.0, -2.0), 0.1, 40, 40).unwrap();
        for (turn, half_width) in [(0.0, 0.22), (0.7, 0.22), (2.9, 0.6), (-1.5, 1.7), (0.3, 3.1)] {
            let sensor = Isometry2::new(Vector2::new(0.03, -0.4), turn);
            let swept: Vec<usize> = ConeCells::new(&frame, &sensor, half_width, 1.3).map(|(index, ..)| index).collect();
            let inside = |index: &usize| {
                let point = sensor.inverse_transform_point(&frame.center(index / 40, index % 40));
                point.coords.norm() <= 1.3 && point.y.atan2(point.x).abs() <= half_width
            };
            let searched: Vec<usize> = (0..frame.n_cells()).filter(inside).collect();
            assert_eq!(swept, searched);
        }
    }

    #[test]
    fn a_cone_outside_the_grid_is_empty() {
        let frame = GridFrame::new(Point2::origin(), 0.1, 10, 10).unwrap();
        let away = Isometry2::new(Vector2::new(-3.0, 0.0), 3.0);
        assert_eq!(ConeCells::new(&frame, &away, 0.2, 2.0).count(), 0);
        let nan = Isometry2::new(Vector2::new(f64::NAN, 0.0), 0.0);
        assert_eq!(ConeCells::new(&frame, &nan, 0.2, 2.0).count(), 0);
    }
}

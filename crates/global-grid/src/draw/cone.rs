use nalgebra::Isometry2;

/// Rows that are worked out at once.
pub(crate) const CHUNK: usize = 16;

/// A sonar's cone over the cells of a plane; lengths in cells, relative to the cell that holds the apex.
///
/// A row is cut by the two edges of the cone and by a circle. Every bound is `max` or `min` of straight lines and of the
/// circle's half chord, without a branch, so that the compiler works out four rows at a time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cone {
    /// The cell that holds the apex: row, column.
    pub(crate) cell: (i32, i32),
    /// Where in its cell the apex lies, x and y in `[0, 1)`.
    within: (f32, f32),
    /// Lines `slope · dy + offset` that bound a row from below and from above.
    lower: [(f32, f32); 2],
    upper: [(f32, f32); 2],
    axis: (f32, f32),
    half_width: (f32, f32),
}

/// Half the width of a cone with its sine and cosine: worked out once for many readings of one sensor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Opening {
    half_width: f64,
    sin_cos: (f64, f64),
}

impl Default for Opening {
    fn default() -> Self {
        Self { half_width: 0.0, sin_cos: (0.0, 1.0) }
    }
}

impl Opening {
    /// Sine and cosine of `half_width` radians.
    #[expect(clippy::float_cmp, reason = "only the very same angle has the same sine")]
    pub(crate) fn of(&mut self, half_width: f64) -> (f64, f64) {
        if half_width != self.half_width {
            *self = Self { half_width, sin_cos: half_width.sin_cos() };
        }
        self.sin_cos
    }
}

/// So far off that it bounds nothing.
const FAR: f32 = 1e9;

impl Cone {
    /// The cone of a sensor with its apex at `map_from_sensor` (metres), `half_width` radians (below π/2) to either side.
    pub(crate) fn new(map_from_sensor: &Isometry2<f64>, half_width: (f64, f64), resolution: f64) -> Self {
        let apex = map_from_sensor.translation.vector / resolution;
        let corner = apex.map(f64::floor);
        let (sin, cos) = half_width;
        let (ax, ay) = (map_from_sensor.rotation.re, map_from_sensor.rotation.im);
        let (right, left) = ((ax * cos + ay * sin, ay * cos - ax * sin), (ax * cos - ay * sin, ay * cos + ax * sin));
        let nothing_below = (0.0, -FAR);
        let nothing_above = (0.0, FAR);
        let slope = |(x, y): (f64, f64)| (single(x / if y.abs() < 1e-7 { 1e-7f64.copysign(y) } else { y }), 0.0);
        let up = |(_, y): (f64, f64)| !y.is_sign_negative();
        Self {
            cell: (whole(corner.y), whole(corner.x)),
            within: (single(apex.x - corner.x), single(apex.y - corner.y)),
            // Inside is left of the right edge and right of the left edge.
            lower: [
                if up(right) { nothing_below } else { slope(right) },
                if up(left) { slope(left) } else { nothing_below },
            ],
            upper: [
                if up(right) { slope(right) } else { nothing_above },
                if up(left) { nothing_above } else { slope(left) },
            ],
            axis: (single(ax), single(ay)),
            half_width: (single(sin), single(cos)),
        }
    }

    /// The rows `[first, last)`, relative to the apex' cell, that the cone can reach between two radii, in cells.
    pub(crate) fn rows(&self, inner: f32, outer: f32) -> (i32, i32) {
        let ((ax, ay), (sin, cos)) = (self.axis, self.half_width);
        let (low, high) = reach(ay, (ay * cos - ax * sin, ay * cos + ax * sin), cos, (inner, outer));
        (nearest(low + self.within.1), nearest(high + self.within.1))
    }

    /// The columns `[first, last)`, relative to the apex' cell, that the cone can reach between two radii, in cells.
    pub(crate) fn columns(&self, inner: f32, outer: f32) -> (i32, i32) {
        let ((ax, ay), (sin, cos)) = (self.axis, self.half_width);
        let (low, high) = reach(ax, (ax * cos + ay * sin, ax * cos - ay * sin), cos, (inner, outer));
        (nearest(low + self.within.0), nearest(high + self.within.0))
    }

    /// The unit vector along the axis.
    pub(crate) fn axis(&self) -> (f32, f32) {
        self.axis
    }

    /// How far north of the apex the middle of a row lies.
    pub(crate) fn northing(&self, row: i32) -> f32 {
        #[expect(clippy::cast_precision_loss, reason = "a footprint is a few thousand cells")]
        let row = row as f32;
        row + 0.5 - self.within.1
    }

    /// How far east of the apex the middle of a column lies.
    pub(crate) fn easting(&self, column: i32) -> f32 {
        #[expect(clippy::cast_precision_loss, reason = "a footprint is a few thousand cells")]
        let column = column as f32;
        column + 0.5 - self.within.0
    }

    /// The columns `[first, last)`, relative to the apex' cell, of the cells within the cone and within `radius` cells:
    /// those of [`CHUNK`] rows from `row` on. An empty span has `first >= last`.
    pub(crate) fn spans(&self, row: i32, radius: f32) -> [(i32, i32); CHUNK] {
        self.nested_spans(row, [radius])[0]
    }

    /// As [`Cone::spans`], for several radii at once.
    pub(crate) fn nested_spans<const N: usize>(&self, row: i32, radii: [f32; N]) -> [[(i32, i32); CHUNK]; N] {
        let (squares, start) = (radii.map(|radius| radius * radius.abs()), self.northing(row));
        let mut spans = [[(0, 0); CHUNK]; N];
        for k in 0..CHUNK {
            #[expect(clippy::cast_precision_loss, reason = "below 16")]
            let dy = start + k as f32;
            let below = larger(self.lower[0].0 * dy + self.lower[0].1, self.lower[1].0 * dy + self.lower[1].1);
            let above = smaller(self.upper[0].0 * dy + self.upper[0].1, self.upper[1].0 * dy + self.upper[1].1);
            for (spans, square) in spans.iter_mut().zip(squares) {
                let half = larger(square - dy * dy, 0.0).sqrt();
                let first = smaller(larger(below, -half), half);
                let last = larger(smaller(above, half), -half);
                spans[k] = (nearest(first + self.within.0), nearest(last + self.within.0));
            }
        }
        spans
    }
}

/// How far a ring between two radii reaches down and up one axis, of whose unit the cone's axis has the share `along` and
/// its two edges the shares `edges`.
fn reach(along: f32, edges: (f32, f32), cos: f32, (inner, outer): (f32, f32)) -> (f32, f32) {
    let (lowest, highest) = (smaller(edges.0, edges.1), larger(edges.0, edges.1));
    let low = if -along >= cos { -outer } else { lowest * if lowest < 0.0 { outer } else { inner } };
    let high = if along >= cos { outer } else { highest * if highest > 0.0 { outer } else { inner } };
    (low, high)
}

/// `max` without regard to NaN, which is one instruction.
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `min` without regard to NaN, which is one instruction.
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The nearest whole number; `|x|` must stay below `2²²`.
///
/// In `1.5 · 2²³ + x` the last place is worth 1, so that the sum's bits hold the rounded number.
pub(crate) fn nearest(x: f32) -> i32 {
    const SHIFT: f32 = 12_582_912.0;
    #[expect(clippy::cast_possible_wrap, reason = "the difference of the bits is what is wanted")]
    let number = (x + SHIFT).to_bits().wrapping_sub(SHIFT.to_bits()) as i32;
    number
}

#[expect(clippy::cast_possible_truncation, reason = "single precision resolves a millionth of a beam")]
fn single(x: f64) -> f32 {
    x as f32
}

#[expect(clippy::cast_possible_truncation, reason = "poses are checked at the door")]
fn whole(x: f64) -> i32 {
    x as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point2, Vector2};

    #[test]
    fn spans_hold_the_cells_that_a_full_search_finds() {
        for turn in 0..64 {
            let turn = f64::from(turn);
            let sensor = Isometry2::new(Vector2::new(0.313 + turn, -7.77), turn * 0.0982); // also exactly along the axes
            let half_width: f64 = if turn < 40.0 { 0.218 } else { 1.2 };
            let cone = Cone::new(&sensor, half_width.sin_cos(), 1.0);
            let radius = 3.0 + turn;
            let inside = |row: i32, column: i32, slack: f64| {
                let (row, column) = (f64::from(cone.cell.0 + row), f64::from(cone.cell.1 + column));
                let point = sensor.inverse_transform_point(&Point2::new(column + 0.5, row + 0.5));
                let off = point.y.abs() * half_width.cos() - point.x * half_width.sin(); // metres outside the edge
                point.coords.norm() <= radius + slack && off <= slack && point.x >= -slack
            };
            let rows = cone.rows(0.0, single(radius));
            for first in (-80..80).step_by(CHUNK) {
                let spans = cone.spans(first, single(radius));
                for (row, span) in (first..).zip(spans) {
                    for column in -80..80 {
                        let held = rows.0 <= row && row < rows.1 && span.0 <= column && column < span.1;
                        assert!(!held || inside(row, column, 1e-4), "{turn} {row} {column} held");
                        assert!(held || !inside(row, column, -1e-4), "{turn} {row} {column} missed");
                    }
                }
            }
        }
    }

    #[test]
    fn rounding_goes_to_the_nearest() {
        assert_eq!([-2.7, -0.4, 0.4, 2.6, 4_000_000.0].map(nearest), [-3, 0, 0, 3, 4_000_000]);
    }
}

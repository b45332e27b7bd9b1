use nalgebra::Point2;

/// Where a grid lies in its frame and how it is cut into cells.
///
/// `origin` is the outer corner of cell (row 0, column 0); columns grow along `+x`, rows along `+y`.
/// Cell `(row, column)` covers `[origin + resolution · (column, row), + resolution)`, and its index in
/// row-major order is `row · columns + column`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawFrame", into = "RawFrame"))]
pub struct GridFrame {
    origin: Point2<f64>,
    resolution: f64,
    rows: usize,
    columns: usize,
}

/// The frame as a file holds it: reading goes through [`GridFrame::new`].
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct RawFrame {
    origin: [f64; 2],
    resolution: f64,
    rows: usize,
    columns: usize,
}

/// Why a frame cannot exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The edge of a cell must be a length that a grid can use.
    #[error("resolution must be between 0.0001 and 1000 metres per cell, got {0}")]
    Resolution(f64),
    /// The corner must be a point.
    #[error("origin must be finite, got ({0}, {1})")]
    Origin(f64, f64),
    /// The cells must fit into memory.
    #[error("a grid of {rows} rows and {columns} columns has more than {} cells", GridFrame::MAX_CELLS)]
    TooLarge {
        /// Rows asked for.
        rows: usize,
        /// Columns asked for.
        columns: usize,
    },
}

impl GridFrame {
    /// The most cells that one dense grid may have (2³²; larger maps are tiled).
    pub const MAX_CELLS: usize = 1 << 32;

    /// A frame of `rows × columns` square cells with edges of `resolution` metres.
    ///
    /// # Errors
    ///
    /// A resolution outside `[1e-4, 1e3]` m, a corner that is not finite, or more than [`Self::MAX_CELLS`] cells.
    pub fn new(origin: Point2<f64>, resolution: f64, rows: usize, columns: usize) -> Result<Self, FrameError> {
        if !(1e-4..=1e3).contains(&resolution) {
            return Err(FrameError::Resolution(resolution));
        }
        if !(origin.x.is_finite() && origin.y.is_finite()) {
            return Err(FrameError::Origin(origin.x, origin.y));
        }
        match rows.checked_mul(columns) {
            Some(cells) if cells <= Self::MAX_CELLS => Ok(Self { origin, resolution, rows, columns }),
            _ => Err(FrameError::TooLarge { rows, columns }),
        }
    }

    /// The smallest frame that covers the box from `low` to `high`, its corner at a multiple of the resolution.
    ///
    /// # Errors
    ///
    /// As [`GridFrame::new`].
    pub fn covering(low: Point2<f64>, high: Point2<f64>, resolution: f64) -> Result<Self, FrameError> {
        if !(1e-4..=1e3).contains(&resolution) {
            return Err(FrameError::Resolution(resolution));
        }
        for corner in [low, high] {
            if !(corner.x.is_finite() && corner.y.is_finite()) {
                return Err(FrameError::Origin(corner.x, corner.y));
            }
        }
        let origin = (low.coords / resolution).map(f64::floor) * resolution;
        let cells = ((high.coords - origin) / resolution).map(|n| n.floor().max(0.0) + 1.0);
        let (columns, rows) = (count(cells.x), count(cells.y));
        Self::new(Point2::from(origin), resolution, rows, columns)
    }

    /// The outer corner of cell (0, 0), in metres.
    #[must_use]
    pub fn origin(&self) -> Point2<f64> {
        self.origin
    }

    /// The edge of a cell in metres.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// The number of rows, along `+y`.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The number of columns, along `+x`.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The number of cells.
    #[must_use]
    pub fn n_cells(&self) -> usize {
        self.rows * self.columns
    }

    /// The `(row, column)` of the cell that holds `point`, or `None` outside the grid.
    #[must_use]
    pub fn cell_at(&self, point: Point2<f64>) -> Option<(usize, usize)> {
        let steps = (point - self.origin) / self.resolution;
        let inside = steps.x >= 0.0 && steps.y >= 0.0; // false for NaN
        let (row, column) = (count(steps.y), count(steps.x));
        (inside && row < self.rows && column < self.columns).then_some((row, column))
    }

    /// The centre of cell `(row, column)` in metres; cells beyond the border have centres, too.
    #[must_use]
    pub fn center(&self, row: usize, column: usize) -> Point2<f64> {
        #[expect(clippy::cast_precision_loss, reason = "indices stay far below 2^52")]
        let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
        Point2::new(self.origin.x + x * self.resolution, self.origin.y + y * self.resolution)
    }

    /// The `(row, column)` of the cells whose centres lie within `reach` metres of the straight way between two points: what a
    /// round thing passes over. None where a point is not finite.
    pub fn cells_along(&self, from: Point2<f64>, to: Point2<f64>, reach: f64) -> impl Iterator<Item = (usize, usize)> {
        let (frame, way) = (*self, to - from);
        let steps = |point: Point2<f64>| (point - frame.origin) / frame.resolution;
        let (low, high) = (steps(from.inf(&to)).add_scalar(-reach / frame.resolution), steps(from.sup(&to)));
        let high = high.add_scalar(reach / frame.resolution);
        // An infinite box is clipped as well, and NaN counts as 0; the distances below let nothing of them through.
        let range = |low: f64, high: f64, limit: usize| {
            let end = if high >= 0.0 { count(high).saturating_add(1).min(limit) } else { 0 };
            count(low.max(0.0)).min(end)..end
        };
        let rows = if way.norm_squared().is_finite() { range(low.y, high.y, frame.rows) } else { 0..0 };
        let columns = range(low.x, high.x, frame.columns);
        rows.flat_map(move |row| columns.clone().map(move |column| (row, column))).filter(move |&(row, column)| {
            let offset = frame.center(row, column) - from;
            let share = if way.norm_squared() > 0.0 { offset.dot(&way) / way.norm_squared() } else { 0.0 };
            (offset - way * share.clamp(0.0, 1.0)).norm() <= reach
        })
    }

    /// The row-major index of cell `(row, column)`, or `None` outside the grid.
    #[must_use]
    pub fn index(&self, row: usize, column: usize) -> Option<usize> {
        (row < self.rows && column < self.columns).then(|| row * self.columns + column)
    }
}

/// A non-negative float as a count; what is too large for a count saturates and is refused by the caller's bound.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating by the language's rule")]
fn count(value: f64) -> usize {
    value as usize
}

#[cfg(feature = "serde")]
impl TryFrom<RawFrame> for GridFrame {
    type Error = FrameError;

    fn try_from(raw: RawFrame) -> Result<Self, FrameError> {
        Self::new(Point2::from(raw.origin), raw.resolution, raw.rows, raw.columns)
    }
}

#[cfg(feature = "serde")]
impl From<GridFrame> for RawFrame {
    fn from(frame: GridFrame) -> Self {
        Self { origin: frame.origin.into(), resolution: frame.resolution, rows: frame.rows, columns: frame.columns }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_holds_its_centre() {
        let frame = GridFrame::new(Point2::new(-1.0, 2.0), 0.1, 7, 5).unwrap();
        for (row, column) in [(0, 0), (6, 4), (3, 2)] {
            assert_eq!(frame.cell_at(frame.center(row, column)), Some((row, column)));
        }
        assert_eq!(frame.cell_at(Point2::new(-1.01, 2.0)), None);
        assert_eq!(frame.cell_at(Point2::new(f64::NAN, 2.0)), None);
    }

    #[test]
    fn a_way_passes_over_the_cells_beside_it() {
        let frame = GridFrame::new(Point2::new(-1.0, -1.0), 0.1, 30, 40).unwrap();
        let (from, to) = (Point2::new(0.03, 0.4), Point2::new(1.2, -0.7));
        let way = to - from;
        let near = |&(row, column): &(usize, usize)| {
            (0..=2000).any(|k| (frame.center(row, column) - (from + way * (f64::from(k) / 2000.0))).norm() <= 0.17)
        };
        let all = (0..30).flat_map(|row| (0..40).map(move |column| (row, column)));
        assert_eq!(frame.cells_along(from, to, 0.17).collect::<Vec<_>>(), all.filter(near).collect::<Vec<_>>());
        assert_eq!(frame.cells_along(frame.center(3, 4), frame.center(3, 4), 0.01).collect::<Vec<_>>(), [(3, 4)]);
        let cut = frame.cells_along(Point2::new(-5.0, 0.04), Point2::new(-0.96, 0.04), 0.05);
        assert_eq!(cut.collect::<Vec<_>>(), [(10, 0)], "what lies beyond the grid is left out");
        for far in [f64::NAN, f64::INFINITY, -1e300, -50.0] {
            assert_eq!(frame.cells_along(Point2::new(far, 0.0), Point2::new(far, 0.1), 0.2).count(), 0);
            assert_eq!(frame.cells_along(Point2::new(0.0, far), Point2::new(0.0, far), 0.2).count(), 0);
        }
    }

    #[test]
    fn covering_holds_both_corners() {
        let (low, high) = (Point2::new(-0.31, 0.2), Point2::new(1.0, 2.0));
        let frame = GridFrame::covering(low, high, 0.1).unwrap();
        assert!(frame.cell_at(low).is_some() && frame.cell_at(high).is_some());
    }

    #[test]
    fn impossible_frames_are_refused() {
        let corner = Point2::origin();
        assert_eq!(GridFrame::new(corner, 0.0, 1, 1), Err(FrameError::Resolution(0.0)));
        assert!(matches!(GridFrame::new(corner, 1e-9, 1, 1), Err(FrameError::Resolution(_))));
        assert!(matches!(GridFrame::new(corner, 0.1, usize::MAX, 3), Err(FrameError::TooLarge { .. })));
        assert!(matches!(
            GridFrame::covering(corner, Point2::new(f64::INFINITY, 0.0), 0.1),
            Err(FrameError::Origin(..))
        ));
    }
}

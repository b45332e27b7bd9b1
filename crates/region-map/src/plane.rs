//! A rectangle of cells with a rim of walls: what the algorithms inside this crate work on.

/// Row-major cells. Every mask of free space in this crate keeps a rim of cells that are not free, so that neighbours of a
/// free cell always exist.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plane<T> {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    pub(crate) cells: Vec<T>,
}

impl<T: Copy> Plane<T> {
    pub(crate) fn filled(rows: usize, columns: usize, value: T) -> Self {
        Self { rows, columns, cells: vec![value; rows * columns] }
    }

    pub(crate) fn like<U>(other: &Plane<U>, value: T) -> Self {
        Self::filled(other.rows, other.columns, value)
    }

    pub(crate) fn row(&self, row: usize) -> &[T] {
        &self.cells[row * self.columns..(row + 1) * self.columns]
    }

    /// The cell at signed coordinates, if it exists.
    #[expect(clippy::cast_sign_loss, reason = "checked to be non-negative")]
    pub(crate) fn at(&self, row: i32, column: i32) -> Option<T> {
        if row < 0 || column < 0 {
            return None;
        }
        let (row, column) = (row as usize, column as usize);
        (row < self.rows && column < self.columns).then(|| self.cells[row * self.columns + column])
    }

    /// `(row, column)` of an index.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "planes have fewer than 2^31 rows and columns"
    )]
    pub(crate) fn position(&self, index: usize) -> (i32, i32) {
        ((index / self.columns) as i32, (index % self.columns) as i32)
    }
}

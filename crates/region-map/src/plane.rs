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
    pub(crate) fn at(&self, cell: (i32, i32)) -> Option<T> {
        self.get(cell).copied()
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

impl<T> Plane<T> {
    /// The cell at signed coordinates, if it exists.
    pub(crate) fn get(&self, (row, column): (i32, i32)) -> Option<&T> {
        let (row, column) = (usize::try_from(row).ok()?, usize::try_from(column).ok()?);
        if row < self.rows && column < self.columns { Some(&self.cells[row * self.columns + column]) } else { None }
    }
}

/// The cell at a place between cell centres, `(row, column)`.
#[expect(clippy::cast_possible_truncation, reason = "saturating by the language's rule, and looked up with a check")]
pub(crate) fn cell((row, column): (f64, f64)) -> (i32, i32) {
    (row.round() as i32, column.round() as i32)
}

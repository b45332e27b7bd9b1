use nalgebra::Point2;

use crate::{Fuzzy, GridFrame};

/// A dense grid of cells in a frame; cells lie row by row, rows along `+y`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Grid<C> {
    frame: GridFrame,
    cells: Vec<C>,
}

/// A grid of fuzzy cells, empty and occupied kept apart.
pub type FuzzyGrid = Grid<Fuzzy>;

impl<C: Copy + Default> Grid<C> {
    /// A grid in which nothing is known.
    #[must_use]
    pub fn new(frame: GridFrame) -> Self {
        Self { frame, cells: vec![C::default(); frame.n_cells()] }
    }
}

impl<C> Grid<C> {
    /// A grid of given cells in row-major order, or the cells back if there are not `rows · columns` of them.
    ///
    /// # Errors
    ///
    /// The number of cells must be that of the frame.
    pub fn from_cells(frame: GridFrame, cells: Vec<C>) -> Result<Self, Vec<C>> {
        if cells.len() == frame.n_cells() { Ok(Self { frame, cells }) } else { Err(cells) }
    }

    /// Where the cells lie.
    #[must_use]
    pub fn frame(&self) -> &GridFrame {
        &self.frame
    }

    /// All cells in row-major order, first row lowest.
    #[must_use]
    pub fn cells(&self) -> &[C] {
        &self.cells
    }

    /// All cells in row-major order, first row lowest.
    pub fn cells_mut(&mut self) -> &mut [C] {
        &mut self.cells
    }

    /// The cell at `(row, column)`, or `None` outside.
    #[must_use]
    pub fn get(&self, row: usize, column: usize) -> Option<&C> {
        self.frame.index(row, column).map(|index| &self.cells[index])
    }

    /// The cell at `(row, column)`, or `None` outside.
    pub fn get_mut(&mut self, row: usize, column: usize) -> Option<&mut C> {
        self.frame.index(row, column).map(|index| &mut self.cells[index])
    }

    /// The cell that holds `point`, or `None` outside.
    #[must_use]
    pub fn at(&self, point: Point2<f64>) -> Option<&C> {
        let (row, column) = self.frame.cell_at(point)?;
        self.get(row, column)
    }

    /// The same frame with every cell mapped by `f`.
    #[must_use]
    pub fn map<D>(&self, f: impl FnMut(&C) -> D) -> Grid<D> {
        Grid { frame: self.frame, cells: self.cells.iter().map(f).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_grow_along_y() {
        let frame = GridFrame::new(Point2::origin(), 1.0, 2, 3).unwrap();
        let mut grid = Grid::<u8>::new(frame);
        *grid.get_mut(1, 2).unwrap() = 7;
        assert_eq!(grid.at(Point2::new(2.5, 1.5)), Some(&7));
        assert_eq!(grid.cells(), &[0, 0, 0, 0, 0, 7]);
        assert_eq!(grid.get(2, 0), None);
    }

    #[test]
    fn a_wrong_number_of_cells_comes_back() {
        let frame = GridFrame::new(Point2::origin(), 1.0, 2, 3).unwrap();
        assert_eq!(Grid::from_cells(frame, vec![1]).unwrap_err(), vec![1]);
    }
}

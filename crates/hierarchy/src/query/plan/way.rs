//! Ways over cells, kept short: by the cells in which they turn.

use nalgebra::Point2;
use robot_log::local_grid::GridFrame;

/// A row and a column.
pub(super) type Cell = [i32; 2];

/// A way from cell to cell in eight directions, by its first cell, those in which it turns, and its last one.
#[derive(Debug)]
pub(super) struct Way(Vec<Cell>);

impl Way {
    pub(super) fn of(cells: &[Cell]) -> Self {
        let turns =
            |k: usize| k == 0 || k + 1 == cells.len() || step(cells[k - 1], cells[k]) != step(cells[k], cells[k + 1]);
        Self((0..cells.len()).filter(|&k| turns(k)).map(|k| cells[k]).collect())
    }

    /// All its cells.
    pub(super) fn cells(&self) -> Vec<Cell> {
        let mut cells: Vec<Cell> = self.0.first().copied().into_iter().collect();
        for pair in self.0.windows(2) {
            let [up, right] = step(pair[0], pair[1]);
            let mut at = pair[0];
            while at != pair[1] {
                at = [at[0] + up, at[1] + right];
                cells.push(at);
            }
        }
        cells
    }
}

/// The direction from a cell to another.
fn step(from: Cell, to: Cell) -> Cell {
    [(to[0] - from[0]).signum(), (to[1] - from[1]).signum()]
}

/// The cells of points.
pub(super) fn cells_of(points: &[Point2<f64>], frame: &GridFrame) -> Vec<Cell> {
    let narrow = |k: usize| i32::try_from(k).expect("a grid has at most 2³¹ rows and columns");
    points.iter().filter_map(|point| frame.cell_at(*point)).map(|(row, column)| [narrow(row), narrow(column)]).collect()
}

/// The centres of cells.
pub(super) fn centers(cells: &[Cell], frame: &GridFrame) -> Vec<Point2<f64>> {
    cells.iter().map(|[row, column]| frame.center(wide(*row), wide(*column))).collect()
}

/// A row or a column of a cell of a grid.
pub(super) fn wide(at: i32) -> usize {
    usize::try_from(at).expect("a cell of a grid")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_comes_back_as_it_was() {
        let cells = [[0, 0], [0, 1], [0, 2], [1, 3], [2, 4], [2, 3], [2, 4], [1, 4]];
        let way = Way::of(&cells);
        assert_eq!(way.0, [[0, 0], [0, 2], [2, 4], [2, 3], [2, 4], [1, 4]]);
        assert_eq!(way.cells(), cells);
        assert_eq!(Way::of(&cells[..1]).cells(), &cells[..1]);
    }
}

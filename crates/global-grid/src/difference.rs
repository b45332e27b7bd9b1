use std::io::Write;

use local_grid::{Cell, FrameError, Fuzzy, FuzzyGrid, Grid, GridFrame};
use nalgebra::Vector2;

use crate::occupancy::{CrispOptions, Occupancy};
use crate::picture::{PictureError, Rgb, write_pixels};

/// What became of a cell from one map to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Change {
    /// Unknown in both.
    #[default]
    Unknown,
    /// Free in both.
    Free,
    /// Occupied in both.
    Occupied,
    /// Free, then occupied.
    Appeared,
    /// Occupied, then free.
    Vanished,
    /// Unknown, then known.
    Found,
    /// Known, then unknown.
    Lost,
}

impl Change {
    /// All changes, in the order of the palette of [`write_difference`].
    pub const ALL: [Self; 7] =
        [Self::Unknown, Self::Free, Self::Occupied, Self::Appeared, Self::Vanished, Self::Found, Self::Lost];

    /// What became of a cell.
    #[must_use]
    pub fn between(before: Occupancy, after: Occupancy) -> Self {
        match (before, after) {
            (Occupancy::Unknown, Occupancy::Unknown) => Self::Unknown,
            (Occupancy::Free, Occupancy::Free) => Self::Free,
            (Occupancy::Occupied, Occupancy::Occupied) => Self::Occupied,
            (Occupancy::Free, Occupancy::Occupied) => Self::Appeared,
            (Occupancy::Occupied, Occupancy::Free) => Self::Vanished,
            (Occupancy::Unknown, _) => Self::Found,
            (_, Occupancy::Unknown) => Self::Lost,
        }
    }

    /// Its colour in a picture, one that the colour-blind can tell from the others.
    #[must_use]
    pub fn color(self) -> [u8; 3] {
        match self {
            Self::Unknown => [222, 225, 228],
            Self::Free => [255, 255, 255],
            Self::Occupied => [70, 78, 86],
            Self::Appeared => [213, 94, 0],
            Self::Vanished => [0, 114, 178],
            Self::Found => [245, 214, 158],
            Self::Lost => [168, 203, 232],
        }
    }
}

/// The least frame of the first grid's lattice that covers all of them.
///
/// # Errors
///
/// Grids so far apart that no grid can hold them all.
pub fn common_frame(first: &FuzzyGrid, others: &[&FuzzyGrid]) -> Result<GridFrame, FrameError> {
    let (frame, cell) = (first.frame(), first.frame().resolution());
    let grids = || std::iter::once(first).chain(others.iter().copied());
    let corner = |grid: &FuzzyGrid| (grid.frame().origin() - frame.origin()) / cell;
    let size = |grid: &FuzzyGrid| {
        Vector2::new(grid.frame().columns() as f64, grid.frame().rows() as f64) * (grid.frame().resolution() / cell)
    };
    // A sliver of a cell is rounding, not a cell.
    let low = grids().map(|grid| corner(grid).map(|at| (at + 1e-6).floor())).fold(Vector2::zeros(), |a, b| a.inf(&b));
    let ends = grids().map(|grid| (corner(grid) + size(grid)).map(|at| (at - 1e-6).ceil()));
    let cells = ends.fold(Vector2::zeros(), |a: Vector2<f64>, b| a.sup(&b)) - low;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates, and is checked by the frame"
    )]
    let (rows, columns) = (cells.y as usize, cells.x as usize);
    GridFrame::new(frame.origin() + low * cell, cell, rows, columns)
}

/// A grid in another frame: each cell is the one of `grid` in which its centre lies, or unknown outside.
#[must_use]
pub fn resampled<C: Cell>(grid: &Grid<C>, frame: &GridFrame) -> Grid<C> {
    let mut sampled = Grid::new(*frame);
    let columns = frame.columns().max(1);
    for (index, cell) in sampled.cells_mut().iter_mut().enumerate() {
        if let Some(known) = grid.at(frame.center(index / columns, index % columns)) {
            *cell = *known;
        }
    }
    sampled
}

/// What became of every cell from one map to another of the same coordinates, in the [`common_frame`] of both.
///
/// # Errors
///
/// As [`common_frame`].
///
/// # Panics
///
/// Never: there are as many changes as cells.
pub fn difference(before: &FuzzyGrid, after: &FuzzyGrid, options: &CrispOptions) -> Result<Grid<Change>, FrameError> {
    let frame = common_frame(before, &[after])?;
    let crisp = |grid: &FuzzyGrid| resampled(grid, &frame).map(|&cell: &Fuzzy| options.occupancy(cell));
    let (before, after) = (crisp(before), crisp(after));
    let changes = before.cells().iter().zip(after.cells()).map(|(before, after)| Change::between(*before, *after));
    Ok(Grid::from_cells(frame, changes.collect()).expect("as many cells as the frame has"))
}

/// How many cells changed in which way.
#[must_use]
pub fn count_changes(changes: &Grid<Change>) -> [(Change, usize); 7] {
    Change::ALL.map(|change| (change, changes.cells().iter().filter(|cell| **cell == change).count()))
}

/// Draws changes as a PNG of one pixel per cell; [`Change::color`] says what is what.
///
/// # Errors
///
/// Those of the writer, or a map too large for a PNG.
pub fn write_difference(changes: &Grid<Change>, out: impl Write) -> Result<(), PictureError> {
    let palette: Vec<Rgb> = Change::ALL.map(Change::color).to_vec();
    let index = |change: &Change| (0u8..).zip(Change::ALL).find(|(_, other)| other == change).map_or(0, |(at, _)| at);
    write_pixels(changes.frame(), &palette, changes.cells().iter().map(index), out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    fn grid(x: f64, cells: &[(f32, f32)]) -> FuzzyGrid {
        let frame = GridFrame::new(Point2::new(x, 0.0), 0.1, 1, cells.len()).unwrap();
        Grid::from_cells(frame, cells.iter().map(|&(empty, occupied)| Fuzzy { empty, occupied }).collect()).unwrap()
    }

    const FREE: (f32, f32) = (1.0, 0.0);
    const WALL: (f32, f32) = (0.0, 1.0);
    const NOTHING: (f32, f32) = (0.0, 0.0);

    #[test]
    fn every_change_is_told() {
        let before = grid(0.0, &[NOTHING, FREE, WALL, FREE, WALL, NOTHING, WALL]);
        let after = grid(0.0, &[NOTHING, FREE, WALL, WALL, FREE, FREE, NOTHING]);
        let changes = difference(&before, &after, &CrispOptions::default()).unwrap();
        assert_eq!(changes.cells(), Change::ALL);
        assert!(count_changes(&changes).iter().all(|(_, count)| *count == 1));
        let mut png = Vec::new();
        write_difference(&changes, &mut png).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, [0, 1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn maps_of_other_extent_are_compared_where_they_lie() {
        let (before, after) = (grid(0.0, &[WALL, FREE]), grid(0.1, &[FREE, WALL]));
        let changes = difference(&before, &after, &CrispOptions::default()).unwrap();
        assert_eq!(changes.cells(), [Change::Lost, Change::Free, Change::Found]);
        let left = difference(&after, &before, &CrispOptions::default()).unwrap();
        assert_eq!(left.cells(), [Change::Found, Change::Free, Change::Lost]);
        approx::assert_abs_diff_eq!(left.frame().origin().x, 0.0, epsilon = 1e-12);
    }

    #[test]
    fn a_finer_map_is_sampled() {
        let frame = GridFrame::new(Point2::new(0.0, 0.0), 0.05, 2, 4).unwrap();
        let fine: FuzzyGrid = Grid::from_cells(frame, vec![Fuzzy { empty: 1.0, occupied: 0.0 }; 8]).unwrap();
        let changes = difference(&grid(0.0, &[FREE, WALL]), &fine, &CrispOptions::default()).unwrap();
        assert_eq!(changes.cells(), [Change::Free, Change::Vanished]);
    }
}

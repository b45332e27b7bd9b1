use local_grid::{Fuzzy, FuzzyGrid, Grid};

use crate::Exposure;

/// What a cell is, as planners take it: one of three.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Occupancy {
    /// Not known, or known too badly.
    #[default]
    Unknown,
    /// A robot can be there, as far as the cell itself goes.
    Free,
    /// Something is there.
    Occupied,
}

/// When a cell with degrees `E` of emptiness and `O` of occupancy counts as occupied, free or contradictory.
///
/// Occupied if `O > E` and `O > occupied`; free if `E > O` and `E > free`; contradictory if its
/// [`contradiction`](Exposure::contradiction) exceeds `contradictory`; all after [`exposure`](CrispOptions::exposure).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct CrispOptions {
    /// Least degree of occupancy of an occupied cell.
    pub occupied: f32,
    /// Least degree of emptiness of a free cell.
    pub free: f32,
    /// Least degree of contradiction of a contradictory cell.
    pub contradictory: f32,
    /// By how much evidence is multiplied before it is judged. Thresholds suit maps of one density of readings; the exposure
    /// suits them to others.
    pub exposure: Exposure,
}

impl Default for CrispOptions {
    fn default() -> Self {
        Self { occupied: 0.5, free: 0.3, contradictory: 0.5, exposure: Exposure::default() }
    }
}

impl CrispOptions {
    /// The thresholds as they suit a map: its evidence exposed by [`Exposure::of`].
    #[must_use]
    pub fn for_map(grid: &FuzzyGrid) -> Self {
        Self { exposure: Exposure::of(grid), ..Self::default() }
    }

    /// What the cell counts as.
    #[must_use]
    pub fn occupancy(&self, cell: Fuzzy) -> Occupancy {
        let cell = self.exposure.of_cell(cell);
        if cell.occupied > cell.empty && cell.occupied > self.occupied {
            Occupancy::Occupied
        } else if cell.empty > cell.occupied && cell.empty > self.free {
            Occupancy::Free
        } else {
            Occupancy::Unknown
        }
    }

    /// Whether the cell's readings contradict each other.
    #[must_use]
    pub fn is_contradictory(&self, cell: Fuzzy) -> bool {
        self.exposure.contradiction(cell) > self.contradictory
    }
}

/// How many cells of a map are what. Contradictory cells are counted beside what they are taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CellCounts {
    /// Cells taken for occupied.
    pub occupied: usize,
    /// Cells taken for free.
    pub empty: usize,
    /// Cells whose readings contradict each other.
    pub contradictory: usize,
    /// Cells of which nothing is known, or too little.
    pub unexplored: usize,
}

/// The crisp map that planners read.
#[must_use]
pub fn occupancy(grid: &FuzzyGrid, options: &CrispOptions) -> Grid<Occupancy> {
    grid.map(|&cell| options.occupancy(cell))
}

/// Counts what the cells are.
#[must_use]
pub fn count_cells(grid: &FuzzyGrid, options: &CrispOptions) -> CellCounts {
    let mut counts = CellCounts::default();
    for &cell in grid.cells() {
        match options.occupancy(cell) {
            Occupancy::Occupied => counts.occupied += 1,
            Occupancy::Free => counts.empty += 1,
            Occupancy::Unknown => counts.unexplored += 1,
        }
        counts.contradictory += usize::from(options.is_contradictory(cell));
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_decide() {
        let crisp = |empty, occupied| CrispOptions::default().occupancy(Fuzzy { empty, occupied });
        assert_eq!(crisp(0.0, 0.0), Occupancy::Unknown);
        assert_eq!(crisp(0.4, 0.1), Occupancy::Free);
        assert_eq!(crisp(0.2, 0.1), Occupancy::Unknown);
        assert_eq!(crisp(0.2, 0.6), Occupancy::Occupied);
        assert_eq!(crisp(0.7, 0.6), Occupancy::Free);
        assert_eq!(crisp(0.6, 0.6), Occupancy::Unknown);
        let contradictory = |empty, occupied| CrispOptions::default().is_contradictory(Fuzzy { empty, occupied });
        assert!(contradictory(0.6, 0.6) && !contradictory(0.6, 0.1) && !contradictory(0.1, 0.1));
    }

    #[test]
    fn a_timid_map_has_walls_and_floor_as_well() {
        let frame = local_grid::GridFrame::new(nalgebra::Point2::origin(), 0.1, 1, 3).unwrap();
        let cells = [(0.2, 0.0), (0.05, 0.15), (0.02, 0.0)].map(|(empty, occupied)| Fuzzy { empty, occupied });
        let grid = FuzzyGrid::from_cells(frame, cells.to_vec()).unwrap();
        assert!(occupancy(&grid, &CrispOptions::default()).cells().iter().all(|&cell| cell == Occupancy::Unknown));
        let crisp = occupancy(&grid, &CrispOptions::for_map(&grid));
        assert_eq!(crisp.cells(), [Occupancy::Free, Occupancy::Occupied, Occupancy::Unknown]);
        let balanced = Fuzzy { empty: 0.12, occupied: 0.12 };
        assert!(
            CrispOptions::for_map(&grid).is_contradictory(balanced)
                && !CrispOptions::default().is_contradictory(balanced)
        );
    }
}

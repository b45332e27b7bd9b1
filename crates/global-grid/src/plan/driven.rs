use local_grid::{FuzzyGrid, Grid};

use super::PlanOptions;
use crate::CrispOptions;
use crate::occupancy::Occupancy;

/// The most that ground counts as unsafe where the robot itself has been: it fits, but the map has its doubts.
const PROVEN: f32 = 0.5;
/// Between two positions farther apart than this, in metres, a robot may have driven anywhere.
pub const LONGEST_STEP: f64 = 0.8;
/// How far beside the line between two positions a cell's centre may lie, in cells: far enough that the cells join.
const BESIDE: f64 = 0.75;

/// Lowers the unsafety of the cells in which a robot's centre has been.
///
/// A cell that is clearly occupied now is left as it is: somebody may have shut the door behind the robot.
pub(super) fn trust(unsafety: &mut Grid<f32>, grid: &FuzzyGrid, options: &PlanOptions) {
    let crisp = CrispOptions { exposure: options.exposure, ..CrispOptions::default() };
    #[expect(clippy::cast_possible_truncation, reason = "a degree")]
    let most = PROVEN.min(options.forbidden as f32);
    let (frame, reach) = (*grid.frame(), BESIDE * grid.frame().resolution());
    let steps = options.driven.windows(2).filter(|pair| (pair[1] - pair[0]).norm() <= LONGEST_STEP); // NaN is not
    for (row, column) in steps.flat_map(|pair| frame.cells_along(pair[0], pair[1], reach)) {
        let index = row * frame.columns() + column;
        if crisp.occupancy(grid.cells()[index]) != Occupancy::Occupied {
            let cell = &mut unsafety.cells_mut()[index];
            *cell = cell.min(most);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{PlanError, plan};
    use local_grid::nalgebra::Point2;
    use local_grid::{Fuzzy, GridFrame};

    /// Two rooms of 2 × 2 m with a wall between them, whose door is too narrow for the margin; what the door's cell holds.
    fn rooms(in_the_door: Fuzzy) -> FuzzyGrid {
        let frame = GridFrame::new(Point2::new(-1.0, -2.0), 0.1, 40, 60).unwrap();
        let mut grid = Grid::new(frame);
        for row in 0..40 {
            for column in 0..60 {
                let door = (18..22).contains(&row);
                let wall = !(3..37).contains(&row) || !(3..57).contains(&column) || (column == 30 && !door);
                let clear = Fuzzy { empty: 0.99, occupied: 0.0 };
                let cell = if column == 30 && door { in_the_door } else { clear };
                *grid.get_mut(row, column).unwrap() = if wall { Fuzzy { empty: 0.1, occupied: 0.95 } } else { cell };
            }
        }
        grid
    }

    const ENDS: (Point2<f64>, Point2<f64>) = (Point2::new(0.2, -0.4), Point2::new(3.9, 0.5));

    fn driven() -> Vec<Point2<f64>> {
        (0..9).map(|k| Point2::new(0.5 + 0.4 * f64::from(k), -0.02 + 0.01 * f64::from(k))).collect()
    }

    #[test]
    fn where_the_robot_drove_it_may_drive_again() {
        let doubtful = rooms(Fuzzy { empty: 0.7, occupied: 0.7 });
        let alone = PlanOptions::default();
        assert!(matches!(plan(&doubtful, ENDS.0, ENDS.1, &alone), Err(PlanError::Unreachable { .. })));
        let options = PlanOptions { driven: driven(), ..alone };
        let path = plan(&doubtful, ENDS.0, ENDS.1, &options).unwrap();
        assert!((path.risk - 0.5).abs() < 1e-6 && path.length < 5.0, "{path:?}");
        // Only the way itself is proven, not the ground beside it.
        let gap = path.points.iter().filter(|point| (point.x - 2.05).abs() < 0.3);
        assert!(gap.clone().count() > 3 && gap.clone().all(|point| point.y.abs() < 0.16), "{path:?}");
    }

    #[test]
    fn a_door_that_was_shut_afterwards_stays_shut() {
        let shut = rooms(Fuzzy { empty: 0.2, occupied: 0.9 });
        let options = PlanOptions { driven: driven(), ..PlanOptions::default() };
        assert!(matches!(plan(&shut, ENDS.0, ENDS.1, &options), Err(PlanError::Unreachable { .. })));
    }

    #[test]
    fn jumps_and_ways_beyond_the_map_prove_nothing() {
        let doubtful = rooms(Fuzzy { empty: 0.7, occupied: 0.7 });
        let jump = vec![Point2::new(0.5, 0.0), Point2::new(3.7, 0.0)];
        let nonsense =
            vec![Point2::new(f64::NAN, 0.0), Point2::new(2.0, 0.0), Point2::new(-90.0, 7.0), Point2::new(-91.0, 7.0)];
        for driven in [jump, nonsense] {
            let options = PlanOptions { driven, ..PlanOptions::default() };
            assert!(matches!(plan(&doubtful, ENDS.0, ENDS.1, &options), Err(PlanError::Unreachable { .. })));
        }
    }
}

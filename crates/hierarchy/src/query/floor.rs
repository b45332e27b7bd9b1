use global_grid::Exposure;
use global_grid::plan::LONGEST_STEP;
use nalgebra::{Isometry2, Point2};
use region_map::{Element, Logic, dilate, erode};
use robot_log::local_grid::{FuzzyGrid, Grid};

/// Membership of each cell in "floor": empty, as far as that is known, and not contradicted by echoes; or driven over.
///
/// A wall between two rooms is seen from both of them, and rays along it pass its cells by: sonar leaves it as empty as it
/// is occupied. So what counts is the share of the evidence that says "occupied", in logarithms, where evidence adds up:
///
/// ```text
/// floor = min(E / 0.4, 1 − s / 0.6)      s = ln(1 − O) / (ln(1 − E) + ln(1 − O))
/// ```
///
/// `O` is closed before (dilated and eroded by a disc of 0.15 m): echoes dot a wall, and nobody passes between two dots. Both
/// are judged after [exposure](Exposure), so that it does not matter how timid the readings were.
///
/// `driven` are poses of the robot in the order in which it drove, or none. Where its body went is floor whatever the
/// echoes say: a sonar hears the frame of a door that it comes through from far off and from both sides, and half a dozen
/// echoes that lie a hand's breadth wrong close the door for good.
#[must_use]
pub fn floor(gridmap: &FuzzyGrid, driven: &[Isometry2<f64>]) -> Grid<f32> {
    let exposure = Exposure::of(gridmap);
    let disc = Element::disc(WALL_GAP / 2.0, gridmap.frame().resolution());
    let occupied = gridmap.map(|cell| exposure.of_cell(*cell).occupied.clamp(0.0, 1.0));
    let mut floor = erode(&dilate(&occupied, &disc, Logic::Goedel), &disc, Logic::Goedel);
    for (cell, fuzzy) in floor.cells_mut().iter_mut().zip(gridmap.cells()) {
        *cell = membership(exposure.of_cell(*fuzzy).empty.clamp(0.0, 1.0), *cell);
    }
    sweep(&mut floor, driven);
    floor
}

/// Echoes closer than this, in metres, are of one wall: less than what is left of a door between two posts that look a
/// quarter of a metre too thick.
const WALL_GAP: f64 = 0.3;
/// A cell of this degree of emptiness is as empty as a handful of readings makes it.
const EMPTY: f32 = 0.4;
/// A cell is no floor at all where this share of the evidence says "occupied".
const CONTRADICTED: f32 = 0.6;
/// Half of what a robot sweeps, in metres: less than any robot's radius, by what its poses may be off sideways.
const BODY: f64 = 0.15;

fn membership(empty: f32, occupied: f32) -> f32 {
    let evidence = |degree: f32| -(1.0 - degree).max(1e-6).ln();
    let (empty_evidence, occupied_evidence) = (evidence(empty), evidence(occupied));
    let share = occupied_evidence / (empty_evidence + occupied_evidence).max(f32::MIN_POSITIVE);
    (empty / EMPTY).min(1.0 - share / CONTRADICTED).clamp(0.0, 1.0)
}

/// Makes floor of what the robot's body passed over: the cells whose centres it came within [`BODY`] of.
fn sweep(floor: &mut Grid<f32>, driven: &[Isometry2<f64>]) {
    let frame = *floor.frame();
    let spots: Vec<Point2<f64>> = driven.iter().map(|pose| pose.translation.vector.into()).collect();
    let steps = spots.windows(2).filter(|pair| (pair[1] - pair[0]).norm() <= LONGEST_STEP);
    for (row, column) in steps.flat_map(|pair| frame.cells_along(pair[0], pair[1], BODY)) {
        floor.cells_mut()[row * frame.columns() + column] = 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;
    use robot_log::local_grid::{Fuzzy, GridFrame};

    #[test]
    fn what_was_driven_over_is_floor_and_a_leap_is_not() {
        let frame = GridFrame::new(Point2::origin(), 0.1, 20, 40).unwrap();
        let wall = FuzzyGrid::from_cells(frame, vec![Fuzzy { empty: 0.1, occupied: 0.9 }; 800]).unwrap();
        assert!(floor(&wall, &[]).cells().iter().all(|cell| *cell < 0.5));
        let poses = [0.35, 0.85, 1.35, 3.05].map(|x| Isometry2::new(Vector2::new(x, 1.05), 0.0));
        let floor = floor(&wall, &poses);
        let at = |x: f64, y: f64| *floor.at(Point2::new(x, y)).unwrap();
        assert!(at(0.25, 1.05) > 0.5 && at(0.6, 1.15) > 0.5 && at(1.45, 1.05) > 0.5);
        assert!(at(0.6, 1.25) < 0.5 && at(2.0, 1.05) < 0.5 && at(0.05, 1.05) < 0.5);
    }

    #[test]
    fn timid_readings_make_the_same_floor() {
        let frame = GridFrame::new(Point2::origin(), 0.1, 1, 10).unwrap();
        let cells = |n: i32| {
            let times = |degree: f32| 1.0 - (1.0 - degree).powi(n);
            let cell = |k: u8| Fuzzy { empty: times(0.1), occupied: times(0.02 * f32::from(k)) };
            FuzzyGrid::from_cells(frame, (0..10).map(cell).collect()).unwrap()
        };
        let (few, many) = (floor(&cells(3), &[]), floor(&cells(12), &[]));
        for (few, many) in few.cells().iter().zip(many.cells()) {
            assert!((few - many).abs() < 1e-3, "{few} {many}");
        }
    }
}

//! The numbers and the shapes of one sonar reading.

use std::sync::Arc;

use local_grid::nalgebra::{Isometry2, Point2, Vector2};
use local_grid::{
    BeamPoint, Fuzzy, FuzzyGrid, Grid, GridFrame, RangeSensor, Reading, Scan, SensorKind, SensorModel, SonarCone,
    Sounding,
};

fn one_sonar() -> Arc<RangeSensor> {
    let mounts = vec![Isometry2::identity()];
    let width = 25f64.to_radians();
    Arc::new(RangeSensor::new("sonar", SensorKind::Sonar, mounts, width, 0.3..=6.48).unwrap())
}

fn drawn(range: f64) -> FuzzyGrid {
    let frame = GridFrame::new(Point2::new(-1.0, -2.0), 0.05, 80, 120).unwrap();
    let mut grid = Grid::new(frame);
    let scan = Scan::from_ranges(one_sonar(), [range]).unwrap();
    grid.integrate(&SonarCone::default(), &Isometry2::identity(), &scan);
    grid
}

#[test]
fn a_reading_of_one_metre_has_the_tabulated_evidence() {
    let model = SonarCone::default();
    let table = [
        (0.5, 0.1, 0.0, 0.94268, 0.094_268, 0.0),
        (0.925, 0.025, 0.1875, 0.75026, 0.018_757, 0.140_674),
        (1.0, 0.0, 0.25, 0.68997, 0.0, 0.172_494),
        (1.075, 0.0, 0.1875, 0.62246, 0.0, 0.116_711),
        (1.15, 0.0, 0.0, 0.54983, 0.0, 0.0),
    ];
    for (distance, empty_radial, occupied_radial, visibility, empty, occupied) in table {
        approx::assert_relative_eq!(model.radial_empty(distance, 1.0), empty_radial, epsilon = 1e-9);
        approx::assert_relative_eq!(model.radial_occupied(distance, 1.0), occupied_radial, epsilon = 1e-9);
        approx::assert_relative_eq!(model.visibility_at(distance), visibility, epsilon = 1e-5);
        let point = BeamPoint { distance, bearing: 0.0, chord: 0.0 };
        let evidence = model.evidence(Sounding { range: 1.0, echo: true }, point);
        approx::assert_relative_eq!(f64::from(evidence.empty), empty, epsilon = 1e-6);
        approx::assert_relative_eq!(f64::from(evidence.occupied), occupied, epsilon = 1e-6);
    }
    approx::assert_relative_eq!(model.visibility_at(2.0), 0.0392, epsilon = 1e-4);
    approx::assert_relative_eq!(model.visibility_at(3.0), 0.00075, epsilon = 1e-5);
}

#[test]
fn the_main_lobe_is_that_of_a_polaroid() {
    let model = SonarCone::default();
    let lobe = [(0.0, 1.0), (2.5, 0.865), (5.0, 0.546), (7.5, 0.231), (10.0, 0.0484), (11.25, 0.0116), (12.5, 0.0002)];
    for (degrees, trust) in lobe {
        approx::assert_relative_eq!(model.angular(f64::to_radians(degrees)), trust, epsilon = 7e-4);
        approx::assert_relative_eq!(model.angular(-f64::to_radians(degrees)), trust, epsilon = 7e-4);
    }
    assert_eq!(model.angular(13f64.to_radians()), 0.0);
}

#[test]
fn empty_and_occupied_overlap_only_before_the_arc() {
    let grid = drawn(1.0);
    let frame = *grid.frame();
    for (index, cell) in grid.cells().iter().enumerate() {
        let center = frame.center(index / frame.columns(), index % frame.columns());
        let (distance, bearing) = (center.coords.norm(), center.y.atan2(center.x));
        if cell.empty > 0.0 && cell.occupied > 0.0 {
            assert!((0.85..1.0).contains(&distance), "both at {distance} m");
        }
        if *cell != Fuzzy::default() {
            assert!(bearing.abs() <= 12.5f64.to_radians() + 1e-9 && distance <= 1.15);
        }
    }
    assert!(grid.cells().iter().any(|cell| cell.occupied > 0.1));
}

#[test]
fn a_reading_is_symmetric_about_its_axis() {
    let grid = drawn(1.7);
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    for row in 0..rows {
        for column in 0..columns {
            let (cell, mirrored) = (grid.get(row, column).unwrap(), grid.get(rows - 1 - row, column).unwrap());
            approx::assert_relative_eq!(cell.empty, mirrored.empty, epsilon = 1e-6);
            approx::assert_relative_eq!(cell.occupied, mirrored.occupied, epsilon = 1e-6);
        }
    }
}

#[test]
fn longer_readings_empty_more() {
    let mut before = drawn(0.5);
    for range in [0.6, 0.83, 1.2, 1.9, 2.6] {
        let after = drawn(range);
        for (less, more) in before.cells().iter().zip(after.cells()) {
            assert!(more.empty >= less.empty, "a longer reading took emptiness back");
        }
        before = after;
    }
}

#[test]
fn silence_occupies_nothing() {
    let grid = drawn(7.0);
    assert!(grid.cells().iter().all(|cell| cell.occupied == 0.0));
    assert!(grid.cells().iter().any(|cell| cell.empty > 0.05));
}

#[test]
fn walls_are_drawn_from_the_robots_skin() {
    let width = 25f64.to_radians();
    let ring = Arc::new(RangeSensor::ring("sonar", SensorKind::Sonar, 16, 0.225, width, 0.3..=6.48).unwrap());
    let mut readings = vec![Reading::Invalid; 16];
    readings[4] = Reading::Echo(1.0); // looks left
    let scan = Scan::new(ring, readings).unwrap();
    let frame = GridFrame::new(Point2::new(-2.0, -2.0), 0.05, 80, 80).unwrap();
    let mut grid = FuzzyGrid::new(frame);
    grid.integrate(&SonarCone::default(), &Isometry2::new(Vector2::new(0.3, 0.1), 0.0), &scan);
    let wall = grid.cells().iter().enumerate().max_by(|a, b| a.1.occupied.total_cmp(&b.1.occupied)).unwrap().0;
    let center = frame.center(wall / 80, wall % 80);
    approx::assert_relative_eq!(center, Point2::new(0.3, 0.1 + 1.225), epsilon = 0.08);
}

#[test]
fn the_order_of_readings_does_not_matter() {
    let frame = GridFrame::new(Point2::new(-2.0, -2.0), 0.1, 40, 40).unwrap();
    let (mut forth, mut back) = (FuzzyGrid::new(frame), FuzzyGrid::new(frame));
    let scans: Vec<_> = (0..12)
        .map(|k| {
            let pose = Isometry2::new(Vector2::new(0.01 * f64::from(k), 0.0), 0.5 * f64::from(k));
            (pose, Scan::from_ranges(one_sonar(), [0.5 + 0.1 * f64::from(k)]).unwrap())
        })
        .collect();
    for (pose, scan) in &scans {
        forth.integrate(&SonarCone::default(), pose, scan);
    }
    for (pose, scan) in scans.iter().rev() {
        back.integrate(&SonarCone::default(), pose, scan);
    }
    for (a, b) in forth.cells().iter().zip(back.cells()) {
        approx::assert_relative_eq!(a.empty, b.empty, epsilon = 1e-6);
        approx::assert_relative_eq!(a.occupied, b.occupied, epsilon = 1e-6);
    }
}

#[test]
fn senseless_options_are_named() {
    let error = SonarCone { depth: f64::NAN, ..SonarCone::default() }.validate().unwrap_err();
    assert_eq!(error.to_string(), "sonar cone: `depth` must be a length in metres above 0, got NaN");
    assert!(SonarCone::default().validate().is_ok());
}

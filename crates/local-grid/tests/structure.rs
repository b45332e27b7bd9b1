//! Headings from walls: found where walls carry one, refused where they do not.

use std::sync::Arc;

use local_grid::nalgebra::{Isometry2, Point2, Vector2};
use local_grid::{
    Echo, RangeSensor, Scan, SensorKind, StructureOptions, WallRun, WallRunOptions, WallRuns, echoes,
    wall_direction_of_echoes,
};

use crate::laser::{flat, pose, scan};

fn off(found: f64, expected_degrees: f64) -> f64 {
    let turns = (found.to_degrees() - expected_degrees) / 90.0;
    90.0 * (turns - turns.round())
}

#[test]
fn a_scan_shows_the_direction_of_its_walls() {
    let world = flat();
    for degrees in [0.0, 12.5, 44.0, 75.0, -160.0] {
        let seen = echoes(&scan(&world, &pose(0.3, 0.1, degrees)), 20.0);
        let found = wall_direction_of_echoes(&seen, &StructureOptions::default()).unwrap();
        assert!(off(found.direction, -degrees).abs() < 0.3, "{degrees}: {found:?}");
        assert!(found.share > 0.9 && found.sigma < 0.01, "{found:?}");
    }
}

#[test]
fn a_round_room_carries_no_heading() {
    let echo = |k: i32| {
        let normal = Vector2::new(f64::from(k).to_radians().cos(), f64::from(k).to_radians().sin());
        Echo { point: Point2::from(normal * 4.0), normal: Some(normal) }
    };
    let round: Vec<Echo> = (0..360).map(echo).collect();
    assert_eq!(wall_direction_of_echoes(&round, &StructureOptions::default()), None);
    assert_eq!(wall_direction_of_echoes(&round[..20], &StructureOptions::default()), None);
    assert_eq!(wall_direction_of_echoes(&[], &StructureOptions::default()), None);
}

#[test]
fn turns_go_the_short_way_round() {
    let found = |degrees: f64| {
        let seen = echoes(&scan(&flat(), &pose(0.3, 0.1, -degrees)), 20.0);
        wall_direction_of_echoes(&seen, &StructureOptions::default()).unwrap()
    };
    approx::assert_relative_eq!(found(5.0).turn_to(80f64.to_radians()).to_degrees(), -15.0, epsilon = 0.3);
    approx::assert_relative_eq!(found(5.0).turn_to(45f64.to_radians()).to_degrees(), 40.0, epsilon = 0.3);
}

/// What eight sonars around a robot tell of surfaces, of which `nearest` gives the foot of the perpendicular, on a drive of
/// 5 m along `+x` that sways by 3°.
fn driven_past(nearest: impl Fn(Point2<f64>) -> Point2<f64>) -> Vec<WallRun> {
    let ring = RangeSensor::ring("sonar", SensorKind::Sonar, 8, 0.2, 0.4, 0.2..=5.0).unwrap();
    let (sensor, mut runs) = (Arc::new(ring), WallRuns::new(WallRunOptions::default()));
    let mut told = Vec::new();
    for k in 0..100 {
        let pose = Isometry2::new(Vector2::new(0.05 * f64::from(k), 0.0), 0.05 * (0.3 * f64::from(k)).sin());
        let range = |mount: &Isometry2<f64>| {
            let face = pose * mount;
            let way = nearest(face.translation.vector.into()) - Point2::from(face.translation.vector);
            let aside = (face.rotation.inverse() * way).y.atan2((face.rotation.inverse() * way).x);
            // Sonars round to whole centimetres.
            if aside.abs() < 0.2 { (way.norm() * 100.0).round() / 100.0 } else { 9.0 }
        };
        let scan = Scan::from_ranges(Arc::clone(&sensor), sensor.mounts().iter().map(range)).unwrap();
        told.extend(runs.push(&pose, &scan, f64::from(k)));
    }
    told
}

#[test]
fn walls_beside_a_driving_robot_show_their_direction_to_sonars() {
    for degrees in [0.0f64, 4.0, -7.0] {
        let along = Vector2::new(degrees.to_radians().cos(), degrees.to_radians().sin());
        let wall = |from: Point2<f64>| {
            let base = Point2::new(0.0, 1.2);
            base + along * (from - base).dot(&along)
        };
        let told = driven_past(wall);
        assert!(told.len() >= 2, "{degrees}: {told:?}");
        for run in told {
            assert!(off(run.direction, degrees).abs() < 0.5, "{degrees}: {run:?}");
            assert!(run.length >= 2.0 && run.sigma < 0.02 && run.marked > 10.0, "{run:?}");
        }
    }
}

#[test]
fn posts_and_round_walls_show_no_direction_to_sonars() {
    assert_eq!(driven_past(|_| Point2::new(2.0, 1.2)), [], "a post");
    let centre = Point2::new(2.0, -1.0);
    assert_eq!(driven_past(|from| centre + (from - centre).normalize() * 2.5), [], "a round wall");
}

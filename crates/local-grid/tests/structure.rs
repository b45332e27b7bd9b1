//! Headings from walls: found where walls carry one, refused where they do not.

use local_grid::nalgebra::{Isometry2, Point2, Vector2};
use local_grid::{
    Echo, FuzzyGrid, GridFrame, StructureOptions, echoes, wall_direction_of_echoes, wall_direction_of_grid,
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
fn a_grid_shows_the_direction_of_its_walls() {
    let frame = GridFrame::new(Point2::new(-4.0, -4.0), 0.1, 80, 80).unwrap();
    for degrees in [0.0f64, 20.0, 33.0, 45.0, 71.0] {
        let mut grid = FuzzyGrid::new(frame);
        let turn = Isometry2::<f64>::rotation(-degrees.to_radians());
        for row in 0..80 {
            for column in 0..80 {
                let point = turn * frame.center(row, column);
                let wall = (point.x.abs() - 2.5).abs() < 0.1 && point.y.abs() < 1.6
                    || (point.y.abs() - 1.5).abs() < 0.1 && point.x.abs() < 2.6;
                grid.get_mut(row, column).unwrap().occupied = if wall { 0.8 } else { 0.0 };
            }
        }
        let found = wall_direction_of_grid(&grid, &StructureOptions::default()).unwrap();
        assert!(off(found.direction, degrees).abs() < 1.0, "{degrees}: {found:?}");
    }
    assert_eq!(wall_direction_of_grid(&FuzzyGrid::new(frame), &StructureOptions::default()), None);
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

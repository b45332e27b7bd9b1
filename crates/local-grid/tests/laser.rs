//! Local maps and scan matching, in a small world of walls with known poses.

use std::sync::Arc;

use local_grid::nalgebra::{Isometry2, Point2, Vector2};
use local_grid::{
    Ambiguity, Echo, LocalMap, LocalMapError, LocalMapOptions, MatchOptions, Prior, RangeSensor, Reading, Scan,
    SearchWindow, TrackOptions, refine, search, track,
};
use proptest::prelude::*;

/// Walls from point to point.
type Walls = Vec<(Point2<f64>, Point2<f64>)>;

pub(crate) fn walls(corners: &[&[(f64, f64)]]) -> Walls {
    let point = |&(x, y): &(f64, f64)| Point2::new(x, y);
    corners.iter().flat_map(|line| line.windows(2).map(|pair| (point(&pair[0]), point(&pair[1])))).collect()
}

/// A room of 8 × 6 m with a niche, a partition and a pillar.
pub(crate) fn flat() -> Walls {
    walls(&[
        &[
            (-4.0, -3.0),
            (4.0, -3.0),
            (4.0, 3.0),
            (1.5, 3.0),
            (1.5, 4.2),
            (-0.3, 4.2),
            (-0.3, 3.0),
            (-4.0, 3.0),
            (-4.0, -3.0),
        ],
        &[(-1.6, -3.0), (-1.6, -0.4)],
        &[(2.0, 0.8), (2.3, 0.8), (2.3, 1.1), (2.0, 1.1), (2.0, 0.8)],
    ])
}

pub(crate) fn laser() -> Arc<RangeSensor> {
    let mount = Isometry2::translation(0.1, 0.0);
    Arc::new(RangeSensor::fan("laser", mount, -120f64.to_radians(), 2f64.to_radians(), 121, 0.05..=20.0).unwrap())
}

pub(crate) fn scan(walls: &Walls, world_from_robot: &Isometry2<f64>) -> Scan {
    let sensor = laser();
    let range = |mount: &Isometry2<f64>| {
        let beam = world_from_robot * mount;
        let (start, direction) = (beam.translation.vector, beam.rotation * Vector2::x());
        let hit = |&(a, b): &(Point2<f64>, Point2<f64>)| {
            let (along, to) = (b - a, a.coords - start);
            let cross = direction.perp(&along);
            let (range, share) = (to.perp(&along) / cross, to.perp(&direction) / cross);
            (range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
        };
        walls.iter().filter_map(hit).fold(f64::INFINITY, f64::min)
    };
    let ranges: Vec<f64> = sensor.mounts().iter().map(range).collect();
    Scan::from_ranges(sensor, ranges).unwrap()
}

pub(crate) fn echoes(scan: &Scan) -> Vec<Echo> {
    local_grid::echoes(scan, 20.0)
}

pub(crate) fn mapped(walls: &Walls, poses: &[Isometry2<f64>]) -> LocalMap {
    let mut map = LocalMap::new(LocalMapOptions::default()).unwrap();
    for pose in poses {
        map.insert(pose, &scan(walls, pose)).unwrap();
    }
    map
}

pub(crate) fn pose(x: f64, y: f64, degrees: f64) -> Isometry2<f64> {
    Isometry2::new(Vector2::new(x, y), degrees.to_radians())
}

#[test]
fn a_scan_slides_into_its_map() {
    let world = flat();
    let map = mapped(&world, &[pose(0.0, 0.0, 0.0), pose(0.3, 0.2, 90.0), pose(0.5, 0.0, 180.0)]);
    for truth in [pose(0.3, 0.1, 20.0), pose(-0.2, 0.5, -75.0), pose(1.0, -1.2, 140.0)] {
        let echoes = echoes(&scan(&world, &truth));
        for off in [pose(0.2, -0.1, 4.0), pose(-0.15, 0.2, -6.0), pose(0.0, 0.0, 8.0)] {
            let found = refine(&map, &echoes, &Prior::start(truth * off), &MatchOptions::default());
            let error = truth.inv_mul(&found.map_from_robot);
            assert!(error.translation.vector.norm() < 0.03, "{truth} from {off}: {found:?}");
            assert!(error.rotation.angle().abs() < 0.5f64.to_radians(), "{truth} from {off}: {found:?}");
            assert_eq!(found.ambiguity, Ambiguity::None);
            assert!(found.score > 0.9 && found.contradiction < 0.03, "{found:?}");
            assert!(found.covariance[(0, 0)].sqrt() < 0.05 && found.covariance[(2, 2)].sqrt() < 0.03, "{found:?}");
        }
    }
}

#[test]
fn a_corridor_is_never_trusted_along_its_axis() {
    for degrees in [0.0, 27.0] {
        let turn = pose(0.0, 0.0, degrees);
        let corner = |x: f64, y: f64| turn * Point2::new(x, y);
        let world = vec![(corner(-60.0, -1.0), corner(60.0, -1.0)), (corner(-60.0, 1.0), corner(60.0, 1.0))];
        let map = mapped(&world, &[turn, turn * pose(0.5, 0.0, 0.0)]);
        let truth = turn * pose(0.7, 0.1, 3.0);
        let found = refine(&map, &echoes(&scan(&world, &truth)), &Prior::start(truth), &MatchOptions::default());
        let Ambiguity::Along(axis) = found.ambiguity else { panic!("{degrees} degrees: {found:?}") };
        let along = turn * Vector2::x();
        assert!(axis.unit_vector().dot(&along).abs() > 0.99, "{axis:?}");
        let position = found.covariance.fixed_view::<2, 2>(0, 0);
        let reach = map.options().max_distance;
        approx::assert_relative_eq!(
            (along.transpose() * position * along)[0],
            reach * reach / 3.0,
            max_relative = 0.05
        );
        let across = Vector2::new(-along.y, along.x);
        assert!((across.transpose() * position * across)[0].sqrt() < 0.05);
    }
}

#[test]
fn odometry_decides_where_walls_do_not() {
    let world = walls(&[&[(-60.0, -1.0), (60.0, -1.0)], &[(-60.0, 1.0), (60.0, 1.0)]]);
    let map = mapped(&world, &[pose(0.0, 0.0, 0.0), pose(0.5, 0.0, 0.0)]);
    let guess = pose(0.8, 0.2, 2.0);
    let information = local_grid::nalgebra::Matrix3::from_diagonal(&[400.0, 400.0, 400.0].into());
    let prior = Prior { map_from_robot: guess, information };
    let truth = pose(0.8, 0.05, 0.0);
    let found = refine(&map, &echoes(&scan(&world, &truth)), &prior, &MatchOptions::default());
    approx::assert_relative_eq!(found.map_from_robot.translation.x, 0.8, epsilon = 0.03);
    approx::assert_relative_eq!(found.map_from_robot.translation.y, 0.05, epsilon = 0.03);
}

#[test]
fn a_lost_scan_is_found_in_a_wide_window() {
    let world = flat();
    let map =
        mapped(&world, &[pose(0.0, 0.0, 0.0), pose(0.5, 0.2, 120.0), pose(0.5, 0.2, -120.0), pose(1.0, 2.0, 90.0)]);
    let truth = pose(0.4, -0.6, 35.0);
    let seen = echoes(&scan(&world, &truth));
    for (off, turn) in
        [(pose(1.2, -0.8, 25.0), 30.0f64), (pose(-1.5, 1.0, 170.0), 180.0), (pose(0.4, 0.1, -100.0), 180.0)]
    {
        let window = SearchWindow { reach: 2.5, turn: turn.to_radians(), ..SearchWindow::default() };
        let found = search(&map, &seen, &(truth * off), &window, &MatchOptions::default());
        let error = truth.inv_mul(&found[0].map_from_robot);
        assert!(error.translation.vector.norm() < 0.03 && error.rotation.angle().abs() < 0.01, "{found:?}");
        assert!(found[0].score > 0.9, "{found:?}");
        assert!(found.iter().skip(1).all(|other| other.score < 0.85 * found[0].score), "{found:?}");
    }
    let blank = LocalMap::new(LocalMapOptions::default()).unwrap();
    assert!(search(&blank, &seen, &truth, &SearchWindow::default(), &MatchOptions::default()).is_empty());
    assert!(search(&map, &[], &truth, &SearchWindow::default(), &MatchOptions::default()).is_empty());
}

#[test]
fn tracking_survives_a_turn_that_odometry_missed() {
    let world = flat();
    let map = mapped(&world, &[pose(0.0, 0.0, 0.0), pose(0.5, 0.2, 120.0), pose(0.5, 0.2, -120.0)]);
    let truth = pose(0.3, -0.2, 40.0);
    let prior = Prior::start(pose(0.1, 0.1, 58.0));
    let found = track(&map, &echoes(&scan(&world, &truth)), &prior, &TrackOptions::default());
    let error = truth.inv_mul(&found.map_from_robot);
    assert!(error.translation.vector.norm() < 0.03 && error.rotation.angle().abs() < 0.01, "{found:?}");
}

#[test]
fn a_robot_that_backs_out_of_what_it_has_seen_is_not_held_there() {
    // A corridor with niches on both sides, at odd distances, closed ahead.
    let niches = |y: f64, starts: [f64; 7]| {
        let edge = |x: f64| [(x, y), (x, 1.3 * y), (x + 0.4, 1.3 * y), (x + 0.4, y)];
        let mut line = vec![(-12.0, y)];
        line.extend(starts.iter().flat_map(|&x| edge(x)));
        line.push((4.0, y));
        line
    };
    let (left, right) = (
        niches(1.0, [-9.1, -7.0, -5.2, -3.7, -1.6, 0.3, 2.6]),
        niches(-1.0, [-10.3, -8.2, -6.1, -4.7, -2.2, -0.8, 1.9]),
    );
    let world = walls(&[&left, &right, &[(4.0, -1.0), (4.0, 1.0)]]);
    let information = local_grid::nalgebra::Matrix3::from_diagonal(&[50.0, 50.0, 150.0].into());
    let mut map = mapped(&world, &[pose(1.0, 0.0, 0.0)]);
    for step in 1..8 {
        let truth = pose(1.0 - 1.2 * f64::from(step), 0.0, 0.0);
        let prior = Prior { map_from_robot: truth * pose(0.06, 0.03, 1.5), information };
        let scan = scan(&world, &truth);
        let found = track(&map, &echoes(&scan), &prior, &TrackOptions::default());
        let error = truth.inv_mul(&found.map_from_robot);
        assert!(error.translation.vector.norm() < 0.1, "step {step}: {found:?}");
        assert!(found.overlap < 0.7, "much is new: {found:?}");
        map.insert(&truth, &scan).unwrap();
    }
}

#[test]
fn moved_furniture_leaves_the_field() {
    let world = flat();
    let mut with_box = world.clone();
    with_box.extend(walls(&[&[(0.8, -0.3), (0.8, 0.3)]]));
    let mut map = mapped(&with_box, &[pose(0.0, 0.0, 0.0)]);
    assert!(map.distance(Point2::new(0.82, 0.0)).0 < 0.08);
    for _ in 0..8 {
        map.insert(&pose(0.0, 0.0, 0.0), &scan(&world, &pose(0.0, 0.0, 0.0))).unwrap();
    }
    assert_eq!(map.distance(Point2::new(0.82, 0.0)).0, map.options().max_distance);
    assert!(map.is_known(Point2::new(0.82, 0.0)));
}

#[test]
fn echoes_alone_are_walls_before_which_nothing_is_known() {
    let (world, at) = (flat(), pose(0.5, -0.7, 17.0));
    let (whole, mut alone) = (mapped(&world, &[at]), LocalMap::new(LocalMapOptions::default()).unwrap());
    alone.insert_echoes(&at, &scan(&world, &at)).unwrap();
    let beside = Point2::new(0.8, -0.7);
    assert!(whole.is_known(beside) && !alone.is_known(beside));
    for wall in whole.walls() {
        assert!(alone.distance(wall).0 < 0.01);
    }
    let near = pose(0.1, -0.1, 3.0);
    let found = refine(&alone, &echoes(&scan(&world, &at)), &Prior::start(at * near), &MatchOptions::default());
    let error = at.inv_mul(&found.map_from_robot);
    assert!(error.translation.vector.norm() < 0.03 && error.rotation.angle().abs() < 0.01, "{found:?}");
    let nowhere = Isometry2::translation(f64::NAN, 0.0);
    assert!(matches!(alone.insert_echoes(&nowhere, &scan(&world, &at)), Err(LocalMapError::TooFar { .. })));
}

#[test]
fn the_map_as_grid_tells_walls_from_space() {
    let map = mapped(&flat(), &[pose(0.0, 0.0, 0.0)]);
    let grid = map.to_grid().unwrap();
    assert!(grid.at(Point2::new(4.01, 0.5)).unwrap().occupied > 0.5);
    assert!(grid.at(Point2::new(1.0, 0.5)).unwrap().empty > 0.9);
    assert!(LocalMap::new(LocalMapOptions::default()).unwrap().to_grid().unwrap().cells().is_empty());
}

#[test]
fn impossible_poses_and_options_are_refused() {
    let mut map = mapped(&flat(), &[pose(0.0, 0.0, 0.0)]);
    let scan = scan(&flat(), &pose(0.0, 0.0, 0.0));
    let nowhere = Isometry2::new(Vector2::new(f64::NAN, 0.0), 0.0);
    assert!(matches!(map.insert(&nowhere, &scan), Err(LocalMapError::TooFar { .. })));
    assert!(matches!(map.insert(&pose(1e8, 1e8, 0.0), &scan), Err(LocalMapError::TooFar { .. })));
    let options = LocalMapOptions { resolution: 0.0, ..LocalMapOptions::default() };
    let error = LocalMap::new(options).unwrap_err();
    assert_eq!(error.to_string(), "local map: `resolution` must be in [0.001, 10] metres, got 0");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    /// Echoes and passing rays in any order: the field is that of a full search over all walls.
    #[test]
    fn distances_are_those_of_a_full_search(shots in prop::collection::vec((0.0f64..6.0, 0.3f64..3.0), 1..120)) {
        let sensor = Arc::new(
            RangeSensor::fan("laser", Isometry2::identity(), 0.0, 0.1, 1, 0.05..=20.0).unwrap(),
        );
        let options = LocalMapOptions { resolution: 0.1, max_distance: 0.45, ..LocalMapOptions::default() };
        let mut map = LocalMap::new(options).unwrap();
        for (turn, range) in shots {
            #[expect(clippy::cast_possible_truncation, reason = "a range")]
            let scan = Scan::new(sensor.clone(), vec![Reading::Echo(range as f32)]).unwrap();
            map.insert(&Isometry2::rotation(turn), &scan).unwrap();
        }
        let walls: Vec<_> = map.walls().collect();
        for row in -35..35 {
            for column in -35..35 {
                let centre = Point2::new(f64::from(column) * 0.1 + 0.05, f64::from(row) * 0.1 + 0.05);
                let nearest = walls.iter().map(|wall| (wall - centre).norm()).fold(f64::INFINITY, f64::min);
                let expected = if nearest < 0.4499 { nearest } else { 0.45 };
                prop_assert!((map.distance(centre).0 - expected).abs() < 1e-5, "{centre}");
            }
        }
    }
}

//! A robot that sees nothing: odometry, and a recogniser of its own that is mostly wrong.

use hierarchy::evaluate::{AbsoluteError, Alignment, Pairing, TimedPath, absolute_error};
use hierarchy::{Config, HeadingMode, Mapper, Verdict};
use nalgebra::{Isometry2, Vector2};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use robot_log::{Entry, EntryKind};

use crate::logs::{entries, map, shared};

/// The errors of the map's path and of the raw odometry against the truth of the log.
fn judged(mapper: &Mapper, log: &[Entry]) -> (AbsoluteError, AbsoluteError) {
    let truth = TimedPath::new(log.iter().filter_map(|entry| match entry.kind {
        EntryKind::Truth { map_from_robot } => Some((entry.stamp, map_from_robot)),
        _ => None,
    }));
    let samples = mapper.trajectory().samples();
    let stamps = || samples.iter().map(|sample| sample.stamp);
    let path = TimedPath::new(stamps().zip(mapper.poses()));
    let odometry = TimedPath::new(stamps().zip(samples.iter().map(|sample| sample.odom_from_robot)));
    let error = |path: &TimedPath| {
        let pairing = Pairing::Interpolated { gap: 2.0 };
        absolute_error(path, &truth, Alignment::Rigid, pairing).unwrap()
    };
    (error(&path), error(&odometry))
}

/// The route through `corners`, driven at 1 m/s by a robot that veers by 0.25° per metre, with a recogniser that looks
/// once a metre: it knows a quarter of the places again, and for each proposes three wrong ones.
fn drive(corners: &[[f64; 2]], seed: u64) -> Vec<Entry> {
    let mut random = Pcg64Mcg::new(u128::from(seed));
    let (mut log, mut views): (Vec<Entry>, Vec<(f64, Vector2<f64>)>) = (Vec::new(), Vec::new());
    let (mut odom_from_robot, mut map_from_robot) = (Isometry2::identity(), Isometry2::identity());
    for (k, step) in steps(corners).into_iter().enumerate() {
        let stamp = 0.2 * (k + 1) as f64;
        let (length, turn) = (step.translation.x, step.rotation.angle());
        let noise: f64 = random.random_range(-0.01..0.01);
        let veer = length * 0.25f64.to_radians() + 0.3 * noise;
        odom_from_robot *= Isometry2::new(Vector2::new(length * (1.0 + noise), 0.0), turn + veer);
        map_from_robot *= step;
        log.push(Entry { stamp, kind: EntryKind::Odometry { odom_from_robot } });
        log.push(Entry { stamp, kind: EntryKind::Truth { map_from_robot } });
        if k % 5 == 0 {
            let spot = map_from_robot.translation.vector;
            log.extend(proposals(&mut random, &views, stamp, spot));
            views.push((stamp, spot));
        }
    }
    log
}

/// Steps of 0.2 m, and of a tenth of the turn at each corner.
fn steps(corners: &[[f64; 2]]) -> Vec<Isometry2<f64>> {
    let (mut steps, mut heading) = (Vec::new(), 0.0f64);
    for leg in corners.windows(2) {
        let way = Vector2::from(leg[1]) - Vector2::from(leg[0]);
        let turn = relaxation::wrap(way.y.atan2(way.x) - heading);
        heading += turn;
        steps.extend((0..10).map(|_| Isometry2::new(Vector2::zeros(), turn / 10.0)));
        let mut left = way.norm();
        while left > 0.1 {
            steps.push(Isometry2::translation(0.2, 0.0));
            left -= 0.2;
        }
    }
    steps
}

fn proposals(random: &mut Pcg64Mcg, views: &[(f64, Vector2<f64>)], stamp: f64, spot: Vector2<f64>) -> Vec<Entry> {
    let mut found = Vec::new();
    let mut propose = |earlier, similarity| {
        found.push(Entry { stamp, kind: EntryKind::Recognition { earlier, similarity } });
    };
    for (earlier, _) in views.iter().filter(|(earlier, there)| stamp - earlier > 20.0 && (spot - there).norm() < 0.7) {
        if random.random_range(0.0..1.0) < 0.25 {
            propose(*earlier, random.random_range(0.2..1.0));
            for _ in 0..3 {
                propose(views[random.random_range(0..views.len())].0, random.random_range(0.0..0.8));
            }
        }
    }
    found
}

/// A corridor of 60 m, to and fro.
fn corridor(legs: usize) -> Vec<[f64; 2]> {
    (0..=legs).map(|leg| [if leg % 2 == 0 { 0.0 } else { 60.0 }, 0.0]).collect()
}

/// Two rounds of a rectangle and one of its halves.
fn rounds() -> Vec<[f64; 2]> {
    let round = [[0.0, 0.0], [40.0, 0.0], [40.0, 20.0], [0.0, 20.0]];
    let half = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0], [0.0, 0.0]];
    round.into_iter().chain(round).chain(half).collect()
}

/// Sides at odd angles, so that the building holds no heading: two rounds.
fn triangle() -> Vec<[f64; 2]> {
    let round = [[0.0, 0.0], [30.0, 0.0], [11.0, 23.0]];
    round.into_iter().chain(round).chain([[0.0, 0.0], [30.0, 0.0]]).collect()
}

/// Where the robot truly was when it was at a place.
fn true_spot(mapper: &Mapper, log: &[Entry], place: topo_map::PlaceId) -> Vector2<f64> {
    let anchor = mapper.trajectory().anchors().iter().find(|anchor| anchor.place == place).unwrap();
    let before = log.iter().filter(|entry| entry.stamp <= anchor.stamp).rev();
    let mut truths = before.filter_map(|entry| match entry.kind {
        EntryKind::Truth { map_from_robot } => Some(map_from_robot.translation.vector),
        _ => None,
    });
    truths.next().unwrap()
}

#[test]
fn proposals_that_agree_make_a_map_and_the_others_are_refused() {
    let worlds = [(corridor(5), 1, "structure"), (rounds(), 2, "structure"), (triangle(), 3, "odometry")];
    for (route, seed, source) in worlds {
        let log = drive(&route, seed);
        let mapper = map(&log, Config::default());
        let (error, odometry) = judged(&mapper, &log);
        println!("{source}: {:.3} m, by odometry {:.3} m", error.translation_m.mean, odometry.translation_m.mean);
        assert!(odometry.translation_m.mean > 4.0 * error.translation_m.mean, "{odometry:?}\n{error:?}");
        assert!(error.translation_m.mean < 0.6, "{error:?}");
        assert_eq!(mapper.heading_source(), source);
        let refused = |closure: &&hierarchy::Closure| matches!(closure.verdict, Verdict::Contradicted { .. });
        assert!(2 * mapper.closures().iter().filter(refused).count() > mapper.closures().len(), "most are wrong");
        for closure in mapper.closures().iter().filter(|closure| !refused(closure)) {
            let apart = true_spot(&mapper, &log, closure.place) - true_spot(&mapper, &log, closure.known);
            assert!(apart.norm() < 3.0, "a false closure: {closure:?}");
        }
    }
}

#[test]
fn a_blind_robots_session_is_restored_as_it_was() {
    let mapper = map(&drive(&corridor(3), 5), Config::default());
    let mut bytes = Vec::new();
    mapper.save(&mut bytes).unwrap();
    let back = Mapper::load(&mut bytes.as_slice()).unwrap();
    assert_eq!(back.closures(), mapper.closures());
    assert_eq!(back.heading_source(), "structure");
    let (before, after) = (mapper.metrics().unwrap().relaxation, back.metrics().unwrap().relaxation);
    approx::assert_relative_eq!(before.energy_after, after.energy_after, max_relative = 1e-6);
    assert!(before.relative_gap.abs() < 1e-6, "{before:?}");
    assert!(mapper.gridmap().unwrap().cells().iter().any(|cell| cell.empty > 0.5), "its body was where it drove");
}

#[test]
fn the_building_holds_no_heading_where_odometry_alone_is_asked_for() {
    let mut config = Config::default();
    config.heading.source = HeadingMode::Odometry;
    let mapper = map(&drive(&corridor(3), 5), config);
    assert_eq!(mapper.heading_source(), "odometry");
}

#[test]
fn a_corridor_is_mapped_from_odometry_and_scored_recognitions() {
    let Some(folder) = shared("posegraph/tuc_places") else { return };
    let log = entries(&[folder.join("Corridor_Input.txt.gz"), folder.join("Corridor_GT.txt.gz")], None);
    let mapper = map(&log, Config::default());
    let (error, odometry) = judged(&mapper, &log);
    println!("{:.3} m, by odometry {:.3} m", error.translation_m.mean, odometry.translation_m.mean);
    assert_eq!(error.pairs, 11_346);
    assert!(odometry.translation_m.mean > 40.0);
    assert!(error.translation_m.mean < 1.0, "{error:?}");
}

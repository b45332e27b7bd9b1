//! Agreement with the programs that others use: evo 1.38 for trajectories, the published form of the relations' score.

use std::fs::File;
use std::io::BufReader;

use approx::assert_relative_eq;
use hierarchy::evaluate::{
    Alignment, Delta, Pairing, RelationsOptions, TimedPath, absolute_error, read_relations, relations_error,
    relative_error,
};
use hierarchy::{Config, HeadingConfig, HeadingMode};
use nalgebra::{Isometry2, Vector2};
use robot_log::{CarmenOptions, CarmenReader, EntryKind};

use crate::logs::{map, office_loop, shared};

/// An ellipse, and a distorted, turned and moved version of every other pose of it, 4 ms late.
fn paths() -> (TimedPath, TimedPath) {
    let moved = Isometry2::new(Vector2::new(5.0, -2.0), 0.3);
    let (mut reference, mut estimate) = (Vec::new(), Vec::new());
    for k in 0..200 {
        let (stamp, a) = (0.5 * f64::from(k), 0.1 * f64::from(k));
        let (x, y) = (10.0 * a.cos(), 6.0 * a.sin());
        reference.push((stamp, Isometry2::new(Vector2::new(x, y), a)));
        if k % 2 == 0 {
            let at = Vector2::new(1.02 * x + 0.3 * (3.0 * a).sin(), y + 0.2 * (5.0 * a).cos());
            estimate.push((stamp + 0.004, moved * Isometry2::new(at, a + 0.05 * (2.0 * a).sin())));
        }
    }
    (TimedPath::new(estimate), TimedPath::new(reference))
}

#[test]
fn absolute_errors_are_those_that_evo_prints() {
    let (estimate, reference) = paths();
    let error = |alignment| absolute_error(&estimate, &reference, alignment, Pairing::default()).unwrap();
    let rigid = error(Alignment::Rigid);
    let figures = rigid.translation_m;
    for (ours, theirs) in [
        (figures.max, 0.516608),
        (figures.mean, 0.269427),
        (figures.median, 0.269518),
        (figures.min, 0.030673),
        (figures.rmse, 0.296994),
        (figures.sse, 8.820528),
        (figures.std, 0.124958),
        (rigid.rotation_deg.mean, 1.829970),
        (rigid.rotation_deg.rmse, 2.034551),
        (rigid.fitted_scale, 0.983391),
        (error(Alignment::Origin).translation_m.rmse, 0.401367),
        (error(Alignment::None).translation_m.sse, 3427.095298),
    ] {
        assert_relative_eq!(ours, theirs, epsilon = 1.1e-6);
    }
}

#[test]
fn relative_errors_are_those_that_evo_prints() {
    let (estimate, reference) = paths();
    let five = relative_error(&estimate, &reference, Delta::Poses(5), Pairing::default()).unwrap().translation_m;
    assert_relative_eq!(five.max, 0.867975, epsilon = 1.1e-6);
    assert_relative_eq!(five.mean, 0.427176, epsilon = 1.1e-6);
    let one = relative_error(&estimate, &reference, Delta::Poses(1), Pairing::default()).unwrap().translation_m;
    assert_relative_eq!(one.rmse, 0.190444, epsilon = 1.1e-6);
}

#[test]
fn the_raw_odometry_of_intel_misses_its_relations_by_what_is_known() {
    let Some(folder) = shared("laser/intel") else { return };
    let open = |name: &str| BufReader::new(File::open(folder.join(name)).unwrap());
    let relations = read_relations(open("intel.relations")).unwrap();
    let log = CarmenReader::new("intel", open("intel_raw.clf.gz"), CarmenOptions::default()).unwrap();
    let poses = log.map(Result::unwrap).filter_map(|entry| match entry.kind {
        EntryKind::Scan { odom_from_robot: Some(pose), .. } => Some((entry.stamp, pose)),
        _ => None,
    });
    let odometry = TimedPath::new(poses);
    let options = RelationsOptions::default();
    let raw = relations_error(&odometry, &relations, None, &options);
    let (all, near, far) = (raw.all.unwrap(), raw.near.unwrap(), raw.far.unwrap());
    assert_eq!((all.relations, near.relations, far.relations), (2984, 1772, 1212));
    assert_relative_eq!(all.translation_mean_m, 7.4124, epsilon = 6e-5);
    assert_relative_eq!(all.translation_std_m, 14.3288, epsilon = 6e-5);
    assert_relative_eq!(all.translation_median_m, 0.1887, epsilon = 6e-5);
    assert_relative_eq!(all.rotation_mean_deg, 40.101, epsilon = 6e-4);
    assert_relative_eq!(far.translation_mean_m, 18.1087, epsilon = 6e-5);
    assert_relative_eq!(far.rotation_mean_deg, 94.070, epsilon = 6e-4);
    // Every seventh pose, distorted: alone, and with the odometry between the poses.
    let distorted = |(stamp, pose): (f64, &Isometry2<f64>)| {
        let at = Vector2::new(0.98 * pose.translation.x, 1.01 * pose.translation.y);
        (stamp, Isometry2::new(at, 0.999 * pose.rotation.angle()))
    };
    let sparse = TimedPath::new(odometry.iter().step_by(7).map(distorted));
    let with = relations_error(&sparse, &relations, Some(&odometry), &options).all.unwrap();
    assert_relative_eq!(with.translation_mean_m, 7.3403, epsilon = 6e-5);
    let without = relations_error(&sparse, &relations, None, &options).all.unwrap();
    assert_relative_eq!(without.translation_mean_m, 7.3518, epsilon = 6e-5);
}

#[test]
fn a_graph_for_other_programs_has_the_energy_of_the_map() {
    // Links measured across turns, surer one way than the other: their covariance is to be turned with them.
    let config = Config {
        heading: HeadingConfig { source: HeadingMode::Odometry, ..HeadingConfig::default() },
        ..Config::default()
    };
    let mapper = map(&office_loop(), config);
    let problem = mapper.graph().pose_problem().unwrap();
    let ours = mapper.metrics().unwrap().relaxation.energy_after;
    assert!(ours > 1.0, "{ours}");
    assert_relative_eq!(problem.graph.chi2(&problem.start), ours, max_relative = 1e-3);
}

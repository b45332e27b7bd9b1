//! Places of different visits that the finished map has beside each other: how they lie is measured once more.

use hierarchy::evaluate::{RelationsOptions, TimedPath, read_relations, relations_error};
use hierarchy::{Config, Verdict};
use simulator::{Robot, RobotDescription, TourOptions, World};

use crate::logs::{entries, map, shared, truth};

#[test]
fn places_beside_each_other_are_measured_where_they_are() {
    let world = World::from_plan(include_str!("../../../fixtures/worlds/office-loop.toml")).unwrap();
    let mut robot = Robot::new(&world, RobotDescription::named("laser").unwrap(), 11).unwrap();
    let options = TourOptions { stop_every: 0.4, firings: 1, ..TourOptions::default() };
    let mut log = Vec::new();
    for _ in 0..2 {
        robot.drive_tour(&world.tours()[0].points, &options, |_, entries| log.extend(entries)).unwrap();
    }
    let mapper = map(&log, Config::default());
    let truth = truth(&log);
    let at = |place| {
        let anchor = mapper.trajectory().anchors().iter().find(|anchor| anchor.place == place).unwrap();
        truth.at(anchor.stamp).unwrap()
    };
    let beside = mapper.closures().iter().filter(|closure| matches!(closure.verdict, Verdict::Beside { .. }));
    let mut off: Vec<f64> = Vec::new();
    for closure in beside {
        assert!(closure.is_accepted() && closure.known.0 + 8 < closure.place.0);
        let linked = mapper.topology().links_between(closure.place, closure.known);
        assert_eq!(linked.count(), 1, "{} and {}", closure.place, closure.known);
        // Along a corridor nothing is measured, and the claim says so.
        let apart = (at(closure.known) - at(closure.place)).norm();
        let spread = closure.displacement.covariance.symmetric_eigenvalues().max().sqrt();
        off.push((apart - closure.displacement.vector.norm()).abs() / spread);
    }
    assert!(off.len() >= 5, "{}", off.len());
    assert!(off.iter().all(|off| *off < 4.0), "so many deviations off: {off:.1?}");
}

#[test]
fn intel_is_met_as_well_as_its_clock_allows() {
    let Some(folder) = shared("laser/intel") else { return };
    let mapper = map(&entries(&[folder.join("intel_raw.clf.gz")], None), Config::default());
    let samples = mapper.trajectory().samples();
    let path = TimedPath::new(samples.iter().map(|sample| sample.stamp).zip(mapper.poses()));
    let file = std::fs::File::open(folder.join("intel.relations")).unwrap();
    let relations = read_relations(std::io::BufReader::new(file)).unwrap();
    let error = relations_error(&path, &relations, None, &RelationsOptions::default());
    let (all, far) = (error.all.unwrap(), error.far.unwrap());
    println!(
        "{:.4} m, over 15 s {:.4} m, {:.3}°",
        all.translation_mean_m, far.translation_mean_m, all.rotation_mean_deg
    );
    assert_eq!(all.relations, 2984);
    assert!(all.translation_mean_m <= 0.095 && far.translation_mean_m <= 0.102, "{all:?} {far:?}");
    assert!(all.rotation_mean_deg <= 2.45, "{all:?}");
}

//! A robot that sees nothing: odometry, and a recogniser of its own that is mostly wrong.

use hierarchy::{Config, HeadingMode, Mapper, Verdict};
use nalgebra::Vector2;
use robot_log::{Entry, EntryKind};

use crate::blind_robot::{Recogniser, corridor, drive, judged, rounds, triangle};
use crate::logs::{entries, map, shared};

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
        let log = drive(&route, &Recogniser::default(), seed);
        let mapper = map(&log, Config::default());
        let (error, odometry) = judged(&mapper, &log).unwrap();
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
    let mapper = map(&drive(&corridor(3), &Recogniser::default(), 5), Config::default());
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
    let mapper = map(&drive(&corridor(3), &Recogniser::default(), 5), config);
    assert_eq!(mapper.heading_source(), "odometry");
}

#[test]
fn a_corridor_is_mapped_from_odometry_and_scored_recognitions() {
    let Some(folder) = shared("posegraph/tuc_places") else { return };
    let log = entries(&[folder.join("Corridor_Input.txt.gz"), folder.join("Corridor_GT.txt.gz")], None);
    let mapper = map(&log, Config::default());
    let (error, odometry) = judged(&mapper, &log).unwrap();
    println!("{:.3} m, by odometry {:.3} m", error.translation_m.mean, odometry.translation_m.mean);
    assert_eq!(error.pairs, 11_346);
    assert!(odometry.translation_m.mean > 40.0);
    assert!(error.translation_m.mean < 1.0, "{error:?}");
}

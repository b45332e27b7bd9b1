//! The shipped logs are what their recipe makes, and hold what they are for.

use simulator::nalgebra::{Isometry2, UnitComplex};
use simulator::robot_log::{CarmenOptions, CarmenReader, EntryKind};

use crate::recipe::{RECIPES, fixtures};

#[test]
fn the_recipe_makes_the_shipped_logs_byte_for_byte() {
    for recipe in RECIPES {
        let shipped = std::fs::read(fixtures().join(recipe.log)).unwrap();
        assert!(
            recipe.cook().unwrap() == shipped,
            "{}: cargo run --release -p simulator --example make_fixtures",
            recipe.log
        );
        assert!(shipped.len() < 1 << 20, "{} is too large to ship", recipe.log);
    }
}

#[test]
fn the_odometry_of_the_office_loop_drifts_by_metres() {
    let file = std::fs::File::open(fixtures().join("logs/office_loop.log")).unwrap();
    let reader = CarmenReader::new("office_loop", std::io::BufReader::new(file), CarmenOptions::default()).unwrap();
    let (mut odometry, mut heading, mut scans, mut path) = (Isometry2::identity(), None, 0, 0.0);
    // Dead reckoning with the compass: each step of the odometry, turned to where the compass points.
    let mut last: Option<(Isometry2<f64>, Isometry2<f64>)> = None;
    let mut error = simulator::nalgebra::Vector2::zeros();
    let mut worst = 0.0f64;
    for entry in reader {
        match entry.unwrap().kind {
            EntryKind::Odometry { odom_from_robot } => odometry = odom_from_robot,
            EntryKind::Heading { heading: read, .. } => heading = Some(UnitComplex::new(read.radians())),
            EntryKind::Scan { .. } => scans += 1,
            EntryKind::Truth { map_from_robot } => {
                if let (Some((odometry_before, truth_before)), Some(heading)) = (last, heading) {
                    let step = odometry.translation.vector - odometry_before.translation.vector;
                    let truth = map_from_robot.translation.vector - truth_before.translation.vector;
                    error += heading * (odometry.rotation.inverse() * step) - truth;
                    path += truth.norm();
                    worst = worst.max(error.norm());
                }
                last = Some((odometry, map_from_robot));
            }
            _ => {}
        }
    }
    assert!((300..600).contains(&scans), "{scans} scans");
    assert!(path > 150.0, "{path} m");
    assert!((3.0..12.0).contains(&worst), "dead reckoning is {worst} m off at worst");
}

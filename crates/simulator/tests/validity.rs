//! Is the simulated sonar as bad as a real one? A sonar that draws clean outlines is too easy.

use simulator::local_grid::Reading;
use simulator::nalgebra::{Isometry2, Point2, Vector2};
use simulator::robot_log::{Entry, EntryKind};
use simulator::{Command, Robot, RobotDescription, SonarModel, SonarRing, Turret, World};

/// A robot whose single sonar looks ahead and makes no random errors.
fn one_quiet_sonar() -> RobotDescription {
    let model =
        SonarModel { range_deviation: 0.0, dropout: 0.0, cross_talk: 0.0, quantum: 0.0, ..SonarModel::default() };
    let sonar = SonarRing { count: 1, model, ..SonarRing::default() };
    RobotDescription { sonar: Some(sonar), turret: Turret::Ahead, compass: None, ..RobotDescription::nomad200() }
}

fn readings(entries: &[Entry]) -> Vec<Reading> {
    let scans = entries.iter().filter_map(|entry| match &entry.kind {
        EntryKind::Scan { scan, .. } => Some(scan.readings().to_vec()),
        _ => None,
    });
    scans.flatten().collect()
}

/// What a sonar 1 m in front of a long smooth wall reads at each degree of incidence.
fn sweep() -> Vec<Reading> {
    let world = World::from_plan("name = 'wall'\n[[wall]]\npoints = [[0, -50], [0, 50]]\n").unwrap();
    let fire = |degrees: i32| {
        let turn = f64::from(degrees).to_radians();
        // The sonar's face, not the robot's centre, keeps its distance.
        let face = Point2::new(-1.0, 0.0);
        let center = face - Isometry2::rotation(turn) * Vector2::new(0.225, 0.0);
        let mut robot = Robot::starting_at(&world, one_quiet_sonar(), 1, Isometry2::new(center.coords, turn)).unwrap();
        let mut log = Vec::new();
        robot.execute(&Command::Fire, &mut log);
        readings(&log)[0]
    };
    (0..=60).map(fire).collect()
}

#[test]
fn a_smooth_wall_is_seen_squarely_and_lost_at_a_slant() {
    let sweep = sweep();
    for (degrees, reading) in sweep[..=12].iter().enumerate() {
        let Reading::Echo(range) = reading else { panic!("{degrees}°: {reading:?}") };
        assert!((range - 1.0).abs() < 0.02, "{degrees}°: {range} m"); // the perpendicular, not the axis distance
    }
    for (degrees, reading) in sweep.iter().enumerate().skip(20) {
        assert_eq!(*reading, Reading::NoEcho, "{degrees}°");
    }
}

/// How the readings of rings in an office compare with the nearest surface in each cone.
#[derive(Debug, Default)]
struct Shares {
    right: f64,
    long: f64,
    short: f64,
    missing: f64,
}

/// Fires from every metre along a corridor of the given width, in three headings of the turret.
fn corridor(width: f64) -> Shares {
    let half = width / 2.0;
    // 30 m long, with a door every 3 m and a cupboard.
    let mut plan = format!(
        "name = 'corridor'\n[[wall]]\npoints = [[0, -{half}], [30, -{half}], [30, {half}], [0, {half}]]\nclosed = true\n"
    );
    for door in 0..9 {
        let (x, side) = (2.0 + 3.0 * f64::from(door), if door % 2 == 0 { half } else { -half });
        plan += &format!("[[door]]\nfrom = [{x}, {side}]\nto = [{}, {side}]\nopen = false\n", x + 0.9);
    }
    let world = World::from_plan(&plan).unwrap();
    let mut shares = Shares::default();
    let mut count = 0.0;
    for stop in 0..84u32 {
        let start = Isometry2::translation(1.0 + f64::from(stop) / 3.0, 0.1);
        let mut robot = Robot::starting_at(&world, RobotDescription::nomad200(), 7 + u64::from(stop), start).unwrap();
        let mut log = Vec::new();
        let to = simulator::local_grid::Heading::from_radians(f64::from(stop % 3) * 0.13);
        robot.execute(&Command::Look { to }, &mut log);
        robot.execute(&Command::Fire, &mut log);
        let scene = world.at(0.0);
        for (reading, mount) in readings(&log).iter().zip(robot.sensors()[0].mounts()) {
            let map_from_sensor = robot.map_from_robot() * mount;
            let face = Point2::from(map_from_sensor.translation.vector);
            let ray = |k: i32| {
                let toward = map_from_sensor.rotation * (Isometry2::rotation(f64::from(k) * 0.0218) * Vector2::x());
                scene.distance_along(face, toward, 100.0).unwrap()
            };
            let nearest = (-10..=10).map(ray).fold(f64::INFINITY, f64::min).max(0.43);
            count += 1.0;
            match reading {
                Reading::Echo(range) if (f64::from(*range) - nearest).abs() <= 0.1 => shares.right += 1.0,
                Reading::Echo(range) if f64::from(*range) > nearest => shares.long += 1.0,
                Reading::Echo(_) => shares.short += 1.0,
                _ if nearest > 6.4 => shares.right += 1.0,
                _ => shares.missing += 1.0,
            }
        }
    }
    for share in [&mut shares.right, &mut shares.long, &mut shares.short, &mut shares.missing] {
        *share /= count;
    }
    shares
}

#[test]
fn in_a_narrow_corridor_half_the_readings_are_too_long_or_missing() {
    let shares = corridor(1.5);
    println!("{shares:?}");
    assert!(shares.long + shares.missing > 0.45, "{shares:?}");
    assert!(shares.right > 0.2, "{shares:?}");
    assert!(shares.long > 0.05, "too long readings are what makes a sonar hard: {shares:?}");
    assert!(shares.short < 0.05, "{shares:?}");
}

//! One world, one robot, one seed: one log.

use simulator::nalgebra::Point2;
use simulator::robot_log::{CarmenOptions, CarmenReader, CarmenWriter, Entry};
use simulator::{Robot, RobotDescription, TourOptions, World};

const ROOM: &str = "
    name = 'two rooms'
    rotation_deg = 33
    start = [1, 1, 0]
    [[wall]]
    points = [[0, 0], [8, 0], [8, 4], [0, 4]]
    closed = true
    [[wall]]
    points = [[4, 0], [4, 4]]
    material = 'rough'
    [[door]]
    from = [4, 1.5]
    to = [4, 2.5]
    [[mover]]
    name = 'somebody'
    size = [0.4, 0.4]
    stations = [[0, 6, 3], [30, 7, 1]]
    repeats = true
    [[tour]]
    name = 'there'
    points = [[3, 2], [6, 2]]
";

fn drive(robot: &str, seed: u64) -> Vec<Entry> {
    let world = World::from_plan(ROOM).unwrap();
    let mut robot = Robot::new(&world, RobotDescription::named(robot).unwrap(), seed).unwrap();
    let mut entries = Vec::new();
    let tour: Vec<Point2<f64>> = world.tours()[0].points.clone();
    robot.drive_tour(&tour, &TourOptions::default(), |_, mut log| entries.append(&mut log)).unwrap();
    entries
}

#[test]
fn the_same_seed_gives_the_same_log_and_another_seed_another() {
    for robot in RobotDescription::NAMES {
        assert_eq!(drive(robot, 5), drive(robot, 5), "{robot}");
        assert_ne!(drive(robot, 5), drive(robot, 6), "{robot}");
    }
}

#[test]
fn a_log_reads_back_to_the_same_entries() {
    for robot in RobotDescription::NAMES {
        let entries = drive(robot, 5);
        let mut writer = CarmenWriter::new(Vec::new());
        entries.iter().try_for_each(|entry| writer.write(entry)).unwrap();
        let bytes = writer.into_inner();
        let reader = CarmenReader::new("own.log", bytes.as_slice(), CarmenOptions::default()).unwrap();
        let read: Vec<Entry> = reader.map(|entry| entry.unwrap()).collect();
        assert_eq!(read.len(), entries.len(), "{robot}");
        for (read, written) in read.iter().zip(&entries) {
            assert_eq!(read.stamp, written.stamp);
            assert_eq!(std::mem::discriminant(&read.kind), std::mem::discriminant(&written.kind));
            assert!(is_same(read, written), "{robot}: {read:?} is not {written:?}");
        }
    }
}

/// Equal but for the last bits of angles, which pass through sine and cosine.
fn is_same(a: &Entry, b: &Entry) -> bool {
    use simulator::robot_log::EntryKind::{Heading, Odometry, Scan, Truth};
    match (&a.kind, &b.kind) {
        (Odometry { odom_from_robot: a }, Odometry { odom_from_robot: b })
        | (Truth { map_from_robot: a }, Truth { map_from_robot: b }) => {
            (a.translation.vector - b.translation.vector).norm() == 0.0
                && a.rotation.angle_to(&b.rotation).abs() < 1e-12
        }
        (Heading { heading: a, .. }, Heading { heading: b, .. }) => (*a - *b).abs() < 1e-12,
        (Scan { scan: a, .. }, Scan { scan: b, .. }) => {
            a.readings() == b.readings() && a.sensor().name() == b.sensor().name()
        }
        _ => false,
    }
}

use std::sync::Arc;

use approx::assert_relative_eq;
use proptest::prelude::*;
use robot_log::local_grid::nalgebra::{Isometry2, Vector2};
use robot_log::local_grid::{Heading, RangeSensor, Reading, Scan, SensorKind, Sweep};
use robot_log::{CarmenOptions, CarmenReader, CarmenWriter, Entry, EntryKind};

fn written(entries: &[Entry]) -> Vec<u8> {
    let mut log = CarmenWriter::new(Vec::new());
    log.comment("made by a test\nin two lines").unwrap();
    entries.iter().for_each(|entry| log.write(entry).unwrap());
    log.into_inner()
}

fn read(text: &[u8]) -> Vec<Entry> {
    CarmenReader::new("own.log", text, CarmenOptions::default()).unwrap().collect::<Result<_, _>>().unwrap()
}

/// Poses pass through an angle, so they are compared to a part in 10¹²; everything else is exact.
fn assert_same(a: &Entry, b: &Entry) {
    assert_eq!(a.stamp, b.stamp);
    match (&a.kind, &b.kind) {
        (EntryKind::Odometry { odom_from_robot: a }, EntryKind::Odometry { odom_from_robot: b })
        | (EntryKind::Truth { map_from_robot: a }, EntryKind::Truth { map_from_robot: b }) => {
            assert_relative_eq!(a, b, epsilon = 1e-12);
        }
        (EntryKind::Heading { heading: a, deviation: p }, EntryKind::Heading { heading: b, deviation: q })
        | (EntryKind::Gyro { heading: a, deviation: p }, EntryKind::Gyro { heading: b, deviation: q }) => {
            assert_relative_eq!(*a - *b, 0.0, epsilon = 1e-12);
            assert_eq!(p, q);
        }
        (EntryKind::Scan { odom_from_robot: p, scan: a }, EntryKind::Scan { odom_from_robot: q, scan: b }) => {
            assert_eq!(p.is_some(), q.is_some());
            p.iter().zip(q).for_each(|(p, q)| assert_relative_eq!(p, q, epsilon = 1e-12));
            assert_eq!(a.readings(), b.readings());
            assert_eq!(a.sweep(), b.sweep());
            let (a, b) = (a.sensor(), b.sensor());
            assert_eq!((a.name(), a.kind()), (b.name(), b.kind()));
            assert_eq!((a.min_range(), a.max_range()), (b.min_range(), b.max_range()));
            assert_relative_eq!(a.beam_width(), b.beam_width(), epsilon = 1e-12);
            a.mounts().iter().zip(b.mounts()).for_each(|(a, b)| assert_relative_eq!(a, b, epsilon = 1e-9));
        }
        (
            EntryKind::Recognition { earlier: a, similarity: p },
            EntryKind::Recognition { earlier: b, similarity: q },
        ) => assert_eq!((a, p), (b, q)),
        other => panic!("another kind: {other:?}"),
    }
}

fn pose() -> impl Strategy<Value = Isometry2<f64>> {
    (-1e3..1e3, -1e3..1e3, -4.0..4.0).prop_map(|(x, y, heading)| Isometry2::new(Vector2::new(x, y), heading))
}

fn readings(count: usize) -> impl Strategy<Value = Vec<Reading>> {
    let reading = prop_oneof![(0.43f32..6.4).prop_map(Reading::Echo), Just(Reading::NoEcho), Just(Reading::Invalid)];
    proptest::collection::vec(reading, count)
}

fn sonar() -> Arc<RangeSensor> {
    let width = 25f64.to_radians();
    Arc::new(RangeSensor::ring("sonar ring", SensorKind::Sonar, 16, 0.225, width, 0.43..=6.47).unwrap())
}

fn laser(name: &str) -> Arc<RangeSensor> {
    let mount = Isometry2::new(Vector2::new(0.2, -0.1), 0.3);
    Arc::new(RangeSensor::fan(name, mount, -2.0, 0.1, 41, 0.1..=6.5).unwrap())
}

/// How the robot moved during a scan.
fn sweep() -> impl Strategy<Value = Sweep> {
    (-1.0..1.0, -0.1..0.1, -0.5..0.5).prop_map(|(ahead, left, turn)| Sweep { step: Vector2::new(ahead, left), turn })
}

fn kind() -> impl Strategy<Value = EntryKind> {
    let scan = |odom_from_robot, sensor, readings| EntryKind::Scan {
        odom_from_robot,
        scan: Scan::new(sensor, readings).unwrap(),
    };
    let swept = |odom_from_robot, sensor, readings, sweep| EntryKind::Scan {
        odom_from_robot,
        scan: Scan::new(sensor, readings).unwrap().swept(sweep),
    };
    prop_oneof![
        pose().prop_map(|odom_from_robot| EntryKind::Odometry { odom_from_robot }),
        pose().prop_map(|map_from_robot| EntryKind::Truth { map_from_robot }),
        (-3.0..3.0, 0.001..0.5)
            .prop_map(|(heading, deviation)| EntryKind::Heading { heading: Heading::from_radians(heading), deviation }),
        (-3.0..3.0, 0.001..0.5)
            .prop_map(|(heading, deviation)| EntryKind::Gyro { heading: Heading::from_radians(heading), deviation }),
        (readings(41), sweep()).prop_map(move |(readings, sweep)| swept(None, laser("third"), readings, sweep)),
        (pose(), readings(41), sweep()).prop_map(move |(pose, readings, sweep)| swept(
            Some(pose),
            laser("front"),
            readings,
            sweep
        )),
        (0.0..1.0, 0.0..1.0).prop_map(|(earlier, similarity)| EntryKind::Recognition { earlier, similarity }),
        readings(16).prop_map(move |readings| scan(None, sonar(), readings)),
        readings(41).prop_map(move |readings| scan(None, laser("third"), readings)),
        (pose(), readings(41)).prop_map(move |(pose, readings)| scan(Some(pose), laser("front"), readings)),
        (pose(), readings(41)).prop_map(move |(pose, readings)| scan(Some(pose), laser("rear one"), readings)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn what_is_written_is_read_back(kinds in proptest::collection::vec((kind(), 0.0..2.0), 1..30)) {
        let mut stamp = 1.0;
        let entries: Vec<Entry> = kinds.into_iter().map(|(kind, wait)| { stamp += wait; Entry { stamp, kind } }).collect();
        let back = read(&written(&entries));
        prop_assert_eq!(entries.len(), back.len());
        entries.iter().zip(&back).for_each(|(a, b)| assert_same(a, b));
    }
}

#[test]
fn a_ring_with_odometry_reads_back_as_two_entries() {
    let odom_from_robot = Some(Isometry2::new(Vector2::new(1.0, 2.0), 0.3));
    let scan = Scan::new(sonar(), vec![Reading::Echo(1.0); 16]).unwrap();
    let back = read(&written(&[Entry { stamp: 1.0, kind: EntryKind::Scan { odom_from_robot, scan } }]));
    assert_eq!(back.len(), 2);
    assert!(matches!(back[0].kind, EntryKind::Odometry { .. }));
}

#[test]
fn an_echo_at_the_limit_stays_an_echo() {
    let sensor = Arc::new(RangeSensor::ring("s", SensorKind::Sonar, 2, 0.2, 0.4, 0.43..=6.47).unwrap());
    let scan = Scan::new(sensor, vec![Reading::Echo(6.47), Reading::NoEcho]).unwrap();
    let back = read(&written(&[Entry { stamp: 1.0, kind: EntryKind::Scan { odom_from_robot: None, scan } }]));
    let EntryKind::Scan { scan, .. } = &back[0].kind else { panic!() };
    assert!(matches!(scan.readings()[0], Reading::Echo(range) if (range - 6.47).abs() < 1e-5));
    assert_eq!(scan.readings()[1], Reading::NoEcho);
}

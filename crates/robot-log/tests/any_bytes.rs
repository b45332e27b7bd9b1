//! Whatever the bytes, every reader ends with entries that can be computed with, or with an error that says where.

use std::io::{Cursor, Write};

use proptest::prelude::*;
use robot_log::local_grid::Sweep;
use robot_log::{CarmenOptions, Entry, EntryKind, Input, LogError, ReadOptions, RobotDescription, open_log};

const CARMEN: &str = "PARAM sonar_max_range 4 n 0
SONAR 0.4 2 1 2 0.1 0 0 0 0.1 1.57 1 h 1
SWEEP 0.1 0 0.05 1.5 h 1
FLASER 3 1 2 3 0 0 0 0 0 0 1.5 h 1
IMU 0 0 9 1 0 0 0 0 0 0 0 0 0 2 h 2
LOOP 1.5 0.75 2 h 2
TRUEPOS 1 2 3 1 2 3 3 h 3
ODOM 1 2 3 0 0 0 4 h 4
";
const RSF: &str = "odom2 0 1 0 0 0.1 0.1 0.1
odom2 2 1 0 0.5 0.1 0.1 0.1
loop 4 1.5 0.75
range3 1 2 3
point2 2 7 8 0 0 0 0
angle 2 0.5 0
";
const TABLE: &str = "2,2,51,72,89,10,60,472,496\n14,16,52,64,95,10,60,469,497\n20,30,52,64,95,11,60,469,497\n";

fn gzip(text: &[u8]) -> Vec<u8> {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(text).unwrap();
    packed.finish().unwrap()
}

fn is_finite(kind: &EntryKind) -> bool {
    let pose =
        |pose: &robot_log::local_grid::nalgebra::Isometry2<f64>| pose.to_homogeneous().iter().all(|x| x.is_finite());
    match kind {
        EntryKind::Odometry { odom_from_robot } => pose(odom_from_robot),
        EntryKind::Scan { odom_from_robot, scan } => {
            let moved = |sweep: &Sweep| sweep.step.iter().all(|x| x.is_finite()) && sweep.turn.is_finite();
            odom_from_robot.iter().all(pose) && scan.sweep().is_none_or(moved)
        }
        EntryKind::Heading { heading, deviation } | EntryKind::Gyro { heading, deviation } => {
            heading.radians().is_finite() && deviation.is_finite()
        }
        EntryKind::Recognition { earlier, similarity } => earlier.is_finite() && similarity.is_finite(),
        EntryKind::Truth { map_from_robot } => pose(map_from_robot),
        _ => true,
    }
}

/// Reads to the end, strictly and leniently, and checks what comes.
fn exhaust(bytes: &[u8], robot: Option<&str>) {
    let lines = bytes.split(|byte| *byte == b'\n').count() as u64;
    for lenient in [false, true] {
        let carmen = CarmenOptions { lenient, ..CarmenOptions::default() };
        let robot = robot.map(|name| RobotDescription::builtin(name).unwrap());
        let input = Input::new("x", Cursor::new(bytes.to_vec()));
        let read = open_log(vec![input], &ReadOptions { carmen, robot });
        let read: Vec<Result<Entry, LogError>> = read.map_or_else(|error| vec![Err(error)], |log| log.collect());
        let mut latest = f64::NEG_INFINITY;
        for step in &read {
            match step {
                Ok(entry) => {
                    assert!(entry.stamp.is_finite() && entry.stamp >= latest, "{entry:?} after {latest}");
                    assert!(is_finite(&entry.kind), "{entry:?}");
                    latest = entry.stamp;
                }
                Err(error) => assert!(error.line <= lines || bytes.starts_with(&[0x1f, 0x8b]), "{error} of {lines}"),
            }
        }
        assert!(read.iter().rev().skip(1).all(Result::is_ok), "nothing comes after an error");
    }
}

/// Words that break readers which trust their input.
fn word() -> impl Strategy<Value = String> {
    let words = [
        "nan",
        "inf",
        "-inf",
        "1e308",
        "-1e308",
        "1e-320",
        "-0",
        "0",
        "-1",
        "18446744073709551616",
        "9e99",
        "0x10",
        "é",
        "\u{0}",
        "",
        "1,2",
        "ODOM",
        "FLASER",
        "SONAR",
        "odom2",
        "loop",
        "point2",
        "angle",
        "#",
        "\r",
    ];
    prop_oneof![
        proptest::sample::select(words.to_vec()).prop_map(str::to_owned),
        any::<f64>().prop_map(|x| x.to_string())
    ]
}

/// A log with some of its words replaced, a piece cut out, and a few bytes changed.
fn damaged(text: &'static str) -> impl Strategy<Value = Vec<u8>> {
    let words = proptest::collection::vec((0usize..200, word()), 0..4);
    let bytes = proptest::collection::vec((0usize..1000, any::<u8>()), 0..3);
    (words, bytes, 0usize..1000, 0usize..40).prop_map(move |(words, bytes, at, cut)| {
        let separator = if text.contains(',') { ',' } else { ' ' };
        let mut lines: Vec<Vec<String>> =
            text.lines().map(|line| line.split(separator).map(str::to_owned).collect()).collect();
        for (index, word) in words {
            let line = index % lines.len();
            let column = index / lines.len() % lines[line].len();
            lines[line][column] = word;
        }
        let joined: Vec<String> = lines.iter().map(|line| line.join(&separator.to_string())).collect();
        let mut whole = joined.join("\n").into_bytes();
        for (at, byte) in bytes {
            let at = at % whole.len();
            whole[at] = byte;
        }
        let from = at % whole.len();
        whole.drain(from..(from + cut).min(whole.len()));
        whole
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn random_bytes_end_well(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        exhaust(&bytes, None);
        exhaust(&bytes, Some("bigwheel"));
    }

    #[test]
    fn damaged_logs_end_well(
        carmen in damaged(CARMEN), rsf in damaged(RSF), table in damaged(TABLE), at in 0usize..200, byte in any::<u8>(),
    ) {
        exhaust(&carmen, None);
        exhaust(&rsf, None);
        exhaust(&table, Some("bigwheel"));
        let mut packed = gzip(&rsf);
        let at = at % packed.len();
        packed[at] = byte;
        exhaust(&packed, None);
        exhaust(&packed[..at], None);
    }

    #[test]
    fn descriptions_end_well(text in "[a-z_\\[\\]={}\", .0-9\n-]{0,200}") {
        let _ = RobotDescription::from_toml(&text);
    }
}

#[test]
fn every_robot_refuses_the_logs_of_all_others_in_words() {
    for robot in RobotDescription::builtin_names() {
        for text in [CARMEN, RSF, TABLE, "\n\n", "a b c\n", "1 2\n"] {
            exhaust(text.as_bytes(), Some(robot));
        }
    }
}

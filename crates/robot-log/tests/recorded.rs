use std::fs::File;
use std::io::BufReader;

use robot_log::local_grid::nalgebra::Isometry2;
use robot_log::{CarmenOptions, CarmenReader, Entry, EntryKind};

use crate::recorded;

/// All entries of a recorded CARMEN log and the reader's report.
fn read(path: &str) -> Option<(Vec<Entry>, CarmenReader<BufReader<File>>)> {
    let file = recorded(path)?;
    let mut log = CarmenReader::new(path, BufReader::new(File::open(file).unwrap()), CarmenOptions::default()).unwrap();
    let entries = log.by_ref().collect::<Result<Vec<_>, _>>().unwrap_or_else(|error| panic!("{error}"));
    Some((entries, log))
}

fn poses(entries: &[Entry]) -> Vec<Isometry2<f64>> {
    let pose = |entry: &Entry| match &entry.kind {
        EntryKind::Odometry { odom_from_robot } => Some(*odom_from_robot),
        EntryKind::Scan { odom_from_robot, .. } => *odom_from_robot,
        _ => None,
    };
    entries.iter().filter_map(pose).collect()
}

fn path_length(poses: &[Isometry2<f64>]) -> f64 {
    poses.windows(2).map(|pair| (pair[1].translation.vector - pair[0].translation.vector).norm()).sum()
}

fn scans(entries: &[Entry]) -> usize {
    entries.iter().filter(|entry| matches!(entry.kind, EntryKind::Scan { .. })).count()
}

#[test]
fn intel_has_its_published_size() {
    let Some((entries, log)) = read("laser/intel/intel_raw.clf.gz") else { return };
    assert_eq!(entries.len(), 2726);
    assert!((path_length(&poses(&entries)) - 506.0).abs() < 0.1);
    assert_eq!((log.report().stamps_held, log.report().stamps_given, log.report().mounts_ignored), (0, 0, 0));
    // The stamps are those that the relations name.
    assert_eq!(entries[0].stamp, 976052856.577985);
    let EntryKind::Scan { scan, .. } = &entries[0].kind else { panic!() };
    assert_eq!(scan.readings().len(), 180);
}

#[test]
fn corrected_logs_are_readable_with_whatever_clock_they_have() {
    for (name, count, length) in [
        ("intel", 910, 499.5),
        ("belgioioso", 395, 219.0),
        ("edmonton", 340, 323.7),
        ("orebro", 237, 221.4),
        ("freiburg-101", 292, 210.6),
    ] {
        let Some((entries, log)) = read(&format!("laser/corrected/{name}-corrected.log.gz")) else { return };
        assert_eq!(scans(&entries), count, "{name}");
        let of_scans: Vec<Entry> =
            entries.iter().filter(|entry| matches!(entry.kind, EntryKind::Scan { .. })).cloned().collect();
        let length_read = path_length(&poses(&of_scans));
        println!("{name}: {length_read:.1} m, {:?}", log.report());
        assert!((length_read - length).abs() < 0.1, "{name}: {length_read}");
        assert!(entries.windows(2).all(|pair| pair[0].stamp <= pair[1].stamp), "{name}");
        assert_eq!(log.report().mounts_ignored, 0);
    }
}

#[test]
fn new_style_lasers_are_read() {
    let Some((entries, log)) = read("laser/intel/intel-lab_scangraph.log.gz") else { return };
    assert_eq!(entries.len(), 2672);
    assert_eq!(log.report().passed_over["EDGE2"], 3901);
    println!("{:?}", log.report());
}

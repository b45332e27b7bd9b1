use std::io::Cursor;

use approx::assert_relative_eq;
use robot_log::{CarmenOptions, Entry, EntryKind, Input, LogError, ReadOptions, open_log};

fn read(text: &str, lenient: bool) -> Result<Vec<Entry>, LogError> {
    let options = ReadOptions { carmen: CarmenOptions { lenient, ..CarmenOptions::default() }, robot: None };
    open_log(vec![Input::new("corridor.txt", Cursor::new(text.to_owned()))], &options)?.collect()
}

const LOG: &str = "# made by a test
odom2 0 1 0 0 0.1 0.1 0.1
odom2 2 1 0 0.5 0.1 0.1 0.1
odom2 4 0 0 0 0.1 0.1 0.1
loop 4 1.5 0.75
loop 1.5 4 0.25
range3 1 2 3
point2 2 7 8 0 0 0 0
angle 2 0.5 0
";

#[test]
fn velocities_hold_until_the_next_line() {
    let entries = read(LOG, false).unwrap();
    let poses: Vec<_> = entries
        .iter()
        .filter_map(|entry| match entry.kind {
            EntryKind::Odometry { odom_from_robot: pose } => Some((pose.translation.x, pose.rotation.angle())),
            _ => None,
        })
        .collect();
    assert_eq!(poses, [(0.0, 0.0), (2.0, 0.0), (4.0, 1.0)]);
}

#[test]
fn kinds_of_lines_are_merged_by_their_stamps() {
    let entries = read(LOG, false).unwrap();
    let stamps: Vec<f64> = entries.iter().map(|entry| entry.stamp).collect();
    assert_eq!(stamps, [0.0, 2.0, 2.0, 4.0, 4.0, 4.0]);
    let EntryKind::Truth { map_from_robot } = entries[2].kind else { panic!("{:?}", entries[2]) };
    assert_relative_eq!(map_from_robot.rotation.angle(), 0.5);
    assert_eq!((map_from_robot.translation.x, map_from_robot.translation.y), (7.0, 8.0));
    for (entry, expected) in entries[4..].iter().zip([0.75, 0.25]) {
        assert_eq!(entry.kind, EntryKind::Recognition { earlier: 1.5, similarity: expected });
    }
}

#[test]
fn faults_are_named_or_left_out() {
    for (line, why) in [
        ("odom2 3 nan 0 0 1 1 1", "corridor.txt:10:9: expected the velocity ahead"),
        ("odom2 3.5 0 0 0 1 1", "the variances"),
        ("odom2 3.5 0 0 0 1 1 1", "the clock must not run backwards"),
        ("odom2 1e308 0 0 0 1 1 1\nodom2 1.7e308 0 0 0 1 1 1 1", "the end of the line"),
        ("loop 4 1", "expected the similarity, found the end of the line"),
        ("loop 4 1 0.5 0.5", "the end of the line"),
        ("point2 4 1 2", "the covariance"),
        ("\u{7f}x", "a word of libRSF"),
    ] {
        let text = format!("{LOG}{line}\n");
        assert!(read(&text, false).unwrap_err().to_string().contains(why), "{line}");
        assert!(read(&text, true).unwrap().len() >= 6, "{line}");
    }
    assert!(read("odom2 0 1e300 0 0 1 1 1\nodom2 1e300 0 0 0 1 1 1\n", false).is_err(), "no robot is that fast");
    assert!(read("angle 0 1 0\n", false).unwrap_err().to_string().contains("no entry"));
}

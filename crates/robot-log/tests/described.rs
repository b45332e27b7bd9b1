//! The shipped descriptions on the recordings they are made for: figures that others published or counted.

use std::fs::File;
use std::io::BufReader;

use robot_log::local_grid::nalgebra::{Isometry2, Point2, Vector2};
use robot_log::local_grid::{Reading, Scan};
use robot_log::{CarmenOptions, Entry, EntryKind, Input, ReadOptions, RobotDescription, Survey, open_log};

use crate::recorded;

/// The entries of one run of `robot`, and their survey; `None` where the recording is not there.
fn read(robot: &str, files: &[&str], lenient: bool) -> Option<(Vec<Entry>, Survey, u64)> {
    let mut inputs = Vec::new();
    for file in files {
        let path = recorded(file)?;
        inputs.push(Input::new(*file, BufReader::new(File::open(path).unwrap())));
    }
    let carmen = CarmenOptions { lenient, ..CarmenOptions::default() };
    let mut log = open_log(inputs, &ReadOptions { carmen, robot: RobotDescription::builtin(robot) }).unwrap();
    let entries = log.by_ref().collect::<Result<Vec<_>, _>>().unwrap_or_else(|error| panic!("{error}"));
    let skipped = log.reports().map(robot_log::LogReport::skipped_lines).sum();
    let mut survey = Survey::default();
    entries.iter().for_each(|entry| survey.push(entry));
    println!(
        "{robot} {files:?}: {} entries, {:.1} s, {:.2} m, {:.2?}, {skipped} skipped",
        survey.entries,
        survey.duration(),
        survey.path_length,
        survey.extent()
    );
    for sensor in &survey.sensors {
        let (name, share) = (sensor.sensor.name(), sensor.echo_share());
        println!("  {name}: {} scans, {share:.3} echoes at {:?}", sensor.scans, sensor.nearest_farthest);
    }
    Some((entries, survey, skipped))
}

fn close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value}, expected {expected} ± {tolerance}");
}

#[test]
fn ring8() {
    for (run, instants, seconds, path, box_, no_echo) in [
        ("run1", 413, 92.8, 24.96, (16.9, 9.7), 0.32),
        ("run3", 366, 88.4, 10.91, (7.3, 2.0), 0.13),
        ("run5", 127, 37.8, 4.25, (4.2, 0.5), 0.15),
    ] {
        let file = |part: &str| format!("sonar/ring8/{run}_{part}.txt");
        let files = [file("sonar"), file("od")];
        let Some((_, survey, _)) = read("ring8", &files.each_ref().map(String::as_str), false) else { return };
        assert_eq!((survey.poses, survey.scans), (instants, instants));
        close(survey.duration(), seconds, 0.06);
        close(survey.path_length, path, 0.01);
        close(survey.extent().0, box_.0, 0.06);
        close(survey.extent().1, box_.1, 0.06);
        let sonar = &survey.sensors[0];
        // A little more than the share of 5110, since ranges beyond the usable 5 m count as no echo, too.
        close(1.0 - sonar.echo_share() - sonar.invalid_share(), no_echo + 0.01, 0.02);
        let files = [file("laser"), file("sonar"), file("od")];
        let Some((_, survey, _)) = read("ring8", &files.each_ref().map(String::as_str), false) else { return };
        assert_eq!(survey.entries, 3 * instants);
        assert!(survey.sensors.iter().any(|sensor| sensor.sensor.name() == "laser" && sensor.echo_share() > 0.9));
    }
}

#[test]
fn bigwheel() {
    for (name, rows, path, box_, gap) in [
        ("garden_04_04_20", 1474, 67.9, (18.8, 15.5), 22.0),
        ("garden_15_03_20", 864, 58.4, (7.5, 7.8), 2.97),
        ("garden_27_03_20", 652, 35.6, (8.2, 7.5), 0.74),
        ("garden_27_03_20_2", 572, 36.6, (7.3, 8.1), 1.09),
        ("garden_small", 424, 10.2, (2.0, 2.1), 0.54),
    ] {
        let Some((entries, survey, _)) = read("bigwheel", &[&format!("sonar/bigwheel/{name}.csv")], false) else {
            return;
        };
        assert_eq!((survey.headings, survey.scans), (rows, 2 * rows));
        let (low, high, end) = drawn_along_headings(&entries);
        println!("  box {:.1} × {:.1} m, end gap {:.2} m", high.x - low.x, high.y - low.y, end.coords.norm());
        close(survey.path_length, path, 0.1 * path);
        close(high.x - low.x, box_.0, 0.06);
        close(high.y - low.y, box_.1, 0.06);
        close(end.coords.norm(), gap, 0.06); // published to a decimal where it is large
    }
}

/// The box and the end of a path whose steps are those of the wheels, each along the heading that follows it.
fn drawn_along_headings(entries: &[Entry]) -> (Point2<f64>, Point2<f64>, Point2<f64>) {
    let (mut low, mut high, mut at) = (Point2::origin(), Point2::origin(), Point2::origin());
    let (mut odometry, mut step) = (Isometry2::identity(), 0.0);
    for entry in entries {
        match &entry.kind {
            EntryKind::Odometry { odom_from_robot } => {
                let moved = odometry.inv_mul(odom_from_robot).translation.vector;
                step = moved.norm().copysign(moved.x);
                odometry = *odom_from_robot;
            }
            EntryKind::Gyro { heading, .. } => {
                at += Vector2::new(heading.radians().cos(), heading.radians().sin()) * step;
                (low, high) = (low.inf(&at), high.sup(&at));
            }
            _ => {}
        }
    }
    (low, high, at)
}

#[test]
fn roombot3() {
    let Some((_, survey, _)) = read("roombot3", &["sonar/roombot3/roombot_v2.csv"], false) else { return };
    assert_eq!((survey.headings, survey.scans, survey.poses), (389, 389, 0));
    close(survey.duration(), 85.6, 0.06);
}

#[test]
fn rover2016() {
    let Some((entries, survey, _)) = read("rover2016", &["sonar/rover/rover2016_imu_run1.csv"], false) else { return };
    assert_eq!((survey.headings, survey.scans), (2287, 2287));
    close(survey.duration(), 28.8, 0.06);
    close(survey.path_length, 3.7, 0.1);
    let headings: Vec<_> = entries
        .iter()
        .filter_map(|entry| match entry.kind {
            EntryKind::Heading { heading, .. } => Some(heading),
            _ => None,
        })
        .collect();
    let turned: f64 = headings.windows(2).map(|pair| pair[1] - pair[0]).sum();
    close(turned.to_degrees(), 181.0, 2.0); // counter-clockwise, as the encoders say, too
}

#[test]
fn rover2017() {
    let mut echoes = 0;
    for (name, odometry, scans, broken, seconds, path, box_) in [
        ("flur", 629, 318, 0, 65.5, 9.2, (5.0, 2.3)),
        ("apartment", 1877, 847, 1, 196.9, 29.2, (6.7, 4.8)), // its last line is cut off
    ] {
        let file = format!("sonar/rover/rover2017_{name}.log");
        let Some((_, survey, skipped)) = read("rover2017", &[&file], true) else { return };
        assert_eq!((survey.poses, survey.scans + skipped, skipped), (odometry, scans, broken));
        close(survey.duration(), seconds, 0.1);
        close(survey.path_length, path, 0.1);
        close(survey.extent().0, box_.0, 0.2);
        close(survey.extent().1, box_.1, 0.2);
        echoes += survey.sensors[0].echoes;
    }
    // The files hold 327,067 pairs; a few are nearer than the scanner can see.
    assert!((320_000..=327_067).contains(&echoes), "{echoes}");
}

#[test]
fn wean() {
    for (name, scans, others, seconds, path) in
        [("robotdata1", 713, 1505, 135.0, 89.2), ("robotdata2", 2251, 3126, 239.6, 161.5)]
    {
        let Some((_, survey, _)) = read("wean", &[&format!("laser/wean/{name}.log")], false) else { return };
        assert_eq!((survey.scans, survey.poses), (scans, scans + others));
        close(survey.duration(), seconds, 0.1);
        close(survey.path_length, path, 0.3);
    }
}

/// The second scan drawn from the pose of the first: how far its echoes lie from the first's, at the median.
fn mismatch(
    first: (&Scan, robot_log::local_grid::nalgebra::Isometry2<f64>),
    second: (&Scan, robot_log::local_grid::nalgebra::Isometry2<f64>),
) -> f64 {
    let points: Vec<_> = first.0.echo_points().collect();
    let first_from_second = first.1.inv_mul(&second.1);
    let mut distances: Vec<f64> = second
        .0
        .echo_points()
        .step_by(4)
        .map(|point| {
            let point = (first_from_second * robot_log::local_grid::nalgebra::Point2::from(point)).coords;
            points.iter().map(|other| (other - point).norm()).fold(f64::MAX, f64::min)
        })
        .collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(f64::MAX)
}

/// Successive scans must overlap better with the odometry's turn than with the opposite turn: otherwise a sign is wrong.
fn turns_agree(entries: &[Entry], step: usize) {
    let mut latest = None;
    let mut scans = Vec::new();
    for entry in entries {
        match &entry.kind {
            EntryKind::Odometry { odom_from_robot } => latest = Some(*odom_from_robot),
            EntryKind::Scan { odom_from_robot, scan } => {
                latest = odom_from_robot.or(latest);
                scans.extend(latest.map(|pose| (scan, pose)));
            }
            _ => {}
        }
    }
    let (mut with, mut against) = (0.0, 0.0);
    for pair in scans.windows(step + 1).step_by(step) {
        let (first, second) = (pair[0], pair[step]);
        let turn = first.1.rotation.angle_to(&second.1.rotation);
        if turn.abs() > 0.05 {
            with += mismatch(first, second);
            let mirrored = robot_log::local_grid::nalgebra::Isometry2::rotation(-2.0 * turn);
            against += mismatch(first, (second.0, second.1 * mirrored));
        }
    }
    println!("  mismatch {with:.3} with the odometry's turns, {against:.3} with the opposite ones");
    assert!(with < 0.7 * against);
}

#[test]
fn coreslam() {
    for (name, scans, seconds) in [("exp1", 756, 74.6), ("exp3", 525, 51.7)] {
        let Some((entries, survey, _)) = read("coreslam", &[&format!("laser/coreslam/{name}.dat")], false) else {
            return;
        };
        assert_eq!(survey.scans, scans);
        close(survey.duration(), seconds, 0.1);
        turns_agree(&entries, 5);
    }
}

#[test]
fn cas() {
    let Some((entries, survey, _)) = read("cas", &["laser/cas/bakery1.scn", "laser/cas/bakery1.cnt"], false) else {
        return;
    };
    assert_eq!((survey.poses, survey.scans), (6702, 156));
    close(survey.path_length, 109.0, 3.0);
    let echoes = |entry: &Entry| match &entry.kind {
        EntryKind::Scan { scan, .. } => {
            scan.readings().iter().filter(|reading| matches!(reading, Reading::Echo(_))).count()
        }
        _ => 0,
    };
    assert!(entries.iter().map(echoes).max().unwrap() > 340);
    turns_agree(&entries, 1);
}

#[test]
fn turns_of_the_indoor_robots_agree_with_their_lasers() {
    for (robot, files, step) in [
        ("ring8", vec!["sonar/ring8/run1_od.txt", "sonar/ring8/run1_laser.txt"], 3),
        ("wean", vec!["laser/wean/robotdata1.log"], 3),
    ] {
        let Some((entries, _, _)) = read(robot, &files, false) else { return };
        turns_agree(&entries, step);
    }
}

#[test]
fn zumo3() {
    for (name, sonar_lines, motor_lines, others) in [
        ("controlled_run", 2599, 58, 9),
        ("pieter_01", 2974, 30, 0),
        ("testdata-film-feli01", 9272, 100, 0),
        ("testdata-film06", 6719, 141, 1),
    ] {
        let Some((_, survey, skipped)) = read("zumo3", &[&format!("sonar/zumo3/{name}.txt")], true) else { return };
        println!("  {skipped} of {} lines skipped", sonar_lines + motor_lines + others);
        assert!(survey.scans.abs_diff(sonar_lines) <= 3, "{}", survey.scans);
        assert!(survey.poses.abs_diff(motor_lines) <= 3, "{}", survey.poses);
    }
}

#[test]
fn scitos24() {
    let Some((_, survey, _)) = read("scitos24", &["sonar/scitos24/sensor_readings_24.csv"], false) else { return };
    assert_eq!(survey.scans, 5456);
    close(1.0 - survey.sensors[0].echo_share(), 0.138, 0.002);
}

use robot_log::local_grid::{Reading, SensorKind};
use robot_log::{CarmenOptions, CarmenReader, Clock, EntryKind, LogErrorKind};

use crate::read;

fn scan_of(kind: &EntryKind) -> &robot_log::local_grid::Scan {
    let EntryKind::Scan { scan, .. } = kind else { panic!("{kind:?} is no scan") };
    scan
}

#[test]
fn the_mount_is_the_difference_of_the_two_poses() {
    // The robot looks north from (1, 2); its laser sits 0.3 m ahead of it.
    let entries = read("FLASER 181 ".to_owned().as_str()).map(|_| ());
    assert!(entries.is_err(), "a line without its ranges must not pass");
    let ranges = vec!["2.0"; 181].join(" ");
    let text = format!("FLASER 181 {ranges} 1.0 2.3 1.5707963 1.0 2.0 1.5707963 5.0 host 5.0\n");
    let entries = read(&text).unwrap();
    let mounts = scan_of(&entries[0].kind).sensor().mounts();
    approx::assert_relative_eq!(mounts[90].translation.x, 0.3, epsilon = 1e-6);
    approx::assert_relative_eq!(mounts[90].rotation.angle(), 0.0, epsilon = 1e-6);
    approx::assert_relative_eq!(mounts[0].rotation.angle(), -std::f64::consts::FRAC_PI_2, epsilon = 1e-6);
    approx::assert_relative_eq!(mounts[180].rotation.angle(), std::f64::consts::FRAC_PI_2, epsilon = 1e-6);
}

#[test]
fn scanners_of_180_beams_have_a_degree_between_them() {
    for (count, step) in [(180, 1.0_f64), (181, 1.0), (360, 0.5), (361, 0.5)] {
        let text = format!("FLASER {count} {} 0 0 0 0 0 0 1 h 1\n", vec!["1"; count].join(" "));
        let entries = read(&text).unwrap();
        approx::assert_relative_eq!(
            scan_of(&entries[0].kind).sensor().beam_width(),
            step.to_radians(),
            epsilon = 1e-12
        );
    }
}

#[test]
fn a_robot_laser_says_its_own_geometry() {
    let text = "ROBOTLASER1 0 -0.5 1.0 0.5 20.0 0.01 0 3 5 20 0 2 7 8 1 0 0 1 0 0 0 0 0 0 0 9.5 h 1\n";
    let entries = read(text).unwrap();
    let scan = scan_of(&entries[0].kind);
    assert_eq!(scan.readings(), [Reading::Echo(5.0), Reading::NoEcho, Reading::Invalid]);
    approx::assert_relative_eq!(scan.sensor().mounts()[2].rotation.angle(), 0.5, epsilon = 1e-12);
    assert_eq!(entries[0].stamp, 9.5, "the stamp is the time the message was sent");
    assert_eq!(scan.sensor().name(), "robotlaser1");
}

#[test]
fn raw_lasers_take_their_mount_from_parameters() {
    let text = "PARAM robot_frontlaser_offset 0.25 nohost 0\nRAWLASER1 0 -0.5 1.0 0.5 20 0.01 0 3 5 6 7 0 2 h 2\n\
                RAWLASER2 0 -0.5 1.0 0.5 20 0.01 0 3 5 6 7 0 3 h 3\n";
    let entries = read(text).unwrap();
    let points: Vec<_> = scan_of(&entries[0].kind).echo_points().collect();
    approx::assert_relative_eq!(points[1].x, 6.25, epsilon = 1e-6);
    let behind: Vec<_> = scan_of(&entries[1].kind).echo_points().collect();
    approx::assert_relative_eq!(behind[1].x, -6.0, epsilon = 1e-6);
    assert!(matches!(entries[0].kind, EntryKind::Scan { odom_from_robot: None, .. }));
}

#[test]
fn a_laser_that_is_logged_twice_counts_once() {
    let raw = "RAWLASER1 0 -0.5 1.0 0.5 20 0.01 0 3 5 6 7 0 2 h 2\n";
    let posed = "ROBOTLASER1 0 -0.5 1.0 0.5 20.0 0.01 0 3 5 6 7 0 0 0 0 0 0 0 0 0 0 0 0 2 h 2\n";
    let mut log =
        CarmenReader::new("x", [raw, posed, raw].concat().leak().as_bytes(), CarmenOptions::default()).unwrap();
    assert_eq!(log.by_ref().map(Result::unwrap).count(), 1);
    assert_eq!(log.report().passed_over["RAWLASER1"], 2);
}

#[test]
fn sonars_bring_their_mounts() {
    let text = "PARAM sonar_max_range 6.47 nohost 0\nSONAR 0.4363 2 1.5 6.47 0.2 0 0 0 0.2 1.5708 4.0 h 4.0\n";
    let entries = read(text).unwrap();
    let scan = scan_of(&entries[0].kind);
    assert_eq!(scan.sensor().kind(), SensorKind::Sonar);
    assert_eq!(scan.readings(), [Reading::Echo(1.5), Reading::NoEcho]);
    approx::assert_relative_eq!(scan.sensor().mounts()[1].translation.y, 0.2);
}

#[test]
fn scans_of_one_sensor_share_its_description() {
    let line = "FLASER 3 1 2 3 0 0 0 0 0 0 1 h 1\n";
    let entries = read(&line.repeat(3)).unwrap();
    let sensors: Vec<_> = entries.iter().map(|entry| scan_of(&entry.kind).sensor().clone()).collect();
    assert!(std::sync::Arc::ptr_eq(&sensors[0], &sensors[2]));
}

#[test]
fn the_heading_is_the_yaw_of_the_attitude() {
    let half = 1.2_f64 / 2.0;
    let text = format!("IMU 0 0 9.81 {} 0 0 {} 0 0 0 0 0 0 2.0 h 2.0\n", half.cos(), half.sin());
    let entries = read(&text).unwrap();
    let EntryKind::Heading { heading, deviation } = entries[0].kind else { panic!() };
    approx::assert_relative_eq!(heading.radians(), 1.2, epsilon = 1e-12);
    assert_eq!(deviation, 5f64.to_radians());
    assert!(matches!(
        read("IMU 0 0 9.81 0 0 0 0 0 0 0 0 0 0 2.0 h 2.0\n").unwrap_err().kind,
        LogErrorKind::Foreign { .. }
    ));
}

#[test]
fn equal_stamps_are_in_order_and_zero_is_no_stamp() {
    let odom = |stamp: f64| format!("ODOM 0 0 0 0 0 0 {stamp} h {stamp}\n");
    let text = [odom(5.0), odom(5.0), odom(0.0), odom(4.5), odom(6.0)].concat();
    let mut log = CarmenReader::new("x", text.as_bytes(), CarmenOptions::default()).unwrap();
    let stamps: Vec<f64> = log.by_ref().map(|entry| entry.unwrap().stamp).collect();
    assert_eq!(stamps, [5.0, 5.0, 5.0, 5.0, 6.0]);
    assert_eq!((log.report().stamps_given, log.report().stamps_held), (1, 1));
}

#[test]
fn an_odometry_line_that_repeats_a_scan_is_no_entry() {
    let text = "FLASER 3 1 2 3 1 2 0 1 2 0 5.5 h 5\nODOM 1 2 0 0 0 0 1.2 h 1\nODOM 1.1 2 0 0 0 0 5.6 h 5\n";
    let stamps: Vec<f64> = read(text).unwrap().iter().map(|entry| entry.stamp).collect();
    assert_eq!(stamps, [5.5, 5.6]); // the stamp 1.2 comes from memory that nobody set
}

#[test]
fn a_clock_that_runs_backwards_is_an_error_with_its_place() {
    let text = "ODOM 0 0 0 0 0 0 50 h 1\nODOM 0 0 0 0 0 0 20 h 2\n";
    let error = read(text).unwrap_err();
    assert_eq!((error.line, error.column), (2, 18));
    assert!(matches!(error.kind, LogErrorKind::Backwards { by, .. } if by == 30.0));
    let logger = CarmenOptions { clock: Clock::Logger, ..CarmenOptions::default() };
    let stamps: Vec<f64> =
        CarmenReader::new("x", text.as_bytes(), logger).unwrap().map(|entry| entry.unwrap().stamp).collect();
    assert_eq!(stamps, [1.0, 2.0]);
}

#[test]
fn errors_name_file_line_column_and_what_was_expected() {
    let error = read("# comment\nODOM 1 2 O.1 0 0 0 1 h 1\n").unwrap_err();
    assert_eq!(error.to_string(), "test.log:2:10: expected heading of the robot in radians, found `O.1`");
    assert_eq!(error.kind.code(), "log.field");
    let excerpt = error.excerpt.unwrap();
    assert_eq!(&excerpt.text[excerpt.start..excerpt.start + excerpt.length], "O.1");
    let error = read("ODOM 1 2\n").unwrap_err();
    assert!(error.to_string().ends_with("found the end of the line"), "{error}");
    for range in ["nan", "inf", "-1", "-0.5"] {
        let error = read(&format!("FLASER 3 1 {range} 3 0 0 0 0 0 0 1 h 1\n")).unwrap_err();
        assert_eq!((error.line, error.column), (1, 12), "{range}");
    }
}

#[test]
fn lenient_reading_counts_what_it_leaves_out() {
    let text =
        "ODOM 0 0 0 0 0 0 1 h 1\nODOM 0 x 0 0 0 0 2 h 2\nfoo\nODOM 0 0 0 0 0 0 0.1 h 3\nODOM 0 0 0 0 0 0 3 h 3\n";
    let lenient = CarmenOptions { lenient: true, hold: 0.5, ..CarmenOptions::default() };
    let mut log = CarmenReader::new("x", text.as_bytes(), lenient).unwrap();
    assert_eq!(log.by_ref().map(Result::unwrap).count(), 2);
    assert_eq!(log.report().skipped_lines(), 3);
    assert_eq!(log.report().skipped["log.backwards"], 1);
    assert_eq!(log.report().errors[1].line, 3);
}

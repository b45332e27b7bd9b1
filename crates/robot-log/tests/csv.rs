use proptest::prelude::*;
use robot_log::{CsvReader, Entry, EntryKind, Input, LogErrorKind, ReadOptions, RobotDescription, open_log};

fn robot(name: &str) -> RobotDescription {
    RobotDescription::builtin(name).unwrap()
}

/// All robots that are shipped, read once.
fn robots() -> &'static [RobotDescription] {
    static ROBOTS: std::sync::OnceLock<Vec<RobotDescription>> = std::sync::OnceLock::new();
    ROBOTS.get_or_init(|| RobotDescription::builtin_names().map(robot).collect())
}

fn read(file: &str, text: &str, name: &str) -> Result<Vec<Entry>, robot_log::LogError> {
    CsvReader::new(file, text.as_bytes(), &robot(name), false)?.collect()
}

#[test]
fn every_description_that_is_shipped_can_be_read() {
    for name in RobotDescription::builtin_names() {
        let robot = robot(name);
        assert_eq!(robot.name(), name);
        assert!(!robot.about().is_empty() && !robot.sensors().is_empty());
    }
    assert!(RobotDescription::builtin("r2d2").is_none());
}

#[test]
fn descriptions_that_make_no_sense_are_refused() {
    let table = "name = 'x'\n[[table]]\nperiod_s = 1\n";
    for (text, why) in [
        ("name = 'x'", "missing field `table`"),
        ("name = 'x'\ntable = []", "no table"),
        (&format!("{table}colour = 3"), "unknown field `colour`"),
        (&format!("{table}stamp = {{ column = 1 }}"), "either `stamp` or `period_s`"),
        (&format!("{table}pose = {{ x = 0, y = 1, heading = 2 }}"), "column 0"),
        (&format!("{table}ranges = [{{ sensor = 's', from = 1 }}]"), "`s`, which is not described"),
        (&format!("{table}ranges = [{{ sensor = 's' }}]"), "need one of"),
        (&format!("{table}wheels = {{ left = [], right = [1], metres = 1, track = 1 }}"), "without columns"),
        (&format!("{table}wheels = {{ left = [1], right = [1], metres = 0, track = 1 }}"), "the unit 0"),
        (&format!("{table}heading = {{ column = 1, deviation_deg = 0 }}"), "not positive"),
        (
            &format!("{table}[[sensor]]\nname = 's'\nkind = 'sonar'\nrange_m = [0, 1]\nmounts = [[0, 0, 0]]"),
            "beam_width_deg",
        ),
        (
            &format!(
                "{table}[[sensor]]\nname = 's'\nkind = 'sonar'\nrange_m = [2, 1]\nbeam_width_deg = 3\nmounts = [[0, 0, 0]]"
            ),
            "cannot exist",
        ),
    ] {
        let error = RobotDescription::from_toml(text).unwrap_err().to_string();
        assert!(error.contains(why), "{text}: {error}");
    }
}

/// A robot that drives a metre in a tenth of a second, and whose scans of five hundredths come `latency` seconds late.
fn late(latency: &str, heading: &str) -> String {
    format!(
        "name = 'x'\n[[table]]\nstamp = {{ column = 1, seconds = 1 }}\n{heading}\n\
         pose = {{ x = 2, y = 3, heading = 4, metres = 1 }}\n\
         ranges = [{{ sensor = 's', from = 5, metres = 1, sweep_s = 0.05, latency_s = {latency} }}]\n\
         [[sensor]]\nname = 's'\nkind = 'laser'\nrange_m = [0, 9]\nbeam_width_deg = 1\nmounts = [[0, 0, 0], [0, 0, 9]]"
    )
}

#[test]
fn a_scan_that_comes_late_belongs_to_where_the_robot_was() {
    let robot = RobotDescription::from_toml(&late("0.15", "")).unwrap();
    let rows = "0.0 0 0 0 5 5\n0.1 1 0 0 4 4\n0.2 3 0 0 3 3\n";
    let log = CsvReader::new("x.txt", rows.as_bytes(), &robot, false).unwrap();
    let entries: Vec<Entry> = log.collect::<Result<_, _>>().unwrap();
    let seen = |entry: &Entry| match &entry.kind {
        EntryKind::Scan { odom_from_robot, scan } => {
            (entry.stamp, odom_from_robot.unwrap().translation.x, scan.sweep().map_or(0.0, |sweep| sweep.step.x))
        }
        other => panic!("{other:?}"),
    };
    let seen: Vec<(f64, f64, f64)> = entries.iter().map(seen).collect();
    // Before the first row it is where that has it, and moves as it does after.
    for (found, expected) in seen.iter().zip([(-0.15, 0.0, 0.0), (-0.05, 0.0, 0.5), (0.05, 0.5, 0.5)]) {
        for (found, expected) in [(found.0, expected.0), (found.1, expected.1), (found.2, expected.2)] {
            assert!((found - expected).abs() < 1e-9, "{seen:?}");
        }
    }
    for (latency, heading, why) in
        [("1.5", "", "must lie in 0..=1"), ("0.1", "heading = { column = 4, deviation_deg = 1 }", "and no heading")]
    {
        let error = RobotDescription::from_toml(&late(latency, heading)).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
}

#[test]
fn faulty_rows_are_shown_where_they_are() {
    let error = read("run1_od.txt", "1 2 3 4\n2 2 3 x\n", "ring8").unwrap_err();
    assert_eq!(error.to_string(), "run1_od.txt:2:7: expected the heading of the robot, found `x`");
    let error = read("run1_od.txt", "1 2 3\n", "ring8").unwrap_err();
    assert!(
        error.to_string().contains("expected 4 columns, of which 3 are there, found the end of the line"),
        "{error}"
    );
    let error = read("garden.csv", "0,0,0,-7,1,1,1,0,0\n", "bigwheel").unwrap_err();
    assert_eq!((error.line, error.column), (1, 7));
    let error = read("run1_od.txt", "9000 2 3 4\n1000 2 3 4\n", "ring8").unwrap_err();
    assert!(matches!(error.kind, LogErrorKind::Backwards { by, .. } if by == 8.0));
    let error = read("x.log", "Q 1 2 3\n", "wean").unwrap_err();
    assert!(error.to_string().contains("a line of the kinds `O`, `L`"), "{error}");
    assert!(matches!(read("run1.txt", "1 2\n", "ring8").unwrap_err().kind, LogErrorKind::Description(_)));
    assert!(matches!(read("run1_od.txt", "\n# nothing\n", "ring8").unwrap_err().kind, LogErrorKind::Empty));
    assert!(matches!(read("run1_od.txt", "1 2\0", "ring8").unwrap_err().kind, LogErrorKind::Binary));
}

#[test]
fn a_lenient_reader_skips_what_the_radio_broke() {
    let text = "L58F57R93t30\nF80R29t23\nL58F5\n# ready\nL58F9999R93t29\nel300er300cor-25t24\nel0er0cor0t500\n";
    let mut log = CsvReader::new("x", text.as_bytes(), &robot("zumo3"), true).unwrap();
    let entries: Vec<Entry> = log.by_ref().map(Result::unwrap).collect();
    assert_eq!(entries.len(), 4);
    assert_eq!(log.report().skipped_lines(), 2);
    let EntryKind::Odometry { odom_from_robot } = entries[3].kind else { panic!() };
    assert!((odom_from_robot.translation.x - 0.21).abs() < 1e-9); // 300 · 0.0014 m/s for half a second
}

#[test]
fn files_of_one_run_are_merged_with_the_odometry_first() {
    let inputs = vec![
        Input::new("run_sonar.txt", "1000 1 1 1 1 1 1 1 5110\n2000 1 1 1 1 1 1 1 1\n".as_bytes()),
        Input::new("a/run_od.txt", "1000 0 0 0\n2000 1000 0 900\n".as_bytes()),
    ];
    let options = ReadOptions { robot: Some(robot("ring8")), ..ReadOptions::default() };
    let entries = open_log(inputs, &options).unwrap().collect::<Result<Vec<_>, _>>().unwrap();
    let stamps: Vec<f64> = entries.iter().map(|entry| entry.stamp).collect();
    assert_eq!(stamps, [1.0, 1.0, 2.0, 2.0]);
    assert!(matches!(entries[0].kind, EntryKind::Odometry { .. }));
    let EntryKind::Odometry { odom_from_robot } = entries[2].kind else { panic!() };
    approx::assert_relative_eq!(odom_from_robot.rotation.angle(), std::f64::consts::FRAC_PI_2, epsilon = 1e-12);
    approx::assert_relative_eq!(odom_from_robot.translation.x, 1.0);
}

proptest! {
    #[test]
    fn random_rows_never_panic(
        rows in proptest::collection::vec(
            proptest::collection::vec(
                prop_oneof![
                    Just("1"), Just("0"), Just("-3"), Just("1e308"), Just("nan"), Just("o"), Just("l"), Just("E"), Just("S"), Just("B"),
                    Just("L"), Just("O"), Just("3/4"), Just("180/"), Just("90/1e400"), Just("9999999999"), Just("L5F6R7t8"), Just("é"), Just(""),
                ],
                0..12,
            ),
            0..10,
        ),
        separator in prop_oneof![Just(" "), Just(","), Just(";")],
    ) {
        let text = rows.iter().map(|row| row.join(separator)).collect::<Vec<_>>().join("\n");
        for robot in robots() {
            for file in ["run_od", "run_sonar", "x.cnt", "x.scn"] {
                if let Ok(log) = CsvReader::new(file, text.as_bytes(), robot, true) {
                    prop_assert!(log.flatten().all(|entry| entry.stamp.is_finite()));
                }
            }
        }
    }
}

//! The same figures as evo prints, where evo is installed.

use std::process::Command;

use crate::topogrid;

/// An ellipse, and a distorted, turned and moved version of every other pose of it.
fn paths(folder: &std::path::Path) {
    let line = |stamp: f64, x: f64, y: f64, heading: f64| {
        let (sin, cos) = (heading / 2.0).sin_cos();
        format!("{stamp:.6} {x:.9} {y:.9} 0 0 0 {sin:.12} {cos:.12}\n")
    };
    let (mut truth, mut estimate) = (String::new(), String::new());
    for k in 0..200 {
        let (stamp, a) = (0.5 * f64::from(k), 0.1 * f64::from(k));
        let (x, y) = (10.0 * a.cos(), 6.0 * a.sin());
        truth += &line(stamp, x, y, a);
        if k % 2 == 0 {
            let (x, y) = (1.02 * x + 0.3 * (3.0 * a).sin(), y + 0.2 * (5.0 * a).cos());
            let (sin, cos) = 0.3f64.sin_cos();
            let heading = a + 0.05 * (2.0 * a).sin() + 0.3;
            estimate += &line(stamp + 0.004, 5.0 + cos * x - sin * y, sin * x + cos * y - 2.0, heading);
        }
    }
    std::fs::write(folder.join("truth.tum"), truth).unwrap();
    std::fs::write(folder.join("estimate.tum"), estimate).unwrap();
}

/// The figures that a program of evo prints, `name value` per line; `None`, said aloud, where it is not installed.
fn evo(folder: &std::path::Path, program: &str, arguments: &[&str]) -> Option<Vec<(String, f64)>> {
    let mut command = Command::new(program);
    command.current_dir(folder).args(["tum", "truth.tum", "estimate.tum"]).args(arguments);
    let Ok(told) = command.output() else {
        eprintln!("skipped: {program} is not installed");
        return None;
    };
    let text = String::from_utf8_lossy(&told.stdout).into_owned();
    let figure = |line: &str| {
        let mut words = line.split_whitespace();
        Some((words.next()?.to_owned(), words.next()?.parse().ok()?))
    };
    Some(text.lines().filter_map(figure).collect())
}

#[test]
fn the_absolute_error_is_what_evo_prints() {
    let folder = tempfile::tempdir().unwrap();
    paths(folder.path());
    for (how, flags, part) in [
        ("rigid", &["-a"][..], "translation_m"),
        ("rigid", &["-a", "-r", "angle_deg"], "rotation_deg"),
        ("origin", &["--align_origin"], "translation_m"),
        ("none", &[], "translation_m"),
    ] {
        let Some(theirs) = evo(folder.path(), "evo_ape", flags) else { return };
        assert_eq!(theirs.len(), 7, "{theirs:?}");
        let mut command = topogrid();
        command.current_dir(folder.path());
        command.args(["evaluate", "estimate.tum", "--truth", "truth.tum", "--json", "--align", how]);
        let told = command.assert().code(0);
        let ours: serde_json::Value = serde_json::from_slice(&told.get_output().stdout).unwrap();
        for (name, value) in theirs {
            let own = ours["ate"][part][&name].as_f64().unwrap();
            assert!((own - value).abs() < 1.1e-6, "{how} {part} {name}: evo {value}, here {own}");
        }
    }
}

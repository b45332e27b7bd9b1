use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

use super::topogrid;

/// Everything that a run leaves behind.
const FILES: [&str; 11] = [
    "config.toml",
    "loops.csv",
    "map.pgm",
    "map.png",
    "map.yaml",
    "metrics.json",
    "odometry.tum",
    "session.hmap",
    "topology.g2o",
    "topology.svg",
    "trajectory.tum",
];

fn office_loop() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs/office_loop.log")
}

#[test]
fn the_demo_needs_no_input_and_fills_a_run_folder() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    let places = contains("places").and(contains("error of places"));
    topogrid().arg("demo").arg("-o").arg(&out).assert().success().stdout(places);
    for file in FILES {
        assert!(out.join(file).metadata().unwrap().len() > 0, "{file} is empty");
    }
    let yaml = std::fs::read_to_string(out.join("map.yaml")).unwrap();
    assert!(yaml.contains("image: map.pgm") && yaml.contains("free_thresh: 0.196"), "{yaml}");
}

#[test]
fn json_is_one_document_that_equals_the_metrics_file() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let run = topogrid().arg("run").arg(office_loop()).arg("-o").arg(&out).arg("--json").output().unwrap();
    let printed: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    let written: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("metrics.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    assert_eq!(printed["schema"], "topogrid/metrics/1");
    for key in ["log", "places", "links", "relaxation", "grid", "timings_s", "peak_memory_mib"] {
        assert!(!printed[key].is_null(), "{key} is missing");
    }
}

#[test]
fn a_run_never_overwrites_another() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("precious.txt"), "mine").unwrap();
    topogrid().arg("demo").arg("-o").arg(&out).assert().code(2).stderr(contains("another run"));
    topogrid().arg("demo").arg("-o").arg(&out).arg("--force").assert().success();
    assert_eq!(std::fs::read_to_string(out.join("precious.txt")).unwrap(), "mine");
}

#[test]
fn a_run_goes_on_from_its_session() {
    let folder = tempfile::tempdir().unwrap();
    let (one, two) = (folder.path().join("one"), folder.path().join("two"));
    topogrid().arg("demo").arg("-o").arg(&one).assert().success();
    // The rest of a log begins where the first part ended: stamps run on.
    let log = folder.path().join("rest.log");
    std::fs::write(&log, "ODOM 0 0 0 0 0 0 99999.0 h 99999.0\nODOM 0.5 0 0 0 0 0 99999.5 h 99999.5\n").unwrap();
    topogrid().arg("resume").arg(&one).arg(&log).arg("-o").arg(&two).assert().success().stdout(contains("142 places"));
    let damaged = folder.path().join("damaged.hmap");
    std::fs::write(&damaged, b"HMAP\x01\x00").unwrap();
    topogrid().arg("resume").arg(&damaged).arg(&log).assert().code(3).stderr(contains("cut off"));
}

#[test]
fn unknown_settings_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("my.toml");
    std::fs::write(&config, "[grid]\nresolutoin_m = 0.05\n").unwrap();
    topogrid().arg("demo").arg("--config").arg(&config).assert().code(3).stderr(contains("resolutoin_m"));
    topogrid().args(["demo", "--resolution", "0"]).assert().code(2).stderr(contains("resolution"));
}

#[test]
fn a_log_without_scans_is_refused_with_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("blind.log");
    std::fs::write(&log, "ODOM 0 0 0 0 0 0 1.0 h 1.0\nODOM 1 0 0 0 0 0 2.0 h 2.0\n").unwrap();
    let out = folder.path().join("out");
    topogrid().arg("run").arg(&log).arg("-o").arg(&out).assert().code(3).stderr(contains("no scan"));
    assert!(!out.exists(), "a run that failed leaves nothing behind");
}

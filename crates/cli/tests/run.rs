use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

use super::topogrid;

/// Everything that a run leaves behind.
const FILES: [&str; 15] = [
    "config.toml",
    "loops.csv",
    "map.pgm",
    "map.png",
    "map.yaml",
    "metrics.json",
    "nav2_route.geojson",
    "odometry.tum",
    "places.tmap2.yaml",
    "run.json",
    "session.hmap",
    "topology.g2o",
    "topology.geojson",
    "topology.svg",
    "trajectory.tum",
];

pub(crate) fn office_loop() -> std::path::PathBuf {
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
fn gates_are_set_on_the_figures_of_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let demo = |name: &str, gate: &str| {
        topogrid().arg("demo").arg("-o").arg(folder.path().join(name)).args(["--fail-on", gate]).assert()
    };
    demo("bad", "trust.place_sigma_worst_m>0.001").code(4).stderr(contains("the gate"));
    demo("typo", "truth.aftr_m>1.0").code(2).stderr(contains("no number `truth.aftr_m`"));
}

#[test]
fn a_dry_run_says_what_it_would_do_and_does_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let told = contains("office_loop.log").and(contains("places.spacing_m = 2.0")).and(contains("--set"));
    let dry = |log: &std::path::Path| {
        topogrid().arg("run").arg(log).args(["--dry-run", "--set", "places.spacing_m=2", "-o"]).arg(&out).assert()
    };
    dry(&office_loop()).success().stdout(told);
    dry(&folder.path().join("none.log")).code(3);
    assert!(!out.exists());
}

#[test]
fn a_part_of_a_log_can_be_mapped() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("part");
    topogrid().args(["demo", "--from", "100", "--until", "400", "-o"]).arg(&out).assert().success();
    let duration = crate::demo::metrics(&out)["log"]["duration_s"].as_f64().unwrap();
    assert!((200.0..=300.0).contains(&duration), "{duration} s");
}

#[test]
fn the_record_tells_how_a_run_came_about() {
    let run = crate::demo::run();
    let record: serde_json::Value = serde_json::from_slice(&std::fs::read(run.join("run.json")).unwrap()).unwrap();
    assert_eq!((&record["schema"], &record["complete"]), (&"topogrid/run/1".into(), &true.into()));
    assert_eq!(record["command"][0], "demo");
    let listed = record["outputs"].as_array().unwrap();
    assert!(listed.iter().any(|file| file["file"] == "layers/free.png"));
    let svg = listed.iter().find(|file| file["file"] == "topology.svg").unwrap();
    assert_eq!(svg["bytes"], run.join("topology.svg").metadata().unwrap().len());
    assert_eq!(svg["sha256"].as_str().unwrap().len(), 64);
}

/// Two processes, one log: the files are the same to the byte, but for times.
fn same_bytes(one: &std::path::Path, other: &std::path::Path) {
    let listed = |run: &std::path::Path| {
        let record: serde_json::Value = serde_json::from_slice(&std::fs::read(run.join("run.json")).unwrap()).unwrap();
        let mut outputs = record["outputs"].as_array().unwrap().clone();
        outputs.retain(|file| file["file"] != "metrics.json" && file["file"] != "report.html"); // they hold times
        outputs
    };
    assert_eq!(listed(one), listed(other));
    assert!(listed(one).len() > 15);
}

/// Terminal and JSON print from one struct: every number of the one stands in the other.
#[test]
fn the_last_screen_and_the_figures_agree() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("office");
    let told = topogrid().arg("demo").arg("-o").arg(&out).assert().success();
    same_bytes(&out, crate::demo::run());
    let text = String::from_utf8(told.get_output().stdout.clone()).unwrap();
    let metrics = crate::demo::metrics(&out);
    let number = |pointer: &str| metrics.pointer(pointer).and_then(serde_json::Value::as_f64).unwrap();
    let links = number("/links/traveled") + number("/links/recognized");
    let (grid, trust) = (&metrics["grid"], &metrics["trust"]);
    let (before, after) = (number("/trust/loop_residual_before_m"), number("/trust/loop_residual_after_m"));
    let expected = [
        format!("demo: {} places, {links} links, {} loops", metrics["places"], metrics["links"]["recognized"]),
        format!("{} × {} cells at {} m", grid["rows"], grid["columns"], grid["resolution_m"]),
        format!("{before:.2} m  {after:>6.2} m   worst"),
        format!("optimum {:.1}", number("/relaxation/energy_optimum")),
        format!("{:.2} m  {:>6.2} m   raw odometry", number("/truth/before_m"), number("/truth/after_m")),
        format!("worst P{} {:.2} m", trust["worst_place"], number("/trust/place_sigma_worst_m")),
        format!("{} loops refused", metrics["links"]["rejected"]),
        format!("P{}→P{}", trust["refused"][0]["place"], trust["refused"][0]["known"]),
        format!("{:.1} s (read", number("/timings_s/total")),
    ];
    for line in expected {
        assert!(text.contains(&line), "`{line}` is missing in\n{text}");
    }
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

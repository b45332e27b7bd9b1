//! What somebody does who meets the program for the first time, with a log and twenty minutes: each row is a test.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

use crate::{demo, topogrid};

fn log() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs/office_loop.log")
}

#[test]
fn minute_0_help_fits_a_screen_and_begins_with_the_demo() {
    let told = topogrid().assert().code(2);
    let text = String::from_utf8(told.get_output().stderr.clone()).unwrap();
    assert!(text.find("topogrid demo").unwrap() < text.find("Usage").unwrap(), "{text}");
    topogrid().arg("-h").assert().success().stdout(contains("topogrid demo"));
    let begun = Instant::now();
    topogrid().arg("--version").assert().success();
    assert!(begun.elapsed() < Duration::from_secs(2), "a start takes milliseconds; this bound is for busy machines");
}

#[test]
fn minute_1_the_demo_shows_what_it_made() {
    let svg = std::fs::read_to_string(demo::run().join("topology.svg")).unwrap();
    assert!(svg.contains("dead reckoning") && svg.contains("relaxed"));
    let metrics = demo::metrics(demo::run());
    assert!(metrics["timings_s"]["total"].as_f64().unwrap() < 60.0, "under ten seconds on a quiet machine");
    assert!(3.0 * metrics["truth"]["after_m"].as_f64().unwrap() < metrics["truth"]["before_m"].as_f64().unwrap());
}

#[test]
fn minute_3_a_run_needs_no_flags_and_says_what_it_chose() {
    let folder = tempfile::tempdir().unwrap();
    let told = topogrid().current_dir(folder.path()).arg("run").arg(log()).assert().success();
    let text = String::from_utf8(told.get_output().stdout.clone()).unwrap();
    let widest = text.lines().map(|line| line.chars().count()).max().unwrap();
    assert!(text.lines().count() <= 24 && widest <= 80, "{widest} wide\n{text}");
    assert!(
        text.contains("heading from compass") && text.contains("topogrid explain runs/office_loop --loops"),
        "{text}"
    );
    assert!(folder.path().join("runs/office_loop/map.yaml").exists());
}

#[test]
fn minute_5_the_map_loads_in_map_servers() {
    let yaml = std::fs::read_to_string(demo::run().join("map.yaml")).unwrap();
    for line in ["image: map.pgm", "negate: 0", "occupied_thresh: 0.65", "free_thresh: 0.196"] {
        assert!(yaml.contains(line), "{yaml}");
    }
    // And what map servers read is what was meant: the tests of exports read it with another reader.
    topogrid().arg("inspect").arg(demo::run().join("map.yaml")).assert().success();
}

#[test]
fn minute_6_a_finer_grid_needs_no_mapping() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("fine");
    let told =
        topogrid().arg("grid").arg(demo::run()).args(["--resolution", "0.05", "-o"]).arg(&out).assert().success();
    assert!(!String::from_utf8_lossy(&told.get_output().stderr).contains("topology"), "places are not sought again");
    let yaml = std::fs::read_to_string(out.join("map.yaml")).unwrap();
    assert!(yaml.contains("resolution: 0.05"), "{yaml}");
    let size = |run: &Path| -> Vec<u32> {
        let pgm = std::fs::read(run.join("map.pgm")).unwrap();
        let header = String::from_utf8_lossy(&pgm[..40]).into_owned();
        header.lines().nth(1).unwrap().split(' ').map(|number| number.parse().unwrap()).collect()
    };
    for (fine, coarse) in size(&out).into_iter().zip(size(demo::run())) {
        assert!(fine.abs_diff(2 * coarse) <= 2, "{fine} cells for {coarse}");
    }
}

#[test]
fn minute_7_loops_have_readable_reasons() {
    let text = demo::text(&["explain", demo::run().to_str().unwrap(), "--loops"]);
    assert!(text.contains("σ") && text.contains("views agree") && text.contains("refused"), "{text}");
}

#[test]
fn minute_8_the_route_graph_is_one_command() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("g.geojson");
    topogrid().arg("export").arg(demo::run()).args(["--to", "nav2-route", "-o"]).arg(&file).assert().success();
    let graph: serde_json::Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    assert_eq!(graph["type"], "FeatureCollection");
    assert_eq!(graph["features"][0]["properties"]["id"], 0);
}

#[test]
fn minute_9_a_broken_line_is_shown_with_field_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.log");
    let text = std::fs::read_to_string(log()).unwrap();
    let number = 1 + text.lines().position(|line| line.starts_with("ODOM")).unwrap();
    let lines = text.lines().enumerate().map(|(index, line)| {
        let words: Vec<&str> = line.split(' ').collect();
        if index + 1 == number { [&words[..3], &["O.1"], &words[4..]].concat().join(" ") } else { line.to_owned() }
    });
    std::fs::write(&broken, lines.collect::<Vec<_>>().join("\n")).unwrap();
    let place = format!("broken.log:{number}:");
    topogrid().arg("run").arg(&broken).arg("-o").arg(folder.path().join("out")).assert().code(3).stderr(
        contains("found `O.1`").and(contains(place)).and(contains("heading of the robot")).and(contains("--lenient")),
    );
}

#[test]
fn all_faults_of_a_log_are_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.log");
    let text = std::fs::read_to_string(log()).unwrap();
    let mut faults = 0;
    let spoilt = text.lines().map(|line| match line.split_once(' ') {
        Some(("ODOM", rest)) if faults < 14 => {
            faults += 1;
            if faults % 2 == 0 { format!("ODOM x{rest}\n") } else { "ODOM 1 2\n".to_owned() }
        }
        _ => format!("{line}\n"),
    });
    std::fs::write(&broken, spoilt.collect::<String>()).unwrap();
    let told = topogrid().arg("inspect").arg(&broken).assert().code(3).stdout("");
    let text = String::from_utf8(told.get_output().stderr.clone()).unwrap();
    assert_eq!(text.matches("broken.log:").count(), 10, "{text}");
    assert!(text.contains("and 4 more") && text.contains("in all"), "{text}");
    assert!(text.lines().count() <= 24, "{text}");
    let told =
        topogrid().arg("run").arg(&broken).args(["--json", "-o"]).arg(folder.path().join("out")).assert().code(3);
    let error: serde_json::Value = serde_json::from_slice(&told.get_output().stderr).unwrap();
    assert_eq!(error["error"]["others"].as_array().unwrap().len(), 9, "{error}");
    let kinds = error["error"]["kinds"].as_object().unwrap();
    assert_eq!(kinds.values().map(|count| count.as_u64().unwrap()).sum::<u64>(), 14, "{error}");
}

#[test]
fn minute_10_a_second_run_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let told = topogrid().arg("run").arg(log()).arg("--verify").arg("-o").arg(&out).assert().success();
    let text = String::from_utf8(told.get_output().stdout.clone()).unwrap();
    let verdict = text.lines().last().unwrap().trim();
    let (same, all) = verdict.strip_prefix("identical: ").unwrap().split_once(" of ").unwrap();
    assert_eq!(format!("{same} files"), all);
    assert!(same.parse::<usize>().unwrap() > 15);
    assert_eq!(text.lines().count(), text.lines().count().min(24), "{text}");
}

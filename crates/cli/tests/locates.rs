//! Finding a robot in a finished map.

use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use serde_json::Value;

use crate::{demo, topogrid};

/// The log that the program brings along.
const OFFICE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/logs/office_loop.log");

#[test]
fn a_robot_that_drives_the_same_way_again_is_told_on_one_screen_and_in_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("track.csv");
    let locate = || {
        let mut command = topogrid();
        command.arg("locate").arg(demo::run()).arg(OFFICE).arg("-o").arg(&table);
        command
    };
    let said = contains("at the end: place").and(contains("facing")).and(contains("first after"));
    let one_screen = predicates::function::function(|text: &str| text.lines().count() <= 24);
    locate().assert().success().stdout(said.and(one_screen));

    let text = std::fs::read_to_string(&table).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0].join(","), "stamp_s,driven_m,state,x_m,y_m,heading_rad,place,probability");
    assert!(rows.len() > 100 && rows.iter().all(|row| row.len() == 8), "{text}");
    for row in &rows[1..] {
        assert_eq!(row[2] == "known", row[3].parse::<f64>().is_ok(), "{row:?}");
    }
    locate().assert().code(2).stderr(contains("--force"));
}

#[test]
fn programs_are_told_of_every_place() {
    let told = topogrid().arg("locate").arg(demo::run()).arg(OFFICE).arg("--json").assert().success();
    let told: Value = serde_json::from_slice(&told.get_output().stdout).unwrap();
    assert_eq!(told["schema"], "topogrid/locate/1");
    let views = told["views"].as_array().unwrap();
    let is_known = |view: &&Value| view["state"] == "known" && view["pose"]["x_m"].is_number();
    let known = views.iter().filter(is_known).count();
    assert!(2 * known > views.len(), "known at {known} of {} places", views.len());
    assert_eq!(told["summary"]["known_places"], known);
    assert!(told["summary"]["known_m"].as_f64().unwrap() < told["summary"]["driven_m"].as_f64().unwrap());
}

#[test]
fn a_run_without_a_map_is_told() {
    let nowhere = std::env::temp_dir();
    topogrid().arg("locate").arg(nowhere).arg(OFFICE).assert().code(3).stderr(contains("session.hmap"));
}

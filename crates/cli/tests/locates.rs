//! Finding a robot in a finished map.

use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use serde_json::Value;

use crate::{demo, topogrid};

/// The log that the program brings along.
const OFFICE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/logs/office_loop.log");

#[test]
fn a_robot_that_drives_the_same_way_again_is_found() {
    let said = contains("at the end: place").and(contains("facing"));
    topogrid().arg("locate").arg(demo::run()).arg(OFFICE).assert().success().stdout(said);
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
}

#[test]
fn a_run_without_a_map_is_told() {
    let nowhere = std::env::temp_dir();
    topogrid().arg("locate").arg(nowhere).arg(OFFICE).assert().code(3).stderr(contains("session.hmap"));
}

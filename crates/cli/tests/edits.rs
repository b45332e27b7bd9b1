use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

use crate::{demo, topogrid};

#[test]
fn an_edit_redraws_the_run_and_undo_brings_every_byte_back() {
    let (_folder, run) = demo::copy();
    let read = |file: &str| std::fs::read(run.join(file)).unwrap();
    let files = ["session.hmap", "map.pgm", "topology.g2o", "nav2_route.geojson", "loops.csv", "trajectory.tum"];
    let before = files.map(read);
    let told = demo::json(&["explain", run.to_str().unwrap()]);
    let story = told["loops"].as_array().unwrap().iter().find(|story| story["accepted"] == true).unwrap();
    let pair = format!("{}-{}", story["place"], story["known"]);
    let edit = |arguments: &[&str]| topogrid().arg("edit").arg(&run).args(arguments).assert();
    edit(&["drop-link", &pair]).success().stdout(contains("1  drop the links between")).stderr(contains("redrawn"));
    edit(&["pin", "P50", "--at", "-3.0,2.5"]).success().stdout(contains("2  pin P50 at (-3.00, 2.50)"));
    edit(&["name", "P12", "kitchen"]).success();
    let after = files.map(read);
    assert!(before[0] == after[0], "the session stays as it was recorded");
    for (index, file) in files.iter().enumerate().skip(1) {
        assert!(before[index] != after[index], "{file} must follow");
    }
    assert!(String::from_utf8_lossy(&after[3]).contains("\"name\":\"kitchen\""));
    assert!(String::from_utf8_lossy(&after[4]).contains("dropped; "));
    topogrid().arg("explain").arg(&run).args(["--place", "kitchen"]).assert().success().stdout(contains("P12 kitchen"));
    topogrid().arg("explain").arg(&run).args(["--place", "kitchn"]).assert().code(2).stderr(contains("`kitchen`"));
    edit(&["list"]).success().stdout(contains("3  name P12 `kitchen`"));
    edit(&["undo", "1"]).success();
    edit(&["undo"]).success();
    edit(&["undo"]).success().stdout("no edits\n");
    assert!(!run.join("edits.toml").exists());
    for (index, file) in files.iter().enumerate() {
        assert!(before[index] == read(file), "{file} must be as before");
    }
    edit(&["undo"]).code(2).stderr(contains("holds 0"));
}

#[test]
fn edits_that_do_not_fit_change_nothing() {
    let (_folder, run) = demo::copy();
    let edit = |arguments: &[&str]| topogrid().arg("edit").arg(&run).args(arguments).assert();
    edit(&["drop-link", "0-141"]).code(2).stderr(contains("no link joins").and(contains("P0 is joined to")));
    edit(&["pin", "P0", "--at", "1,1"]).code(2).stderr(contains("origin"));
    edit(&["pin", "P1", "--at", "1;1"]).code(2).stderr(contains("two numbers"));
    assert!(!run.join("edits.toml").exists());
    std::fs::write(run.join("edits.toml"), "[[edit]]\ndo = \"nmae\"\n").unwrap();
    topogrid().arg("explain").arg(&run).assert().code(3).stderr(contains("edits.toml"));
}

#[test]
fn edits_go_along_when_a_run_is_extended() {
    let (folder, run) = demo::copy();
    topogrid().arg("edit").arg(&run).args(["--no-redraw", "name", "P12", "kitchen"]).assert().success();
    let (log, longer) = (folder.path().join("rest.log"), folder.path().join("longer"));
    std::fs::write(&log, "ODOM 0 0 0 0 0 0 99999.0 h 99999.0\nODOM 0.5 0 0 0 0 0 99999.5 h 99999.5\n").unwrap();
    topogrid().arg("resume").arg(&run).arg(&log).arg("-o").arg(&longer).assert().success();
    assert!(std::fs::read_to_string(longer.join("nav2_route.geojson")).unwrap().contains("\"name\":\"kitchen\""));
    let list = demo::text(&["edit", longer.to_str().unwrap(), "list"]);
    assert_eq!(list, "  1  name P12 `kitchen`\n");
}

use predicates::prelude::*;
use predicates::str::contains;

use crate::topogrid;

/// A map of two rooms of 4 × 4 m with a door of 0.9 m between them, at 0.1 m per pixel, and its description.
fn map() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let (columns, rows) = (90, 44);
    let mut image = format!("P5\n{columns} {rows}\n255\n").into_bytes();
    for row in 0..rows {
        for column in 0..columns {
            let room = (2..42).contains(&row) && ((2..42).contains(&column) || (44..84).contains(&column));
            let door = (18..27).contains(&row) && (42..44).contains(&column);
            image.push(if room || door { 254 } else { 0 });
        }
    }
    std::fs::write(folder.path().join("map.pgm"), image).unwrap();
    let yaml = folder.path().join("map.yaml");
    let text = "image: map.pgm\nresolution: 0.1\norigin: [-2.0, 1.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    std::fs::write(&yaml, text).unwrap();
    (folder, yaml)
}

#[test]
fn rooms_are_found_named_written_and_remembered() {
    let (folder, yaml) = map();
    let out = folder.path().join("out");
    let wrote = contains("kitchen").and(contains("1-2")).and(contains("labels.png"));
    topogrid()
        .arg("regions")
        .arg(&yaml)
        .arg("--out")
        .arg(&out)
        .args(["--name", "2=kitchen"])
        .assert()
        .code(0)
        .stdout(wrote);
    let text = std::fs::read_to_string(out.join("regions.geojson")).unwrap();
    let document: serde_json::Value = serde_json::from_str(&text).unwrap();
    let features = document["features"].as_array().unwrap();
    assert_eq!(features.len(), 3);
    assert_eq!(features[2]["properties"]["regions"], serde_json::json!([1, 2]));
    let corner = &features[0]["geometry"]["coordinates"][0][0];
    assert!(corner[0].as_f64().unwrap() >= -1.9 && corner[1].as_f64().unwrap() >= 1.1, "in the map frame: {corner}");
    // Again, without the name: it stays. Without --force nothing is replaced.
    topogrid().arg("regions").arg(&yaml).arg("--out").arg(&out).assert().code(2).stderr(contains("--force"));
    topogrid()
        .arg("regions")
        .arg(folder.path())
        .arg("--out")
        .arg(&out)
        .arg("--force")
        .assert()
        .code(0)
        .stdout(contains("kitchen"));
}

#[test]
fn the_document_holds_regions_and_gateways() {
    let (_folder, yaml) = map();
    let told = topogrid().arg("regions").arg(&yaml).arg("--json").assert().code(0);
    let document: serde_json::Value = serde_json::from_slice(&told.get_output().stdout).unwrap();
    assert_eq!(document["regions"].as_array().unwrap().len(), 2);
    let width = document["gateways"][0]["width"].as_f64().unwrap();
    assert!((width - 0.9).abs() < 0.15, "{width}");
}

#[test]
fn wrong_arguments_say_what_is_expected() {
    let (folder, yaml) = map();
    topogrid().arg("regions").arg("plan.png").assert().code(2).stderr(contains("--resolution"));
    topogrid()
        .arg("regions")
        .arg(&yaml)
        .args(["--name", "9=hall"])
        .assert()
        .code(2)
        .stderr(contains("the regions are 1 to 2"));
    topogrid().arg("regions").arg(&yaml).args(["--name", "hall"]).assert().code(2).stderr(contains("LABEL=NAME"));
    let broken = folder.path().join("broken.png");
    std::fs::write(&broken, "no picture").unwrap();
    topogrid()
        .arg("regions")
        .arg(&broken)
        .args(["--resolution", "0.05"])
        .assert()
        .code(3)
        .stderr(contains("broken.png"));
}

#[test]
fn a_run_keeps_names_and_closed_gateways_in_its_session() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("demo");
    topogrid().arg("demo").arg("-o").arg(&run).assert().success();
    let regions = || {
        let mut command = topogrid();
        command.arg("regions").arg(&run);
        command
    };
    regions().args(["--name", "2=kitchen", "--close", "0"]).assert().success().stdout(contains("kitchen"));
    regions().args(["--close", "99"]).assert().code(2).stderr(contains("the gateways are 0 to"));
    let told = regions().arg("--json").assert().success();
    let document: serde_json::Value = serde_json::from_slice(&told.get_output().stdout).unwrap();
    assert_eq!(document["regions"][1]["name"], "kitchen");
    assert_eq!(document["gateways"][0]["blocked"], true);
    let places = document["places"].as_array().unwrap();
    assert!(places.iter().map(|of| of.as_array().unwrap().len()).sum::<usize>() > 100);
    let written = std::fs::read_to_string(run.join("regions.geojson")).unwrap();
    assert!(written.contains("kitchen") && written.contains("\"blocked\":true"));
    regions().args(["--open", "0"]).assert().success().stdout(contains("kitchen"));
    let told = regions().arg("--json").assert().success();
    assert!(!String::from_utf8_lossy(&told.get_output().stdout).contains("\"blocked\": true"));

    // A name given to an edited map stays when the edit is taken back, and the session holds what was recorded.
    let edit = |arguments: &[&str]| drop(topogrid().arg("edit").arg(&run).args(arguments).assert().success());
    edit(&["pin", "P5", "--at", "3,1", "--sigma", "0.5"]);
    // The largest region is the same in both maps; small ones may be cut otherwise where the pin bends the map.
    let told = regions().arg("--json").assert().success();
    let bent: serde_json::Value = serde_json::from_slice(&told.get_output().stdout).unwrap();
    let area = |region: &&serde_json::Value| region["area"].as_f64().unwrap();
    let all = bent["regions"].as_array().unwrap().iter();
    let largest = all.max_by(|a, b| area(a).total_cmp(&area(b))).unwrap();
    regions().args(["--name", &format!("{}=lobby", largest["label"])]).assert().success();
    edit(&["undo"]);
    regions().assert().success().stdout(contains("lobby").and(contains("kitchen")));

    // Another run through the building takes the names over, and keeps them by itself from then on.
    let again = folder.path().join("again");
    topogrid().arg("demo").arg("-o").arg(&again).assert().success();
    let named = || contains("lobby").and(contains("kitchen"));
    topogrid().arg("regions").arg(&again).assert().success().stdout(named().not());
    topogrid().arg("regions").arg(&again).arg("--names-of").arg(&run).assert().success().stdout(named());
    topogrid().arg("regions").arg(&again).assert().success().stdout(named());
    let picture = topogrid().arg("regions").arg(again.join("map.yaml")).arg("--names-of").arg(&run).assert();
    picture.code(2).stderr(contains("is no run"));
}

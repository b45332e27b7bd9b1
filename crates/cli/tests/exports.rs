use std::path::Path;
use std::process::Command;

use predicates::str::contains;
use serde_json::Value;

use crate::{demo, topogrid};

/// What another program's reader sees in a file; `None`, said plainly, where the reader is not installed.
fn read(format: &str, file: &Path) -> Option<Value> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (script, own) = (here.join("tests/readers.py"), here.join("../../target/readers/bin/python")); // see .ci/setup
    let python = if own.exists() { own } else { "python3".into() };
    let Ok(told) = Command::new(python).arg(script).arg(format).arg(file).output() else {
        println!("skipped: python3 is not installed");
        return None;
    };
    let text = String::from_utf8_lossy(&told.stdout);
    if told.status.code() == Some(77) {
        println!("{}", text.trim());
        return None;
    }
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    Some(serde_json::from_str(&text).unwrap())
}

#[test]
fn evo_reads_both_paths() {
    let log = &demo::metrics(demo::run())["log"];
    for file in ["trajectory.tum", "odometry.tum"] {
        let Some(seen) = read("tum", &demo::run().join(file)) else { return };
        assert_eq!(seen["poses"], log["scans"], "{file}");
        let (length, driven) = (seen["length_m"].as_f64().unwrap(), log["path_length_m"].as_f64().unwrap());
        assert!((length / driven - 1.0).abs() < 0.2, "{file}: {length} m of {driven} m");
    }
}

#[test]
fn geojson_readers_see_every_place_and_link() {
    let metrics = demo::metrics(demo::run());
    if let Some(seen) = read("geojson", &demo::run().join("topology.geojson")) {
        assert_eq!(seen["points"], metrics["places"]);
        let links = metrics["links"]["traveled"].as_u64().unwrap() + metrics["links"]["recognized"].as_u64().unwrap();
        assert_eq!(seen["lines"].as_u64(), Some(links));
    }
    if let Some(seen) = read("geojson", &demo::run().join("regions.geojson")) {
        assert!(seen["features"].as_u64().unwrap() > 0);
    }
}

#[test]
fn the_route_server_finds_every_node_and_both_directions() {
    let Some(seen) = read("nav2", &demo::run().join("nav2_route.geojson")) else { return };
    // A loop driven twice: spots that were recognised are one node.
    let (nodes, places) = (seen["nodes"].as_u64().unwrap(), demo::metrics(demo::run())["places"].as_u64().unwrap());
    assert!(nodes < places && nodes > places / 2, "{nodes} of {places}");
    assert!(seen["edges"].as_u64().unwrap() >= 2 * (nodes - 1));
    if let Some(valid) = read("geojson", &demo::run().join("nav2_route.geojson")) {
        assert_eq!((&valid["points"], &valid["lines"]), (&seen["nodes"], &seen["edges"]));
    }
}

#[test]
fn topological_navigation_finds_what_its_schema_asks_for() {
    let Some(seen) = read("tmap2", &demo::run().join("places.tmap2.yaml")) else { return };
    if let Some(route) = read("nav2", &demo::run().join("nav2_route.geojson")) {
        assert_eq!((&seen["nodes"], &seen["edges"]), (&route["nodes"], &route["edges"]));
    }
}

#[test]
fn gtsam_finds_the_same_energy_in_the_graph() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("poses");
    // Without a compass headings are unknown as well, and the graph is one of poses; a loop closed by hand strains it.
    topogrid().args(["demo", "--heading", "odometry", "-o"]).arg(&out).assert().success();
    topogrid().arg("edit").arg(&out).args(["add-link", "88-0", "--by", "0,0"]).assert().success();
    let Some(seen) = read("g2o", &out.join("topology.g2o")) else { return };
    let metrics = demo::metrics(&out);
    let links = metrics["links"]["traveled"].as_u64().unwrap() + metrics["links"]["recognized"].as_u64().unwrap();
    assert_eq!((&seen["poses"], seen["edges"].as_u64()), (&metrics["places"], Some(links)));
    let (theirs, ours) = (seen["chi2"].as_f64().unwrap(), metrics["relaxation"]["energy_after"].as_f64().unwrap());
    assert!(ours > 1.0 && (theirs / ours - 1.0).abs() < 0.02, "{theirs} and {ours}");
}

#[test]
fn networkx_finds_a_connected_graph() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("office.dot");
    topogrid().arg("export").arg(demo::run()).arg(&file).assert().success().stderr(contains("wrote"));
    let Some(seen) = read("dot", &file) else { return };
    assert_eq!(seen["nodes"], demo::metrics(demo::run())["places"]);
    assert_eq!(seen["connected"], true);
}

#[test]
fn mcap_readers_find_the_path_and_the_places() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["one.mcap", "two.mcap"].map(|name| folder.path().join(name));
    for file in &files {
        topogrid().arg("export").arg(demo::run()).arg(file).assert().success();
    }
    assert!(std::fs::read(&files[0]).unwrap() == std::fs::read(&files[1]).unwrap(), "the same run, the same bytes");
    let Some(seen) = read("mcap", &files[0]) else { return };
    let metrics = demo::metrics(demo::run());
    assert_eq!(seen["places"], metrics["places"]);
    assert_eq!(seen["counts"]["/trajectory"], metrics["log"]["scans"]);
    assert_eq!(seen["counts"]["/odometry"], metrics["log"]["scans"]);
}

#[test]
fn a_map_server_keeps_unknown_cells_unknown() {
    let Some(seen) = read("map_server", &demo::run().join("map.yaml")) else { return };
    let grid = &demo::metrics(demo::run())["grid"];
    assert_eq!((&seen["rows"], &seen["columns"]), (&grid["rows"], &grid["columns"]));
    assert!(seen["unknown"].as_u64() >= grid["unexplored"].as_u64(), "{seen} of {grid}");
    assert!(seen["free"].as_u64().unwrap() > 1000 && seen["occupied"].as_u64().unwrap() > 100);
}

#[test]
fn formats_follow_from_names_and_go_to_standard_output() {
    let (folder, run) = (tempfile::tempdir().unwrap(), demo::run());
    let names = ["a.tmap2.yaml", "a.g2o", "a.geojson", "a.svg", "a.csv", "a.tum", "nav2_route.geojson"];
    let files = names.map(|name| folder.path().join(name));
    topogrid().arg("export").arg(run).args(&files).assert().success();
    for (ours, theirs) in [("a.g2o", "topology.g2o"), ("a.tum", "trajectory.tum"), ("a.svg", "topology.svg")] {
        assert_eq!(
            std::fs::read(folder.path().join(ours)).unwrap(),
            std::fs::read(run.join(theirs)).unwrap(),
            "{ours}"
        );
    }
    let table = std::fs::read_to_string(folder.path().join("a.csv")).unwrap();
    assert_eq!(table.lines().count(), 143);
    let told = topogrid().arg("export").arg(run).args(["--to", "nav2-route"]).assert().success().stderr("");
    assert!(told.get_output().stdout == std::fs::read(run.join("nav2_route.geojson")).unwrap());
    topogrid().arg("export").arg(run).arg("a.xyz").assert().code(2).stderr(contains("--to"));
    topogrid().arg("export").arg(run).assert().code(2).stderr(contains("nothing to write"));
    topogrid().arg("export").arg(run).arg(&files[1]).assert().code(1).stderr(contains("--force"));
    topogrid().arg("export").arg(folder.path()).arg("a.g2o").assert().code(3).stderr(contains("session.hmap"));
}

#[test]
fn ways_gone_seldom_can_be_left_out_and_frames_named() {
    let run = demo::run().to_str().unwrap();
    let lines = |arguments: &[&str]| {
        let text = demo::text(&[&["export", run, "--to", "nav2-route"], arguments].concat());
        (text.matches("MultiLineString").count(), text.contains("\"frame\":\"world\""))
    };
    let (all, driven) = (lines(&[]).0, lines(&["--min-traversals", "1"]).0);
    assert!(driven < all && driven > all / 2, "{driven} of {all}");
    assert!(lines(&["--same-spot", "0"]).0 > all);
    assert!(lines(&["--frame", "world"]).1);
}

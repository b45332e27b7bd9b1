use predicates::prelude::*;
use predicates::str::contains;

use crate::{LOG, folder, topogrid};

#[test]
fn a_log_is_described_in_words_and_in_json() {
    let (_folder, log) = folder();
    topogrid().arg("inspect").arg(&log).assert().code(0).stdout(
        contains("3 entries in 5 lines, 1.5 s")
            .and(contains("path 5.0 m, box 3.0 × 4.0 m"))
            .and(contains("`flaser`: 2 scans of 3 beams"))
            .and(contains("healthy")),
    );
    let told = topogrid().arg("inspect").arg(&log).arg("--json").assert().code(0);
    let document: serde_json::Value = serde_json::from_slice(&told.get_output().stdout).unwrap();
    assert_eq!(document["log"]["scans"], 2);
    assert_eq!(document["log"]["path_length_m"], 5.0);
    assert_eq!(document["log"]["sensors"][0]["no_echoes"], 1);
    assert_eq!(document["passed_over"]["PARAM"], 1);
}

#[test]
fn standard_input_and_several_files_are_read() {
    let (folder, log) = folder();
    topogrid().args(["inspect", "-"]).write_stdin(LOG).assert().code(0).stdout(contains("3 entries"));
    let second = folder.path().join("second.log");
    std::fs::write(&second, "ODOM 9 9 0 0 0 0 1.2 h 1\n").unwrap();
    topogrid().arg("inspect").arg(&log).arg(&second).assert().code(0).stdout(contains("4 entries"));
}

#[test]
fn an_unhealthy_log_is_told_and_rejected_when_strict() {
    let (_folder, log) = folder();
    std::fs::write(&log, "ODOM 0 0 0 0 0 0 1 h 1\nODOM 90 0 0 0 0 0 1.1 h 1\n").unwrap();
    topogrid()
        .arg("inspect")
        .arg(&log)
        .assert()
        .code(0)
        .stdout(contains("leaps by 90.00 m").and(contains("not healthy")));
    topogrid().arg("inspect").arg(&log).arg("--strict").assert().code(3);
}

#[test]
fn a_graph_is_described() {
    let (folder, _log) = folder();
    let graph = folder.path().join("small.g2o");
    std::fs::write(&graph, "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n").unwrap();
    topogrid()
        .arg("inspect")
        .arg(&graph)
        .assert()
        .code(0)
        .stdout(contains("2 vertices and 1 edges").and(contains("healthy")));
    std::fs::write(&graph, "VERTEX_SE2 0 0 x 0\n").unwrap();
    topogrid().arg("inspect").arg(&graph).assert().code(3).stderr(contains("line 1"));
}

#[test]
fn a_table_of_numbers_needs_the_name_of_its_robot() {
    let (folder, _log) = folder();
    let table = folder.path().join("garden.csv");
    std::fs::write(&table, "2,2,51,72,89,10,60,472,496\n14,16,52,64,95,10,60,469,497\n").unwrap();
    topogrid().arg("inspect").arg(&table).assert().code(3).stderr(contains("--robot"));
    topogrid().arg("inspect").arg(&table).args(["--robot", "bigwheel"]).assert().code(0).stdout(contains("`infrared`"));
    topogrid().arg("inspect").arg(&table).args(["--robot", "bigweel"]).assert().code(2).stderr(contains("bigwheel"));
    let robot = folder.path().join("robot.toml");
    std::fs::write(&robot, "name = \"x\"\ncolour = 3\ntable = []\n").unwrap();
    topogrid().arg("inspect").arg(&table).arg("--robot").arg(&robot).assert().code(3).stderr(contains("colour"));
}

#[test]
fn several_files_of_a_described_robot_become_one_log() {
    let (folder, _log) = folder();
    let (od, sonar, out) =
        (folder.path().join("r_od.txt"), folder.path().join("r_sonar.txt"), folder.path().join("r.log"));
    std::fs::write(&od, "1000 0 0 0\n2000 500 0 0\n").unwrap();
    std::fs::write(&sonar, "1000 1 1 900 1 1 1 1 5110\n2000 1 1 900 1 1 1 1 5110\n").unwrap();
    topogrid().arg("convert").args([&sonar, &od, &out]).args(["--robot", "ring8"]).assert().code(0);
    topogrid().arg("inspect").arg(&out).assert().code(0).stdout(contains("4 entries").and(contains("path 0.5 m")));
}

#[test]
fn a_map_is_described_and_its_trap_is_named() {
    let (folder, _log) = folder();
    let yaml = folder.path().join("map.yaml");
    let mut image = b"P5\n20 10\n255\n".to_vec();
    image.extend((0..200).map(|cell| if cell % 20 == 3 { 0u8 } else { 254 }));
    std::fs::write(folder.path().join("map.pgm"), &image).unwrap();
    let text = |free: &str| {
        format!(
            "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: {free}\n"
        )
    };
    std::fs::write(&yaml, text("0.196")).unwrap();
    let said = contains("20 × 10 cells").and(contains("1.9 m² free")).and(contains("walls 0.100 m thick"));
    topogrid().arg("inspect").arg(&yaml).assert().code(0).stdout(said.and(contains("\nhealthy")));
    std::fs::write(&yaml, text("0.25")).unwrap();
    topogrid().arg("inspect").arg(&yaml).arg("--strict").assert().code(3).stdout(contains("free_thresh 0.25"));
}

#[test]
fn a_log_of_tagged_lines_needs_the_name_of_its_robot() {
    let (_folder, log) = folder();
    std::fs::write(&log, "O 1 2 3 0.5\nL 1 2 3\n").unwrap();
    topogrid().arg("inspect").arg(&log).assert().code(3).stderr(contains("only `L`, `O`").and(contains("--robot")));
}

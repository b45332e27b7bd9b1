use predicates::prelude::*;
use predicates::str::contains;

use crate::{LOG, folder, topogrid};

#[test]
fn wrong_usage_ends_with_2_and_a_suggestion() {
    topogrid().arg("inspekt").assert().code(2).stderr(contains("inspect"));
    topogrid().assert().code(2).stderr(contains("Usage"));
    topogrid().args(["inspect", "--laser-max", "-3", "x"]).assert().code(2);
    topogrid().arg("--version").assert().code(0).stdout(contains("topogrid"));
}

#[test]
fn a_faulty_line_is_shown_with_its_place_and_a_way_out() {
    let (_folder, log) = folder();
    std::fs::write(&log, LOG.replace("3.1 4 0", "3.1 4,0 0")).unwrap();
    topogrid().arg("inspect").arg(&log).assert().code(3).stdout("").stderr(
        contains("found `4,0`").and(contains("office.log:5:26]")).and(contains("╰──")).and(contains("--lenient")),
    );
    let told = topogrid().arg("inspect").arg(&log).arg("--json").assert().code(3).stdout("");
    let document: serde_json::Value = serde_json::from_slice(&told.get_output().stderr).unwrap();
    assert_eq!(document["error"]["code"], "log.field");
    assert_eq!((document["error"]["line"].as_u64(), document["error"]["column"].as_u64()), (Some(5), Some(26)));
    assert_eq!(document["error"]["found"], "4,0");
    topogrid().arg("inspect").arg(&log).arg("--lenient").assert().code(0).stderr(contains("left out"));
}

#[test]
fn a_format_that_nobody_knows_is_to_be_described_instead_of_left_out() {
    let (_folder, log) = folder();
    std::fs::write(&log, "o;1.0;0;0\nl;1.1;88/202\n").unwrap();
    topogrid().arg("inspect").arg(&log).assert().code(3).stderr(contains("--robot").and(contains("--lenient").not()));
    let lenient = topogrid().arg("inspect").arg(&log).arg("--lenient").assert().code(3);
    lenient.stderr(contains("none of its 2 lines can be read").and(contains("--robot")));
}

#[test]
fn what_cannot_be_read_is_rejected_with_3() {
    let (folder, log) = folder();
    topogrid().arg("inspect").arg(folder.path()).assert().code(3).stderr(contains("is a directory"));
    topogrid().arg("inspect").arg(folder.path().join("none.log")).assert().code(3).stderr(contains("could not read"));
    std::fs::write(&log, "").unwrap();
    topogrid().arg("inspect").arg(&log).assert().code(3).stderr(contains("holds no entry"));
    std::fs::write(&log, [0u8, 159, 146, 150]).unwrap();
    topogrid().arg("inspect").arg(&log).assert().code(3).stderr(contains("binary file"));
    std::fs::write(&log, [0x1f, 0x8b, 8, 0, 0]).unwrap();
    topogrid().arg("inspect").arg(&log).assert().code(3).stderr(contains("gzip data is cut short"));
}

#[test]
fn color_is_used_only_when_asked_for() {
    let error = |color: &str| {
        let told = topogrid().args(["inspect", "none.log", "--color", color]).assert().code(3);
        String::from_utf8(told.get_output().stderr.clone()).unwrap()
    };
    assert!(error("always").contains('\u{1b}'));
    assert!(!error("never").contains('\u{1b}'));
    assert!(!error("auto").contains('\u{1b}'), "standard error of a test is no terminal");
}

#[test]
fn progress_is_silent_in_a_pipe_unless_asked_for() {
    let (_folder, log) = folder();
    topogrid().arg("inspect").arg(&log).assert().code(0).stderr("");
    topogrid()
        .arg("inspect")
        .arg(&log)
        .args(["--progress", "plain"])
        .assert()
        .code(0)
        .stderr(contains("reading: 100 %"));
    let told = topogrid().arg("inspect").arg(&log).args(["--progress", "json"]).assert().code(0);
    let line: serde_json::Value = serde_json::from_slice(&told.get_output().stderr).unwrap();
    assert_eq!(line["stage"], "reading");
    topogrid().arg("-q").arg("inspect").arg(&log).args(["--progress", "plain"]).assert().code(0).stderr("");
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_is_no_failure() {
    use std::process::{Command, Stdio};
    let (_folder, log) = folder();
    std::fs::write(&log, LOG.lines().nth(2).unwrap().to_owned() + "\n").unwrap();
    let many = format!("{}\n", LOG.lines().nth(3).unwrap()).repeat(50_000);
    std::fs::write(&log, many).unwrap();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("topogrid"))
        .args(["convert", log.to_str().unwrap(), "-"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let out = child.wait_with_output().unwrap();
    assert_eq!(out.status.code(), Some(0));
    assert_eq!(String::from_utf8_lossy(&out.stderr), "");
}

#[test]
fn a_quiet_run_says_nothing_but_errors() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let told = topogrid().args(["demo", "-q", "-o"]).arg(&out).assert().success();
    assert!(told.get_output().stdout.is_empty() && told.get_output().stderr.is_empty());
    assert!(out.join("map.yaml").exists());
    topogrid().args(["demo", "-q", "-o"]).arg(&out).assert().code(2).stderr(predicates::str::contains("--force"));
}

#[test]
fn programs_are_told_of_wrong_usage_as_json() {
    let told = topogrid().args(["plan", "somewhere", "--json"]).assert().code(2).stdout("");
    let error: serde_json::Value = serde_json::from_slice(&told.get_output().stderr).unwrap();
    assert_eq!(error["error"]["code"], "usage");
    assert!(error["error"]["message"].as_str().unwrap().contains("--from"), "{error}");
    topogrid().args(["plan", "--help", "--json"]).assert().code(0);
}

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use predicates::str::contains;

use crate::{demo, topogrid};

const LOG: &str = include_str!("../../../fixtures/logs/office_loop.log");

/// The program reading the first half of the bundled log from a pipe that stays open.
fn halfway(out: &Path) -> Child {
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("topogrid"))
        .args(["run", "-", "--checkpoint", "20", "-o"])
        .arg(out)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let half = LOG.len() / 2 + LOG[LOG.len() / 2..].find('\n').unwrap() + 1;
    child.stdin.as_mut().unwrap().write_all(&LOG.as_bytes()[..half]).unwrap();
    // A checkpoint shows that the program is at work, and listens.
    while !out.join("run.json").exists() {
        std::thread::yield_now();
        assert!(child.try_wait().unwrap().is_none(), "it must not end by itself");
    }
    child
}

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

#[test]
fn ctrl_c_keeps_the_map_and_resume_ends_it() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("office");
    let mut child = halfway(&out);
    interrupt(&child);
    // Whatever comes next wakes the program up; it may have left by then.
    let half = LOG.len() / 2 + LOG[LOG.len() / 2..].find('\n').unwrap() + 1;
    let _ = child.stdin.take().unwrap().write_all(&LOG.as_bytes()[half..]);
    let mut told = String::new();
    child.stderr.take().unwrap().read_to_string(&mut told).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{told}");
    assert!(told.contains("the map so far is kept") && told.contains("resume with: topogrid resume"), "{told}");
    topogrid().arg("resume").arg(&out).assert().code(2).stderr(contains("standard input, which is gone"));
    let log = folder.path().join("office.log");
    std::fs::write(&log, LOG).unwrap();
    topogrid().arg("resume").arg(&out).arg(&log).args(["--force", "-o"]).arg(&out).assert().success();
    // Not to be told from a run that nobody interrupted, but for names and times.
    let (whole, resumed) = (demo::metrics(demo::run()), demo::metrics(&out));
    for key in ["log", "places", "links", "relaxation", "trust", "grid", "regions", "truth"] {
        assert_eq!(whole[key], resumed[key], "{key}");
    }
    let bytes = |run: &Path, file: &str| std::fs::read(run.join(file)).unwrap();
    for file in ["session.hmap", "map.pgm", "map.png", "topology.g2o", "loops.csv", "trajectory.tum", "regions.geojson"]
    {
        assert!(bytes(demo::run(), file) == bytes(&out, file), "{file}");
    }
    topogrid().arg("resume").arg(&out).assert().code(2).stderr(contains("complete"));
}

#[test]
fn resume_without_a_log_opens_the_one_that_the_run_was_interrupted_in() {
    let folder = tempfile::tempdir().unwrap();
    let (out, log) = (folder.path().join("office"), folder.path().join("office.log"));
    let mut child = halfway(&out);
    interrupt(&child);
    drop(child.stdin.take()); // wakes it up, if it has not left by then
    assert_eq!(child.wait().unwrap().code(), Some(130));
    // The same, had the log been a file: a pipe is what a test can hold half open.
    std::fs::write(&log, LOG).unwrap();
    let path = out.join("run.json");
    let mut record: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!((&record["command"][1], &record["complete"]), (&"-".into(), &false.into()));
    record["command"][1] = log.to_str().unwrap().into();
    std::fs::write(&path, record.to_string()).unwrap();
    topogrid().arg("resume").arg(&out).assert().success();
    assert_eq!(demo::metrics(&out)["log"]["entries"], demo::metrics(demo::run())["log"]["entries"]);
    let record: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!(record["complete"], true);
}

#[test]
fn ctrl_c_twice_stops_at_once_and_the_checkpoint_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("office");
    let mut child = halfway(&out);
    // The pipe stays open and silent, so that the first signal cannot be acted on.
    interrupt(&child);
    while child.try_wait().unwrap().is_none() {
        interrupt(&child);
        std::thread::yield_now();
    }
    assert_eq!(child.wait().unwrap().code(), Some(130));
    topogrid().arg("explain").arg(&out).assert().success();
}

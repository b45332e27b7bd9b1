use predicates::str::contains;

use crate::{LOG, folder, topogrid};

#[test]
fn a_log_becomes_a_trajectory() {
    let (folder, log) = folder();
    let out = folder.path().join("odometry.tum");
    topogrid().arg("convert").arg(&log).arg(&out).assert().code(0);
    let text = std::fs::read_to_string(&out).unwrap();
    assert_eq!(text.lines().count(), 3);
    assert_eq!(text.lines().last().unwrap(), "2.500000 3.000000 4.000000 0 0 0 0.000000000 1.000000000");
    topogrid().arg("convert").arg(&log).arg(&out).assert().code(1).stderr(contains("--force"));
    topogrid().arg("convert").arg(&log).arg(&out).arg("--force").assert().code(0);
}

#[test]
fn converting_a_log_twice_changes_nothing() {
    let (folder, log) = folder();
    let (once, twice) = (folder.path().join("once.log"), folder.path().join("twice.log"));
    topogrid().arg("convert").arg(&log).arg(&once).assert().code(0);
    topogrid().arg("convert").arg(&once).arg(&twice).assert().code(0);
    assert_eq!(std::fs::read(&once).unwrap(), std::fs::read(&twice).unwrap());
}

#[test]
fn a_log_that_breaks_off_leaves_no_file() {
    let (folder, log) = folder();
    std::fs::write(&log, LOG.to_owned() + "ODOM 1 2\n").unwrap();
    let out = folder.path().join("out.log");
    topogrid().arg("convert").arg(&log).arg(&out).assert().code(3).stderr(contains("office.log:6"));
    assert!(!out.exists());
    topogrid().arg("convert").arg(&log).arg(folder.path().join("out.xyz")).assert().code(2);
    topogrid().arg("convert").arg(&log).arg("/nonexistent/out.log").arg("--lenient").assert().code(1);
}

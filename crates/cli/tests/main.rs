//! The program as its users meet it: arguments in, text and exit codes out.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up must fail")]
#![expect(clippy::print_stdout, reason = "a skipped test says so")]

mod browser;
mod convert;
mod demo;
mod edits;
mod evaluate;
mod evo;
mod explains;
mod exports;
mod first_ten_minutes;
mod gridmaps;
mod inspect;
#[cfg(unix)]
mod interruption;
mod live;
mod locates;
mod manners;
mod palette;
mod readme;
mod regions;
mod relax;
mod report;
mod run;
mod settings;
mod simulate;

use assert_cmd::Command;

/// The program, ready for arguments.
fn topogrid() -> Command {
    Command::cargo_bin("topogrid").unwrap()
}

/// A short log: two scans and an odometry line.
const LOG: &str = "# a comment\nPARAM robot_width 0.4 nohost 0\nODOM 0 0 0 0 0 0 1.0 h 1.0\n\
    FLASER 3 1.0 2.0 81.83 0.1 0 0 0 0 0 1.5 h 1.5\nFLASER 3 1.0 2.0 3.0 3.1 4 0 3 4 0 2.5 h 2.5\n";

/// A folder with the log in it.
fn folder() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("office.log");
    std::fs::write(&log, LOG).unwrap();
    (folder, log)
}

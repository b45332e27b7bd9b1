//! Any bytes, read as a log of any kind: `cargo +nightly fuzz run open_log` in the crate's folder.
//!
//! The first byte chooses the robot whose tables the rest may be, and whether faulty lines are left out.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use robot_log::{CarmenOptions, Input, ReadOptions, RobotDescription, open_log};

fuzz_target!(|bytes: &[u8]| {
    let Some((choice, bytes)) = bytes.split_first() else { return };
    let carmen = CarmenOptions { lenient: choice & 1 == 1, ..CarmenOptions::default() };
    let robot = RobotDescription::builtin_names().nth(usize::from(choice >> 1)).and_then(RobotDescription::builtin);
    let Ok(log) = open_log(vec![Input::new("x", Cursor::new(bytes.to_vec()))], &ReadOptions { carmen, robot }) else {
        return;
    };
    let mut latest = f64::NEG_INFINITY;
    for entry in log.map_while(Result::ok) {
        assert!(entry.stamp >= latest, "entries must be in order");
        latest = entry.stamp;
    }
});

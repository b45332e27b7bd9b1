//! Behaviour of the log readers and writers.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot set itself up must fail, and one that is skipped says so"
)]

mod any_bytes;
mod carmen;
mod csv;
mod damage;
mod described;
mod recorded;
mod round_trip;
mod rsf;

use std::path::PathBuf;

use robot_log::{CarmenOptions, CarmenReader, Entry, LogError};

/// All entries of a CARMEN text.
fn read(text: &str) -> Result<Vec<Entry>, LogError> {
    CarmenReader::new("test.log", text.as_bytes(), CarmenOptions::default())?.collect()
}

/// A recorded log beside the workspace, or `None` (said aloud) where it is not there.
fn recorded(path: &str) -> Option<PathBuf> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(path);
    if !file.exists() {
        println!("skipped: {path} not present");
        return None;
    }
    Some(file)
}

//! A map is stored, read back, and goes on with more log.
//!
//! `cargo run -p hierarchy --example 02_stored_session -- fixtures/sessions/v1.hmap` makes the stored session that the
//! tests read for ever.
#![expect(clippy::print_stdout, reason = "an example says what it found")]

use std::fs::File;
use std::io::{BufReader, BufWriter};

use hierarchy::{Config, Mapper};
use robot_log::{CarmenOptions, CarmenReader, Entry};

/// So many entries make a session of a few places.
const FIRST: usize = 300;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/logs/office_loop.log");
    let log = CarmenReader::new(path, BufReader::new(File::open(path)?), CarmenOptions::default())?;
    let entries: Vec<Entry> = log.collect::<Result<_, _>>()?;

    let mut mapper = Mapper::new(Config::default())?;
    for entry in &entries[..FIRST] {
        mapper.push(entry)?;
    }
    let mut session = Vec::new();
    mapper.save(&mut session)?;
    println!("{} places in {} bytes", mapper.topology().n_visited(), session.len());
    if let Some(path) = std::env::args().nth(1) {
        mapper.save(&mut BufWriter::new(File::create(path)?))?;
    }

    let mut resumed = Mapper::load(&mut session.as_slice())?;
    for entry in &entries[FIRST..] {
        resumed.push(entry)?;
    }
    resumed.finish()?;
    println!("{} places after the rest of the log", resumed.topology().n_visited());
    Ok(())
}

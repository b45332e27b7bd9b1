//! A CARMEN log goes in; a topological map with consistent coordinates and a gridmap come out.
//!
//! `cargo run --release -p hierarchy --example 01_log_to_map -- LOG MAP.png`
#![expect(clippy::print_stdout, reason = "an example says what it found")]

use std::fs::File;
use std::io::{BufReader, BufWriter};

use hierarchy::{Config, Event, Mapper};
use robot_log::{CarmenOptions, CarmenReader};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let log = arguments.next().unwrap_or_else(|| "fixtures/logs/office_loop.log".into());
    let mut mapper = Mapper::new(Config::default())?;
    let reader = BufReader::new(File::open(&log)?);
    for entry in CarmenReader::new(log.as_str(), reader, CarmenOptions::default())? {
        for event in mapper.push(&entry?)? {
            if let Event::PlaceRecognized { place, known, .. } = event {
                println!("{place} is {known}");
            }
        }
    }
    mapper.finish()?;
    println!("{} places, {} links", mapper.topology().places().len(), mapper.topology().links().len());
    if let Some(picture) = arguments.next() {
        global_grid::write_picture(&mapper.gridmap()?, BufWriter::new(File::create(picture)?))?;
    }
    Ok(())
}

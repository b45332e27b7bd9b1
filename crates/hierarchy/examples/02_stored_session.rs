//! A map is stored with the name of a room, read back, and goes on with more log.
//!
//! `cargo run -p hierarchy --example 02_stored_session -- fixtures/sessions/v6` makes the stored session that the tests read
//! for ever, `v6.hmap`, and what it holds, `v6.csv`.
#![expect(clippy::print_stdout, reason = "an example says what it found")]

use std::fs::File;
use std::io::{BufReader, BufWriter};

use hierarchy::{Config, Mapper, Passage};
use robot_log::{CarmenOptions, CarmenReader, Entry};

/// So many entries show the first corridors.
const FIRST: usize = 2500;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/logs/office_loop.log");
    let log = CarmenReader::new(path, BufReader::new(File::open(path)?), CarmenOptions::default())?;
    let entries: Vec<Entry> = log.collect::<Result<_, _>>()?;

    let mut mapper = Mapper::new(Config::default())?;
    for entry in &entries[..FIRST] {
        mapper.push(entry)?;
    }
    let gridmap = mapper.gridmap()?;
    let mut regions = mapper.survey(&gridmap)?;
    mapper.name_region(&mut regions, 1, "hall")?;
    mapper.set_passage(&mut regions, 0, Passage::Closed);
    let mut session = Vec::new();
    mapper.save(&mut session)?;
    let (places, found) = (mapper.topology().n_visited(), regions.regions.len());
    println!("{places} places and {found} regions in {} bytes", session.len());
    if let Some(path) = std::env::args().nth(1) {
        mapper.save(&mut BufWriter::new(File::create(format!("{path}.hmap"))?))?;
        std::fs::write(format!("{path}.csv"), held(&mapper))?;
    }

    let mut resumed = Mapper::load(&mut session.as_slice())?;
    for entry in &entries[FIRST..] {
        resumed.push(entry)?;
    }
    resumed.finish()?;
    let regions = resumed.survey(&resumed.gridmap()?)?;
    let places = resumed.topology().n_visited();
    println!("{places} places and {} regions after the rest of the log", regions.regions.len());
    println!("the hall is region {:?}", regions.find("hall").map(|region| region.label));
    Ok(())
}

/// Counts of links, closures and samples, then the position of every place in metres.
fn held(mapper: &Mapper) -> String {
    let (links, closures) = (mapper.topology().links().len(), mapper.closures().len());
    let counts = format!(
        "links,closures,samples; x,y of each place\n{links},{closures},{}\n",
        mapper.trajectory().samples().len()
    );
    let places = mapper.coordinates().positions().into_iter().map(|place| format!("{},{}\n", place.x, place.y));
    std::iter::once(counts).chain(places).collect()
}

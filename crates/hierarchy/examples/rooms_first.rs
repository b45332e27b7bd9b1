//! What finishing a room before leaving it saves of the way, seed by seed.
//!
//! ```text
//! cargo run --release -p hierarchy --example rooms_first -- WORLD.toml FIRST LAST [RELUCTANCE]
//! ```
//!
//! A simulated Nomad 200 explores the world twice for each seed from FIRST to LAST: whatever is nearest first, and with
//! whatever lies outside of the room in which it is RELUCTANCE metres (4) farther away. Compared are the ways of the seeds
//! for which both covered the floor.
#![expect(clippy::print_stdout, reason = "an example says what it found")]

mod explored;

use explored::{Explored, explore, truth};
use hierarchy::evaluate::Statistics;
use hierarchy::topo_map::ExplorerOptions;
use hierarchy::{Config, Exploration};
use nalgebra::Point2;
use simulator::{RobotDescription, World};

type Failure = Box<dyn std::error::Error>;

/// The floor is covered if so much of it lies within a metre of a place.
const COVERED: f64 = 0.95;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, first, last, reluctance @ ..] = arguments.as_slice() else {
        return Err("usage: rooms_first WORLD.toml FIRST LAST [RELUCTANCE]".into());
    };
    let world = World::from_plan(&std::fs::read_to_string(path)?)?;
    let reluctance = reluctance.first().map_or(Ok(4.0), |metres| metres.parse::<f64>())?;
    println!("seed  nearest first  room first  difference, m (coverage where it is less than {COVERED})");
    let mut differences = Vec::new();
    for seed in first.parse::<u64>()?..=last.parse::<u64>()? {
        let plain = Exploration::new(Config::default(), ExplorerOptions::default())?;
        let rooms = Exploration::new(Config::default(), ExplorerOptions::default())?.rooms_first(reluctance)?;
        let [(plain, plainly), (rooms, by_rooms)] =
            [driven_and_covered(&world, seed, plain)?, driven_and_covered(&world, seed, rooms)?];
        let both = plainly >= COVERED && by_rooms >= COVERED;
        let left = if both { String::new() } else { format!("  ({plainly:.2}, {by_rooms:.2})") };
        println!("{seed:>4} {plain:>14.0} {rooms:>11.0} {:>11.0}{left}", rooms - plain);
        differences.extend(both.then_some(rooms - plain));
    }
    if let Some(of) = Statistics::of(&differences) {
        println!(
            "{} seeds compared: {:+.0} m in the mean, {:+.0} m in the median",
            differences.len(),
            of.mean,
            of.median
        );
    }
    Ok(())
}

/// The metres driven by an exploration, and the share of the floor that it covered.
fn driven_and_covered(world: &World, seed: u64, exploration: Exploration) -> Result<(f64, f64), Failure> {
    let robot = RobotDescription::nomad200();
    let Explored { exploration, entries, driven } = explore(world, &robot, seed, exploration)?;
    let truth = truth(&entries);
    let anchors = exploration.mapper().trajectory().anchors().iter();
    let places: Vec<Point2<f64>> =
        anchors.filter_map(|anchor| Some(truth.at(anchor.stamp)?.translation.vector.into())).collect();
    Ok((driven, world.coverage(&places, robot.radius + robot.margin, 1.0)))
}

//! What finishing a neighbourhood before leaving it saves of the way, seed by seed.
//!
//! ```text
//! cargo run --release -p hierarchy --example finished_first -- WORLD.toml FIRST LAST [METRES]
//! ```
//!
//! A simulated Nomad 200 explores the world twice for each seed from FIRST to LAST:
//! whatever is nearest first, and with all that is left within METRES (the explorer's own) before anything farther.
//! Compared are the ways of the seeds for which both covered the floor.
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
    let [path, first, last, metres @ ..] = arguments.as_slice() else {
        return Err("usage: finished_first WORLD.toml FIRST LAST [METRES]".into());
    };
    let world = World::from_plan(&std::fs::read_to_string(path)?)?;
    let finishing = match metres.first() {
        Some(metres) => ExplorerOptions { neighbourhood: metres.parse()?, ..ExplorerOptions::default() },
        None => ExplorerOptions::default(),
    };
    let nearest = ExplorerOptions { neighbourhood: 0.0, ..finishing.clone() };
    println!("seed  nearest first  finished first  difference, m (places; coverage)");
    let mut differences = Vec::new();
    for seed in first.parse::<u64>()?..=last.parse::<u64>()? {
        let [plain, finished] = [driven(&world, seed, nearest.clone())?, driven(&world, seed, finishing.clone())?];
        let difference = finished.metres - plain.metres;
        println!(
            "{seed:>4} {:>14.0} {:>15.0} {difference:>11.0}  ({}, {}; {:.2}, {:.2})",
            plain.metres, finished.metres, plain.places, finished.places, plain.covered, finished.covered
        );
        differences.extend((plain.covered >= COVERED && finished.covered >= COVERED).then_some(difference));
    }
    if let Some(of) = Statistics::of(&differences) {
        let (mean, median) = (of.mean, of.median);
        println!("{} seeds compared: {mean:+.0} m in the mean, {median:+.0} m in the median", differences.len());
    }
    Ok(())
}

/// What became of an exploration.
struct Driven {
    metres: f64,
    places: usize,
    /// The share of the floor that it covered.
    covered: f64,
}

fn driven(world: &World, seed: u64, options: ExplorerOptions) -> Result<Driven, Failure> {
    let robot = RobotDescription::nomad200();
    let exploration = Exploration::new(Config::default(), options)?;
    let Explored { exploration, entries, driven } = explore(world, &robot, seed, exploration)?;
    let truth = truth(&entries);
    let anchors = exploration.mapper().trajectory().anchors().iter();
    let places: Vec<Point2<f64>> =
        anchors.filter_map(|anchor| Some(truth.at(anchor.stamp)?.translation.vector.into())).collect();
    let covered = world.coverage(&places, robot.radius + robot.margin, 1.0);
    Ok(Driven { metres: driven, places: exploration.mapper().topology().n_visited(), covered })
}

//! Whether all rooms and doors of a building are found in the gridmap that the robot itself built, seed by seed.
//!
//! ```text
//! cargo run --release -p hierarchy --example rooms_found -- WORLD.toml FIRST LAST [PICTURES]
//! ```
//!
//! A simulated Nomad 200 explores the world once for each seed from FIRST to LAST. Judged is the map that it has when it
//! stops, and the one that is built once more from its log alone, as `topogrid run` does. The truth is the world's plan:
//! what hangs together with all doors shut is a room, if the robot can get into it, and an open door between two rooms is a
//! door. A room is found where a region has more than half of their floor in common with it, a door where a gateway within
//! a metre joins the regions of its two rooms (`x`, or `s` where it is believed to be shut). The names of rooms are carried
//! from each seed's map to the next one's. PICTURES is a folder for pictures of all regions.
#![expect(clippy::print_stdout, reason = "an example says what it found")]

#[path = "../explored/mod.rs"]
mod explored;
mod score;
mod truth;

use std::fs::File;
use std::path::Path;

use explored::{Explored, explore};
use hierarchy::topo_map::ExplorerOptions;
use hierarchy::{Config, Exploration, Mapper};
use nalgebra::Isometry2;
use region_map::{RegionMap, carry_names, lay_over};
use robot_log::Entry;
use robot_log::local_grid::FuzzyGrid;
use score::{Score, truth_from_map};
use simulator::{RobotDescription, World};
use truth::Rooms;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, first, last, pictures @ ..] = arguments.as_slice() else {
        return Err("usage: rooms_found WORLD.toml FIRST LAST [PICTURES]".into());
    };
    let (first, last) = (first.parse::<u64>()?, last.parse::<u64>()?);
    let plan = std::fs::read_to_string(path)?;
    let (world, robot) = (World::from_plan(&plan)?, RobotDescription::nomad200());
    let rooms = Rooms::of(&plan, robot.radius)?;
    println!("{}: {} rooms, {} doors", world.name(), rooms.count, rooms.doors.len());
    println!("seed map       regions gateways  doors  agreement of the rooms");
    let mut tally = [[0; 2]; 2];
    let (mut before, mut names): ([Option<(RegionMap, Score)>; 2], _) = ([None, None], [[0; 3]; 2]);
    for seed in first..=last {
        let exploration = Exploration::new(Config::default(), ExplorerOptions::default())?;
        let Explored { exploration, entries, driven } = explore(&world, &robot, seed, exploration)?;
        println!("{seed:>4} driven {driven:>9.0} m");
        for (kind, mapper) in [exploration.into_mapper(), mapped(&entries)?].iter_mut().enumerate() {
            let name = format!("{seed:>4} {}", ["explored", "from log"][kind]);
            let (gridmap, map, score) = judge(mapper, &rooms, &entries)?;
            report(&name, &map, &score);
            tally[kind][0] += usize::from(score.is_complete());
            tally[kind][1] += score.doors.iter().flatten().count();
            if let Some((old, found)) = &before[kind] {
                let counted = names_carried((old, found), (&map, &score));
                names[kind].iter_mut().zip(counted).for_each(|(sum, count)| *sum += count);
            }
            if let Some(folder) = pictures.first() {
                let file = Path::new(folder).join(format!("{}.png", name.trim().replace(' ', "-")));
                region_map::export::write_picture(
                    &mut File::create(file)?,
                    &map,
                    &hierarchy::floor(&gridmap, &mapper.poses()),
                )?;
            }
            before[kind] = Some((map, score));
        }
    }
    for ((name, [complete, doors]), [right, wrong, all]) in ["explored", "from log"].into_iter().zip(tally).zip(names) {
        let seeds = usize::try_from(last + 1 - first)?;
        println!("{name}: complete {complete} of {seeds}, doors {doors} of {}", seeds * rooms.doors.len());
        println!("{name}: names of the seed before: {right} of {all} at their rooms, {wrong} at others");
    }
    Ok(())
}

/// The map that is built from a log alone.
fn mapped(entries: &[Entry]) -> Result<Mapper, Failure> {
    let mut mapper = Mapper::new(Config::default())?;
    for entry in entries {
        mapper.push(entry)?;
    }
    mapper.finish()?;
    Ok(mapper)
}

fn judge(mapper: &mut Mapper, rooms: &Rooms, entries: &[Entry]) -> Result<(FuzzyGrid, RegionMap, Score), Failure> {
    let gridmap = mapper.gridmap()?;
    let map = mapper.survey(&gridmap)?;
    let truth_from_map: Isometry2<f64> = truth_from_map(mapper, &explored::truth(entries))?;
    let score = Score::of(rooms, &gridmap, &map, &truth_from_map);
    Ok((gridmap, map, score))
}

/// Names the rooms found in the map of another seed, lays the
/// new map over it and carries the names over: how many come to their own rooms, how many to others, of those whose rooms both maps have.
fn names_carried((old, found): (&RegionMap, &Score), (map, score): (&RegionMap, &Score)) -> [usize; 3] {
    let (mut old, mut new) = (old.clone(), map.clone());
    for (room, (label, _)) in found.rooms.iter().enumerate() {
        // The label was found in this map.
        let _ = label.map(|label| old.name(label, format!("room {room}")));
    }
    let Some(old_from_new) = lay_over(&old, &new) else { return [0; 3] };
    carry_names(&old, &mut new, &old_from_new);
    let mut counted = [0; 3];
    for (room, ((before, _), (now, _))) in found.rooms.iter().zip(&score.rooms).enumerate() {
        let name = format!("room {room}");
        let carried = new.find(&name).map(|region| region.label);
        if let (Some(_), Some(now)) = (before, now) {
            counted[0] += usize::from(carried == Some(*now));
            counted[1] += usize::from(carried.is_some_and(|label| label != *now));
            counted[2] += 1;
        }
    }
    counted
}

fn report(name: &str, map: &RegionMap, score: &Score) {
    let sign = |door: &Option<bool>| match door {
        Some(false) => 'x',
        Some(true) => 's',
        None => '-',
    };
    let doors: String = score.doors.iter().map(sign).collect();
    let rooms: Vec<String> = score.rooms.iter().map(|(_, share)| format!("{share:.2}")).collect();
    let verdict = if score.is_complete() { "complete" } else { "" };
    let (regions, gateways) = (map.regions.len(), map.gateways.len());
    println!("{name:13} {regions:>8} {gateways:>8}  {doors}  {}  {verdict}", rooms.join(" "));
}

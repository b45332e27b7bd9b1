//! What a world's plan says of its rooms and doors.

use std::collections::VecDeque;

use nalgebra::{Point2, Vector2, center};
use robot_log::local_grid::{Grid, GridFrame};
use serde::Deserialize;
use simulator::{Ground, World};

use crate::Failure;

/// Rooms and doors of a world that a robot can get to, in the map frame.
pub(crate) struct Rooms {
    /// The number of the room that each cell belongs to, from 1; 0 for none.
    pub(crate) labels: Grid<u16>,
    /// So many rooms there are.
    pub(crate) count: u16,
    pub(crate) doors: Vec<Door>,
}

/// An open door between two rooms.
pub(crate) struct Door {
    pub(crate) rooms: [u16; 2],
    pub(crate) center: Point2<f64>,
}

/// Of a plan only what is needed here.
#[derive(Deserialize)]
struct Plan {
    #[serde(default)]
    door: Vec<PlanDoor>,
}

#[derive(Deserialize)]
struct PlanDoor {
    from: [f64; 2],
    to: [f64; 2],
    #[serde(default = "yes")]
    open: bool,
}

fn yes() -> bool {
    true
}

/// Metres of a cell of the truth.
const CELL: f64 = 0.05;
/// A room of which the robot's centre can reach less than this, in square metres, cannot be entered.
const ENTERED: f64 = 0.5;
/// A room lies on each side of a door within this distance, in metres.
const BESIDE: f64 = 0.3;

impl Rooms {
    /// Shuts all doors and clears away what stands about: what then hangs together is one room.
    pub(crate) fn of(plan: &str, radius: f64) -> Result<Self, Failure> {
        let doors = toml::from_str::<Plan>(plan)?.door;
        let (world, shut) = (World::from_plan(plan)?, World::from_plan(&bare_and_shut(plan)?)?);
        let (low, high) = world.bounds();
        let frame = GridFrame::covering(low, high, CELL)?;
        let (mut labels, mut sizes) = (pieces(&shut.ground(frame)), Vec::new());
        let reachable = world.reachable(frame, radius);
        for (label, _) in labels.cells().iter().zip(reachable.cells()).filter(|(_, reached)| **reached) {
            sizes.resize(sizes.len().max(usize::from(*label) + 1), 0.0);
            sizes[usize::from(*label)] += CELL * CELL;
        }
        let mut count = 0;
        let mut names = vec![0; usize::from(u16::MAX) + 1];
        for label in (1..sizes.len()).filter(|label| sizes[*label] >= ENTERED) {
            count += 1;
            names[label] = count;
        }
        labels.cells_mut().iter_mut().for_each(|label| *label = names[usize::from(*label)]);
        let door = |door: &PlanDoor| {
            let [from, to] = [door.from, door.to].map(|end| world.map_from_plan() * Point2::from(end));
            let (center, along) = (center(&from, &to), (to - from).normalize());
            let aside = Vector2::new(-along.y, along.x) * BESIDE;
            let mut rooms = [center + aside, center - aside].map(|at| labels.at(at).copied().unwrap_or(0));
            rooms.sort_unstable();
            (rooms[0] > 0 && rooms[0] != rooms[1]).then_some(Door { rooms, center })
        };
        let doors = doors.iter().filter(|door| door.open).filter_map(door).collect();
        Ok(Self { labels, count, doors })
    }
}

/// The same plan with all doors shut, and without furniture or anything that moves.
fn bare_and_shut(plan: &str) -> Result<String, Failure> {
    let mut plan: toml::Table = toml::from_str(plan)?;
    plan.remove("furniture");
    plan.remove("mover");
    let doors = plan.get_mut("door").and_then(toml::Value::as_array_mut);
    for door in doors.into_iter().flatten().filter_map(toml::Value::as_table_mut) {
        door.insert("open".into(), toml::Value::Boolean(false));
    }
    Ok(toml::to_string(&plan)?)
}

/// Numbers what hangs together between the surfaces; the outside of the building is a piece as any other.
fn pieces(ground: &Grid<Ground>) -> Grid<u16> {
    let frame = *ground.frame();
    let mut labels = Grid::<u16>::new(frame);
    let mut next = 0;
    for seed in 0..frame.n_cells() {
        let free =
            |index: usize, labels: &Grid<u16>| ground.cells()[index] != Ground::Surface && labels.cells()[index] == 0;
        if !free(seed, &labels) {
            continue;
        }
        next += 1;
        labels.cells_mut()[seed] = next;
        let mut queue = VecDeque::from([seed]);
        while let Some(at) = queue.pop_front() {
            let (row, column) = (at / frame.columns(), at % frame.columns());
            let around =
                [(row.wrapping_sub(1), column), (row + 1, column), (row, column.wrapping_sub(1)), (row, column + 1)];
            for to in around.into_iter().filter_map(|(row, column)| frame.index(row, column)) {
                if free(to, &labels) {
                    labels.cells_mut()[to] = next;
                    queue.push_back(to);
                }
            }
        }
    }
    labels
}

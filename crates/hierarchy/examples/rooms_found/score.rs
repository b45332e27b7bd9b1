//! Whether the rooms and doors of a world are found in the gridmap that a robot built.

use hierarchy::Mapper;
use hierarchy::evaluate::{TimedPath, align};
use nalgebra::{Isometry2, Point2};
use region_map::{Gateway, RegionMap};
use robot_log::local_grid::FuzzyGrid;

use crate::Failure;
use crate::truth::Rooms;

/// What was found of a world.
pub(crate) struct Score {
    /// The region found for each room, and how well the two agree; no label where none agrees.
    pub(crate) rooms: Vec<(Option<u16>, f64)>,
    /// Whether each door that is found is believed to be shut.
    pub(crate) doors: Vec<Option<bool>>,
}

/// A region agrees with a room if their floor has more than this in common, as a share of the floor of both: of two regions
/// only one can.
const AGREE: f64 = 0.5;
/// A gateway is a door if its middle is so near, in metres.
const NEAR: f64 = 1.0;
/// Floor has been seen where the map is at least this empty.
const SEEN: f32 = 0.3;

impl Score {
    /// Judges regions by the rooms; `truth_from_map` lays the map onto the world. Of a room only the floor counts that was
    /// seen.
    pub(crate) fn of(rooms: &Rooms, gridmap: &FuzzyGrid, map: &RegionMap, truth_from_map: &Isometry2<f64>) -> Self {
        let frame = gridmap.frame();
        let (n_rooms, n_regions) = (usize::from(rooms.count) + 1, map.regions.len() + 1);
        let (mut of_room, mut of_region) = (vec![0.0; n_rooms], vec![0.0; n_regions]);
        let mut common = vec![vec![0.0; n_regions]; n_rooms];
        for (index, (cell, &label)) in gridmap.cells().iter().zip(map.labels.cells()).enumerate() {
            let at = truth_from_map * frame.center(index / frame.columns(), index % frame.columns());
            let room = rooms.labels.at(at).copied().unwrap_or(0);
            if label > 0 || cell.empty > SEEN {
                of_room[usize::from(room)] += 1.0;
                of_region[usize::from(label)] += 1.0;
                common[usize::from(room)][usize::from(label)] += 1.0;
            }
        }
        let agreement = |room: usize, region: usize| {
            let both: f64 = common[room][region];
            both / (of_room[room] + of_region[region] - both).max(1.0)
        };
        let best = |room: usize| {
            let best = (1..n_regions).max_by(|a, b| agreement(room, *a).total_cmp(&agreement(room, *b)));
            let share = best.map_or(0.0, |region| agreement(room, region));
            (best.filter(|_| share > AGREE).and_then(|region| u16::try_from(region).ok()), share)
        };
        let found: Vec<(Option<u16>, f64)> = (1..n_rooms).map(best).collect();
        let door = |door: &crate::truth::Door| {
            let sides = door.rooms.map(|room| found[usize::from(room) - 1].0);
            let is_door = |gateway: &&Gateway| {
                let [a, b] = gateway.regions.map(Some);
                (truth_from_map * gateway.center - door.center).norm() < NEAR && (sides == [a, b] || sides == [b, a])
            };
            map.gateways.iter().find(is_door).map(|gateway| gateway.blocked)
        };
        let doors = rooms.doors.iter().map(door).collect();
        Self { rooms: found, doors }
    }

    /// Whether every room and every door is found.
    pub(crate) fn is_complete(&self) -> bool {
        self.rooms.iter().all(|(region, _)| region.is_some()) && self.doors.iter().all(Option::is_some)
    }
}

/// How the map of a run lies in the world: by where the robot really was at each of its scans.
pub(crate) fn truth_from_map(mapper: &Mapper, truth: &TimedPath) -> Result<Isometry2<f64>, Failure> {
    let samples = mapper.trajectory().samples().iter().zip(mapper.poses());
    let spot = |pose: Isometry2<f64>| Point2::from(pose.translation.vector);
    let (estimate, reference): (Vec<_>, Vec<_>) =
        samples.filter_map(|(sample, pose)| Some((spot(pose), spot(truth.at(sample.stamp)?)))).unzip();
    Ok(align(&estimate, &reference).ok_or("the robot recorded nothing")?.reference_from_estimate)
}

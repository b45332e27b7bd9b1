//! A mapper that was stored and goes on.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Isometry2;
use robot_log::local_grid::{FrameError, Signature};
use topo_map::{Link, PlaceId, PlaceState};

use super::carry::CarryWatch;
use super::{Mapper, MapperError, first_since};
use crate::config::Config;
use crate::coordinates::Coordinates;
use crate::coordinates::directions::HeldHeading;
use crate::front_end::eyes::Eyes;
use crate::front_end::tracker::Tracker;
use crate::front_end::{FrontEnd, Taught};
use crate::mapper::tally::Tally;
use crate::query::floor_plan::FloorPlan;
use crate::recognize::proposals::{Proposal, Proposals};
use crate::recognize::sight::Sight;
use crate::recognize::{Closure, Recognizer, View};
use crate::session::records::topology;
use crate::trajectory::Trajectory;

/// What a session holds of a mapper.
pub(crate) struct Restored {
    pub(crate) config: Config,
    pub(crate) trajectory: Trajectory,
    pub(crate) visits: Vec<u32>,
    /// Places that nobody has visited, or that turned out to be others; all the rest are visited.
    pub(crate) states: BTreeMap<PlaceId, PlaceState<()>>,
    pub(crate) poses: Vec<Isometry2<f64>>,
    pub(crate) links: Vec<Link>,
    pub(crate) closures: Vec<Closure>,
    pub(crate) tally: Tally,
    pub(crate) tracker: Tracker,
    pub(crate) held_by_scans: bool,
    pub(crate) sweeps: usize,
    pub(crate) names: BTreeMap<PlaceId, String>,
    pub(crate) floor_plan: FloorPlan,
    /// Absent in sessions of a time when it was not stored.
    pub(crate) memory: Option<Memory>,
}

/// What a mapper has in mind beyond the map itself: without it a map goes on as well, but not as if it had never stopped.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    /// What walls have taught of the heading.
    pub(crate) taught: Taught,
    pub(crate) stretch: Vec<View>,
    pub(crate) pending: Vec<Proposal>,
    pub(crate) held: Vec<HeldHeading>,
}

impl Mapper {
    /// The mapper that a session holds; signatures and the map of walls are drawn again from the scans.
    pub(crate) fn restored(from: Restored) -> Result<Self, MapperError> {
        let Restored { config, trajectory, links, memory, .. } = from;
        let sight = Sight::default();
        let set_down = set_down(&links, &trajectory);
        let signatures = signatures(&sight, &trajectory, &set_down, from.visits.len(), config.places.spacing_m)?;
        let map = topology(&from.visits, &from.states, links, |place| Arc::clone(&signatures[place.index()]))?;
        let mut recognizer = Recognizer::new(&config);
        // The robot still looks around at its last place, which is learnt when it leaves.
        let last = trajectory.anchors().last().map(|anchor| anchor.place);
        for place in map.places().iter().filter(|place| Some(place.id) != last) {
            if let Some(signature) = place.signature() {
                recognizer.learn(place.id, signature);
            }
        }
        recognizer.tell_links(&map);
        let set_down = set_down.last().copied();
        let remembers = memory.is_some();
        let Memory { taught, stretch, pending, held } = memory.unwrap_or_default();
        recognizer.recall(stretch);
        let samples = trajectory.samples();
        let mut coordinates = Coordinates::restored(from.poses, from.sweeps);
        coordinates.hold(held);
        let mut restored = Self {
            eyes: Eyes::restored(samples.last().map(|sample| &sample.scan)),
            tally: from.tally.going_on_from(from.tracker.last_odometry()),
            front_end: FrontEnd::restored(
                &config,
                from.tracker,
                from.held_by_scans,
                &samples[set_down.unwrap_or(0)..],
                taught,
            )?,
            watch: CarryWatch::default(),
            set_down,
            sight,
            map,
            coordinates,
            recognizer,
            closures: from.closures,
            proposals: Proposals::restored(pending),
            names: from.names,
            floor_plan: from.floor_plan,
            same: BTreeMap::new(),
            trajectory,
            config,
        };
        restored.watch_again();
        if !remembers {
            restored.let_building_hold();
        }
        Ok(restored)
    }

    /// What it has in mind.
    pub(crate) fn memory(&self) -> Memory {
        Memory {
            taught: self.front_end.taught(),
            stretch: self.recognizer.stretch().cloned().collect(),
            pending: self.proposals.pending().to_vec(),
            held: self.coordinates.held().to_vec(),
        }
    }
}

/// The first sample after each time that the robot was carried.
fn set_down(links: &[Link], trajectory: &Trajectory) -> Vec<usize> {
    let first = |place| trajectory.anchors().iter().find(|anchor| anchor.place == place).map(|anchor| anchor.sample);
    links.iter().filter(|link| link.is_carried()).filter_map(|link| first(link.to)).collect()
}

/// What each place looked like when the robot first came there; blank for those where it never was.
fn signatures(
    sight: &Sight,
    trajectory: &Trajectory,
    set_down: &[usize],
    places: usize,
    spacing: f64,
) -> Result<Vec<Arc<Signature>>, FrameError> {
    let (samples, anchors) = (trajectory.samples(), trajectory.anchors());
    let mut drawn: Vec<Option<Arc<Signature>>> = vec![None; places];
    for (index, anchor) in anchors.iter().enumerate() {
        let signature = &mut drawn[anchor.place.index()];
        if signature.is_none() {
            // Where the robot was carried on its way to a place, its path is tied to it twice: there, and where it came to it.
            let is_set_down = set_down.contains(&anchor.sample);
            let next = anchors[index + 1..].iter().find(|next| !is_set_down || next.place != anchor.place);
            let until = next.map_or(samples.len(), |next| next.sample);
            let track_from_place = anchor.track_from_robot * anchor.place_from_robot.inverse();
            let here = set_down.iter().rfind(|first| **first <= anchor.sample).copied().unwrap_or(0);
            let seen = &samples[first_since(samples, anchor.travelled - spacing).max(here).min(until)..until];
            *signature = Some(sight.signature(&track_from_place, seen)?);
        }
    }
    let blank = sight.signature(&Isometry2::identity(), &[])?;
    Ok(drawn.into_iter().map(|signature| signature.unwrap_or_else(|| Arc::clone(&blank))).collect())
}

mod beside;
mod carry;
mod closing;
pub(crate) mod growth;
mod led;
mod restored;
mod state;
pub(crate) mod summary;
pub(crate) mod tally;

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Isometry2;
use robot_log::local_grid::{FrameError, Signature};
use robot_log::{Entry, EntryKind};
use topo_map::{Displacement, PlaceId, TopoMap, Turn};

use crate::config::{Config, ConfigError, HeadingMode, RelaxationPolicy};
use crate::coordinates::directions::held_headings;
use crate::coordinates::problem::RelaxationError;
use crate::coordinates::{Coordinates, Relaxation};
use crate::event::Event;
use crate::front_end::eyes::{Eyes, touch};
use crate::front_end::gyro::GyroDrift;
use crate::front_end::{FrontEnd, SenseError, Sensed};
use crate::mapper::tally::Tally;
use crate::query::floor_plan::FloorPlan;
use crate::recognize::proposals::Proposals;
use crate::recognize::sight::Sight;
use crate::recognize::{Closure, Recognizer, Sensing};
use crate::trajectory::{Anchor, Sample, Trajectory};
use carry::CarryWatch;
pub(crate) use restored::{Memory, Restored};

/// Builds all levels of the hierarchy from a stream of log entries and keeps them consistent.
///
/// ```no_run
/// # fn entries() -> Vec<robot_log::Entry> { vec![] }
/// let mut mapper = hierarchy::Mapper::new(hierarchy::Config::default())?;
/// for entry in entries() {
///     for event in mapper.push(&entry)? {
///         println!("{event:?}");
///     }
/// }
/// mapper.finish()?;
/// let gridmap = mapper.gridmap()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Mapper {
    config: Config,
    eyes: Eyes,
    front_end: FrontEnd,
    sight: Sight,
    watch: CarryWatch,
    /// The first sample since the robot was carried, if it ever was.
    set_down: Option<usize>,
    trajectory: Trajectory,
    map: TopoMap<Arc<Signature>>,
    coordinates: Coordinates,
    recognizer: Recognizer,
    proposals: Proposals,
    closures: Vec<Closure>,
    tally: Tally,
    names: BTreeMap<PlaceId, String>,
    floor_plan: FloorPlan,
    /// Places that a person declared to be others: which, and which they are.
    same: BTreeMap<PlaceId, PlaceId>,
}

/// Why an entry could not be taken in.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapperError {
    /// The configuration cannot be used.
    #[error("configuration: {0}")]
    Config(#[from] ConfigError),
    /// Time runs backwards.
    #[error("stamp {stamp} s comes after {previous} s: entries must be in the order of their stamps")]
    Backwards {
        /// The entry's stamp.
        stamp: f64,
        /// The stamp before.
        previous: f64,
    },
    /// A pose or a stamp is not a number.
    #[error("entry at {stamp} s: {what} is not finite")]
    NotFinite {
        /// The entry's stamp.
        stamp: f64,
        /// What is not finite.
        what: &'static str,
    },
    /// A scan cannot be drawn.
    #[error(transparent)]
    Sense(#[from] SenseError),
    /// A place lies where no grid can.
    #[error("signature: {0}")]
    Signature(#[from] FrameError),
    /// The topological level refused a step.
    #[error("topological map: {0}")]
    Topology(#[from] topo_map::MapError),
    /// The links cannot be relaxed.
    #[error("relaxation: {0}")]
    Relaxation(#[from] RelaxationError),
    /// The gridmap cannot be made.
    #[error("gridmap: {0}")]
    Grid(#[from] global_grid::GridError),
}

impl Mapper {
    /// An empty map.
    ///
    /// # Errors
    ///
    /// A configuration with a value outside of what makes sense.
    pub fn new(config: Config) -> Result<Self, MapperError> {
        config.check()?;
        Ok(Self {
            eyes: Eyes::default(),
            front_end: FrontEnd::new(&config),
            sight: Sight::default(),
            watch: CarryWatch::default(),
            set_down: None,
            trajectory: Trajectory::default(),
            map: TopoMap::new(),
            coordinates: Coordinates::default(),
            recognizer: Recognizer::new(&config),
            proposals: Proposals::default(),
            closures: Vec::new(),
            tally: Tally::default(),
            names: BTreeMap::new(),
            floor_plan: FloorPlan::default(),
            same: BTreeMap::new(),
            config,
        })
    }

    /// Says how the log's gyro drifts at first, where somebody looked through the log before: see [`GyroSurvey`]. A gyro
    /// that has spoken already knows better.
    ///
    /// [`GyroSurvey`]: crate::GyroSurvey
    pub fn expect_drift(&mut self, drift: GyroDrift) {
        self.front_end.tracker.expect_drift(drift);
    }

    /// Takes in one entry; all levels are consistent when it returns.
    ///
    /// # Errors
    ///
    /// An entry that is not finite or not in order. The map is then as it was before.
    pub fn push(&mut self, entry: &Entry) -> Result<Vec<Event>, MapperError> {
        self.tally.check(entry)?;
        let mut events = Vec::new();
        for due in self.eyes.admit(entry) {
            events.extend(self.take_in(&due)?);
        }
        self.tally.count(entry);
        Ok(events)
    }

    fn take_in(&mut self, entry: &Entry) -> Result<Vec<Event>, MapperError> {
        let sensed = self.front_end.observe(entry)?;
        match (sensed, &entry.kind) {
            (Sensed::Nothing, EntryKind::Recognition { earlier, similarity }) => {
                self.proposals.push(entry.stamp, *earlier, *similarity);
                Ok(Vec::new())
            }
            (Sensed::Nothing, EntryKind::Odometry { odom_from_robot }) if self.eyes.are_shut() => self.travel(Sample {
                stamp: entry.stamp,
                track_from_robot: self.track_from_robot(),
                odom_from_robot: *odom_from_robot,
                travelled: self.front_end.tracker.travelled(),
                scan: touch(),
            }),
            (Sensed::Nothing, _) => Ok(Vec::new()),
            (Sensed::FrameTurned(turn), _) => {
                self.trajectory.rotate(turn);
                Ok(Vec::new())
            }
            (Sensed::Scan(sample), _) => self.travel(sample),
        }
    }

    /// Ends the run: the last place is completed and the coordinates are brought to their optimum.
    ///
    /// # Errors
    ///
    /// As [`Mapper::push`].
    pub fn finish(&mut self) -> Result<Vec<Event>, MapperError> {
        let mut events = Vec::new();
        for due in self.eyes.release() {
            events.extend(self.take_in(&due)?);
        }
        events.extend(self.complete_place()?);
        let refused = self.recognizer.finish(&self.coordinates);
        events.extend(self.close(refused)?);
        events.extend(self.weigh_proposals()?);
        if self.config.relaxation.policy == RelaxationPolicy::Converge && !self.map.places().is_empty() {
            let relaxation = self.coordinates.relax(&self.map)?;
            events.push(relaxed(relaxation));
            events.extend(self.link_beside()?);
        }
        self.let_building_hold(); // as a session that is read back will have it
        Ok(events)
    }

    /// Decides what the robot's own recogniser proposed, all of it together.
    fn weigh_proposals(&mut self) -> Result<Vec<Event>, MapperError> {
        if !self.config.recognition.enabled {
            return Ok(Vec::new());
        }
        let spacing = self.config.places.spacing_m;
        let Some(weighed) = self.proposals.weigh(&self.map, &self.trajectory, spacing)? else { return Ok(Vec::new()) };
        if let Some(poses) = weighed.poses {
            self.coordinates.put(poses);
        }
        let mut events = self.link(weighed.closures)?;
        if self.config.relaxation.policy == RelaxationPolicy::Converge {
            if events.iter().any(|event| matches!(event, Event::PlaceRecognized { .. })) {
                events.push(relaxed(self.coordinates.relax(&self.map)?));
            }
            for _ in 0..HOLDS {
                if !self.let_building_hold() {
                    break;
                }
                self.coordinates.relax(&self.map)?;
            }
        }
        Ok(events)
    }

    /// Where the robot sees no walls and has no compass, the directions of travel hold its headings; answers whether
    /// they say something else than before.
    fn let_building_hold(&mut self) -> bool {
        let source = self.config.heading.source;
        let wanted = matches!(source, HeadingMode::Auto | HeadingMode::Structure);
        if !(wanted && self.eyes.are_shut()) || self.front_end.tracker.has_compass() {
            return false;
        }
        let poses = self.coordinates.padded(&self.map);
        self.coordinates.hold(held_headings(&self.map, &poses, &self.config.heading))
    }

    /// A scan was taken: perhaps the robot has come to another place.
    fn travel(&mut self, sample: Sample) -> Result<Vec<Event>, MapperError> {
        let stamp = sample.stamp;
        self.trajectory.push_sample(sample);
        let mut events = self.notice_carrying()?;
        let Some(anchor) = self.trajectory.anchors().last().copied() else {
            return if self.may_start() { self.start(stamp) } else { Ok(events) };
        };
        let place_from_robot = anchor.place_from_robot * anchor.track_from_robot.inverse() * self.track_from_robot();
        let is_far = place_from_robot.translation.vector.norm() >= self.config.places.spacing_m;
        if !is_far || self.watch.is_in_question() {
            return Ok(events);
        }
        events.extend(self.complete_place()?);
        events.extend(self.arrive(stamp, &anchor)?);
        Ok(events)
    }

    /// The first place waits for a compass to speak, but not for long: not every log has one.
    fn may_start(&self) -> bool {
        let tracker = &self.front_end.tracker;
        tracker.has_compass() || tracker.travelled() > 0.2 || self.trajectory.samples().len() >= 5
    }

    fn start(&mut self, stamp: f64) -> Result<Vec<Event>, MapperError> {
        self.front_end.tracker.tie();
        let place = self.add_place()?;
        self.coordinates.place(place, None);
        self.anchor(place, stamp, self.turned_like_track());
        Ok(vec![Event::PlaceAdded { place }])
    }

    /// The robot has gone far enough from the last place to be at another one.
    fn arrive(&mut self, stamp: f64, left: &Anchor) -> Result<Vec<Event>, MapperError> {
        // A new place takes the robot's spot as its centre and the track frame's axes as its own.
        let place_from_robot = self.turned_like_track();
        let displacement = self.displacement(left, &place_from_robot);
        let place = self.add_place()?;
        let link = self.map.travel(left.place, place, displacement)?;
        self.coordinates.place(place, Some((left.place, &displacement)));
        self.anchor(place, stamp, place_from_robot);
        let mut events = vec![Event::PlaceAdded { place }, Event::LinkAdded { link }];
        if self.config.relaxation.policy == RelaxationPolicy::OneSweep {
            events.push(relaxed(self.coordinates.sweep(&self.map)?));
        } // Otherwise there is nothing to do: a place that hangs by one link leaves an optimum optimal.
        Ok(events)
    }

    /// What was driven from the last anchor to the present spot, from place centre to place centre.
    fn displacement(&self, left: &Anchor, place_from_robot: &Isometry2<f64>) -> Displacement {
        let travelled = left.track_from_robot.inverse() * self.track_from_robot();
        let from_place_from_place = left.place_from_robot * travelled * place_from_robot.inverse();
        let travel = self.front_end.tracker.since_place();
        let place_from_track = left.place_from_robot.rotation.angle() - left.track_from_robot.rotation.angle();
        let turn = (!self.front_end.tracker.has_compass()).then(|| Turn {
            change: from_place_from_place.rotation.angle(),
            variance: travel.turn_variance + TURN_FLOOR,
        });
        Displacement {
            vector: from_place_from_place.translation.vector,
            covariance: travel.position_in(-place_from_track, POSITION_FLOOR),
            turn,
        }
    }

    /// A new place, not recognisable before its surroundings have been seen: see [`Mapper::complete_place`].
    fn add_place(&mut self) -> Result<PlaceId, MapperError> {
        Ok(self.map.add_place(self.sight.signature(&Isometry2::identity(), &[])?)?)
    }

    /// The number of the first scan that shows the place where the robot was when it had `travelled` so far: a spacing before,
    /// if it was not carried there.
    fn seen_from(&self, travelled: f64) -> usize {
        let first = first_since(self.trajectory.samples(), travelled - self.config.places.spacing_m);
        first.max(self.set_down.unwrap_or(0))
    }

    fn anchor(&mut self, place: PlaceId, stamp: f64, place_from_robot: Isometry2<f64>) {
        self.trajectory.push_anchor(Anchor {
            place,
            sample: self.trajectory.samples().len(),
            stamp,
            track_from_robot: self.track_from_robot(),
            place_from_robot,
            travelled: self.front_end.tracker.travelled(),
        });
        self.front_end.tracker.depart();
    }

    /// The robot leaves its last place, whose surroundings it has now seen from all sides: is it a known one?
    fn complete_place(&mut self) -> Result<Vec<Event>, MapperError> {
        self.complete_place_with(self.trajectory.samples().len())
    }

    /// The same, from samples before number `end` alone.
    fn complete_place_with(&mut self, end: usize) -> Result<Vec<Event>, MapperError> {
        let Some(anchor) = self.trajectory.anchors().last().copied() else { return Ok(Vec::new()) };
        let track_from_place = anchor.track_from_robot * anchor.place_from_robot.inverse();
        let seen = &self.trajectory.samples()[self.seen_from(anchor.travelled).min(end)..end];
        let grid = self.sight.grid(&track_from_place, seen)?;
        self.map.describe(anchor.place, self.sight.cut(&grid))?;
        if !self.config.recognition.enabled || self.eyes.are_shut() {
            return Ok(Vec::new());
        }
        let closures = self.recognizer.consider(
            &self.map,
            &self.coordinates,
            anchor.place,
            Sensing::Faithful,
            self.front_end.held(),
        );
        let mut events = self.close(closures)?;
        events.extend(self.notice_afterwards()?);
        Ok(events)
    }

    /// The robot at the centre of a place whose axes are those of the track frame.
    fn turned_like_track(&self) -> Isometry2<f64> {
        Isometry2::from_parts(nalgebra::Translation2::identity(), self.track_from_robot().rotation)
    }
}

/// Rounds in which the building's direction and the map settle on each other.
const HOLDS: usize = 30;
/// The least standard deviation of a link, in metres: no two visits to a place see exactly the same.
const POSITION_FLOOR: f64 = 0.02;
/// The least variance of a turn between places, in rad²: (0.3°)².
const TURN_FLOOR: f64 = 2.7e-5;

/// The first sample taken after `travelled` metres.
fn first_since(samples: &[Sample], travelled: f64) -> usize {
    samples.partition_point(|sample| sample.travelled < travelled)
}

fn relaxed(relaxation: Relaxation) -> Event {
    let Relaxation { sweeps, energy_before, energy_after, max_shift } = relaxation;
    Event::Relaxed { sweeps, energy_before, energy_after, max_shift }
}

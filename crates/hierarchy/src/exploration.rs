mod building;
mod frontiers;
mod optimum;
mod same;

use std::collections::BTreeMap;
use std::sync::Arc;

use local_grid::{Heading, Scan, Signature};
use nalgebra::{Isometry2, Matrix2, Point2, Vector2};
use relaxation::NetworkError;
use robot_log::{Entry, EntryKind};
use topo_map::{
    Change, Command, Displacement, ExploreError, Explorer, ExplorerOptions, Firing, Identity, Link, LinkId, LinkOrigin,
    LinkState, Observation, Place, PlaceId, PlaceState,
};

use crate::config::Config;
use crate::live_map::LiveMap;
use crate::mapper::{Mapper, MapperError};
use crate::query::floor;
use crate::recognize::{Closure, Verdict};
use building::Building;
use frontiers::{Frontier, Frontiers};
use optimum::Optimum;
use same::{Doubled, Known};

/// What an exploring robot should do next. Headings are those of its compass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Errand {
    /// Turn the direction of travel to `to`.
    Turn {
        /// The new direction.
        to: Heading,
    },
    /// Drive straight ahead, and stop before touching anything.
    Drive {
        /// Metres to go.
        distance: f64,
    },
    /// Turn the turret to `to` and hold it there; a robot without one does nothing.
    Look {
        /// The heading to hold.
        to: Heading,
    },
    /// Fire all range sensors once.
    Fire,
    /// The building is explored.
    Done,
}

/// How an [`Errand`] ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ended {
    /// As it was asked for.
    #[default]
    Well,
    /// Something was in the way.
    Blocked,
}

/// Why an exploration cannot go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExplorationError {
    /// The explorer cannot go on.
    #[error(transparent)]
    Explore(#[from] ExploreError),
    /// The levels below cannot take in what the robot recorded.
    #[error(transparent)]
    Mapper(#[from] MapperError),
    /// The links of the map are no network.
    #[error("the map cannot be relaxed")]
    Network(#[from] NetworkError),
}

/// Explores a building by a robot that somebody else moves: takes what the robot records, says what it should do next.
///
/// It joins the explorer with all levels of the hierarchy, over one topological map: the explorer adds predicted places
/// and measured links, dead reckoning and the local grid tell where the robot is, recognition closes loops, relaxation
/// keeps the coordinates at their optimum, and by these the explorer sees that two predictions mean one place. Every
/// change reaches all levels at once, and each does only what the change needs: a link that was measured again is one
/// spring exchanged in an incremental network, a view is drawn from the scans of the last metre.
///
/// When nothing predicted is left nearby, the gridmap is asked for floor that no place covers: a door is overlooked where no
/// look into a single direction went through it. Such spots are predicted, too, each once, and visited before the robot
/// leaves for what is farther away; when there are none anywhere, the building is explored.
///
/// A real robot and a simulated one are driven alike. The robot needs a compass, or a heading as good: the map's axes are
/// those of its headings.
#[derive(Debug)]
pub struct Exploration {
    mapper: Mapper,
    explorer: Explorer,
    optimum: Optimum,
    /// Spots that were looked for nearby, before the robot left; and those when nothing else was left. From nearby a spot may
    /// have been refuted too early, so that it is looked for once more at the end.
    nearby: Frontiers,
    frontiers: Frontiers,
    /// The gridmap in which frontiers are looked for.
    gridmap: LiveMap,
    /// So many scans have been told to the explorer.
    told: usize,
    /// What the sensors are fired for.
    firing: Firing,
    /// The scans of the survey under way.
    survey: Vec<usize>,
    /// The scans that were taken to describe each place, by their index in the trajectory.
    descriptions: BTreeMap<PlaceId, Vec<usize>>,
    last: Option<Known>,
    bearing: Bearing,
    building: Building,
    changes: Vec<Change>,
}

/// By how much the headings that the robot goes by differ from those of the track frame, in radians.
///
/// A robot turns until its own needle points where it was told; the track frame fuses the needle with the odometry.
#[derive(Debug, Default)]
struct Bearing {
    offset: Option<f64>,
}

/// 95 % of the χ² distribution with two degrees of freedom.
const CONTRADICTED: f64 = 5.99;
/// 99.9 % of the same: by so much a way gone again differs from what it was only if the robot is not where it believes.
const ELSEWHERE: f64 = 13.8;
/// The standard deviation, in metres, of where a robot is that has just found itself elsewhere: half the spacing of places.
const LOST: f64 = 0.5;
/// The standard deviation, in metres, from which on a measured displacement says less than the map.
const ANYWHERE: f64 = 1.0;
/// How much of every new reading counts: a reading is noisy, and the needle's disturbance changes within a metre.
const FRESH: f64 = 0.25;

impl Bearing {
    fn observe(&mut self, own: Heading, track_from_robot: &Isometry2<f64>) {
        let offset = own - Heading::from_radians(track_from_robot.rotation.angle());
        let known = self.offset.get_or_insert(offset);
        *known += FRESH * (Heading::from_radians(offset) - Heading::from_radians(*known));
    }

    fn own(&self, track: Heading) -> Heading {
        track + self.offset.unwrap_or(0.0)
    }
}

/// A scan that moved by less, in metres, is left where it was drawn when frontiers are looked for.
const SLACK: f64 = 0.1;
/// A place covers the floor to which its way is shorter than this share of the spacing: what is farther from all of them
/// deserves a place of its own. At the full spacing rooms behind narrow doors were left out in 4 of 15 explored maps, with
/// this share in 3.
const COVERED: f64 = 0.9;

impl Exploration {
    /// An exploration that begins where the robot stands.
    ///
    /// # Errors
    ///
    /// An option out of its range.
    pub fn new(config: Config, options: ExplorerOptions) -> Result<Self, ExplorationError> {
        Ok(Self {
            gridmap: LiveMap::new(config.grid.options()).map_err(MapperError::from)?,
            mapper: Mapper::new(config)?,
            explorer: Explorer::new(options)?,
            optimum: Optimum::default(),
            nearby: Frontiers::default(),
            frontiers: Frontiers::default(),
            told: 0,
            firing: Firing::Watch,
            survey: Vec::new(),
            descriptions: BTreeMap::new(),
            last: None,
            bearing: Bearing::default(),
            building: Building::default(),
            changes: Vec::new(),
        })
    }

    /// Takes what the robot recorded.
    ///
    /// # Errors
    ///
    /// An entry that is not finite or not in order, or a pose where no grid can be.
    pub fn push(&mut self, entry: &Entry) -> Result<(), ExplorationError> {
        self.mapper.follow(entry)?;
        let own = match &entry.kind {
            EntryKind::Heading { heading, .. } => Some(*heading),
            EntryKind::Odometry { odom_from_robot } if !self.mapper.tracker().has_compass() => {
                Some(Heading::from_radians(odom_from_robot.rotation.angle()))
            }
            _ => None,
        };
        if let Some(own) = own {
            self.bearing.observe(own, &self.mapper.track_from_robot());
        }
        Ok(())
    }

    /// Says what to do next, after the last errand has ended.
    ///
    /// # Errors
    ///
    /// A pose that is not finite, or a map that cannot be relaxed.
    pub fn next(&mut self, ended: Ended) -> Result<Errand, ExplorationError> {
        let (mut bumped, mut identity) = (ended == Ended::Blocked, None);
        self.follow_building()?;
        loop {
            let command = self.observe(std::mem::take(&mut bumped), identity.take())?;
            self.follow_changes()?;
            match command {
                Command::Identify { expected, thorough } => identity = Some(self.identify(expected, thorough)?),
                Command::Turn { to } => return Ok(Errand::Turn { to: self.bearing.own(to) }),
                Command::Drive { distance } => return Ok(Errand::Drive { distance }),
                Command::Look { to } => return Ok(Errand::Look { to }),
                Command::Fire { purpose } => {
                    self.firing = purpose;
                    return Ok(Errand::Fire);
                }
                Command::Leave => _ = self.expect_more(self.explorer.options().neighbourhood)?,
                Command::Done if self.expect_more(f64::INFINITY)? => {}
                Command::Done => return Ok(Errand::Done),
            }
        }
    }

    /// Nothing predicted is left `within` so many metres of way: perhaps the gridmap shows floor there on which nobody has
    /// been. Answers whether it does.
    fn expect_more(&mut self, within: f64) -> Result<bool, ExplorationError> {
        let ExplorerOptions { spacing, max_places, .. } = *self.explorer.options();
        let map = self.mapper.topology();
        let Some(here) = self.explorer.place().filter(|_| map.n_visited() < max_places) else { return Ok(false) };
        self.gridmap.follow(&self.mapper, SLACK).map_err(MapperError::from)?;
        let floor = floor(&self.gridmap.map().to_grid().map_err(MapperError::from)?, &self.mapper.poses());
        let ways = map.distances_from(here, Link::distance);
        let is_near = |place: PlaceId| ways.get(place.index()).is_some_and(|way| *way <= within);
        let places = self.charted();
        let unasked = if within.is_finite() { &mut self.nearby } else { &mut self.frontiers };
        let frontiers = unasked.find(&floor, &places, COVERED * spacing, is_near);
        let (map, _, _) = self.mapper.charted();
        for Frontier { seen_from, toward } in &frontiers {
            self.explorer.expect(map, *seen_from, *toward)?;
        }
        Ok(!frontiers.is_empty())
    }

    /// Where all places lie that are visited, and those that will be.
    fn charted(&self) -> Vec<(PlaceId, Point2<f64>)> {
        let map = self.mapper.topology();
        let at = |place| Point2::from(self.mapper.coordinates().map_from_place(place).translation.vector);
        let visited = map.places().iter().filter(|place| place.is_visited()).map(|place| (place.id, at(place.id)));
        let is_open = |link: &&Link| link.origin == LinkOrigin::Predicted && link.state == LinkState::Open;
        let predicted =
            map.links().iter().filter(is_open).filter(|link| map.place(link.to).is_some_and(Place::is_predicted));
        visited.chain(predicted.map(|link| (link.to, at(link.from) + link.displacement.vector))).collect()
    }

    /// The settings of the explorer.
    #[must_use]
    pub fn options(&self) -> &ExplorerOptions {
        self.explorer.options()
    }

    /// All levels of the map so far.
    #[must_use]
    pub fn mapper(&self) -> &Mapper {
        &self.mapper
    }

    /// The scans that describe places, as indices into the samples of the [`Trajectory`](crate::Trajectory), in order: those
    /// of the survey made when a place was first visited, about 48 readings each. A place that was merged into another one
    /// is described by that one's. The paper's gridmap is drawn from them alone.
    #[must_use]
    pub fn descriptions(&self) -> Vec<usize> {
        let mut scans: Vec<usize> = self.descriptions.values().flatten().copied().collect();
        scans.sort_unstable();
        scans
    }

    /// What changed in the map since this was last asked, in order.
    pub fn take_changes(&mut self) -> Vec<Change> {
        std::mem::take(&mut self.changes)
    }

    /// Ends the run and gives all levels of the map.
    #[must_use]
    pub fn into_mapper(self) -> Mapper {
        self.mapper
    }

    /// Tells the explorer what was sensed since it was last told, and asks what to do.
    fn observe(
        &mut self,
        bumped: bool,
        identity: Option<Identity<Arc<Signature>>>,
    ) -> Result<Command, ExplorationError> {
        let track_from_robot = self.mapper.track_from_robot();
        let (map, coordinates, trajectory) = self.mapper.charted();
        let fresh = self.told..trajectory.samples().len();
        if self.firing == Firing::Survey {
            self.survey.extend(fresh.clone());
        }
        let scans: Vec<(Isometry2<f64>, Scan)> = trajectory.samples()[fresh.clone()]
            .iter()
            .map(|sample| (sample.track_from_robot, sample.scan.clone()))
            .collect();
        self.told = fresh.end;
        self.firing = Firing::Watch;
        let position = |place| Some(Point2::from(coordinates.map_from_place(place).translation.vector));
        let observed = Observation::at(track_from_robot, &position);
        let observation = Observation { scans: &scans, bumped, identity, ..observed };
        Ok(self.explorer.observe(map, observation)?)
    }

    /// Carries what the explorer changed through all other levels.
    fn follow_changes(&mut self) -> Result<(), ExplorationError> {
        let changes = self.explorer.take_changes();
        if changes.is_empty() {
            return Ok(());
        }
        self.relax()?;
        let mut reached = None;
        for change in &changes {
            match *change {
                Change::PlaceVisited(place) => {
                    self.stand_at(place, Vector2::zeros(), Matrix2::zeros());
                    self.descriptions.insert(place, std::mem::take(&mut self.survey));
                    reached = Some(place);
                }
                Change::PlaceMerged { absorbed, kept } => self.follow_merge(absorbed, kept, Matrix2::zeros()),
                _ => {}
            }
        }
        self.changes.extend(changes);
        reached.map_or(Ok(()), |place| self.close_loops(place))
    }

    /// A place was reached for the first time: perhaps it closes a loop.
    fn close_loops(&mut self, place: PlaceId) -> Result<(), ExplorationError> {
        let mut closed = false;
        for closure in self.mapper.recognize(place) {
            let (map, _, _) = self.mapper.charted();
            // Either may have been merged into another place since it was seen; then what was seen is of no use any more.
            let gone = map.resolve(closure.place) != closure.place || map.resolve(closure.known) != closure.known;
            let believed = matches!(closure.verdict, Verdict::Accepted { .. }) && !gone;
            if let Some(displacement) = self.seen_by(&closure).filter(|_| believed) {
                let (map, _, _) = self.mapper.charted();
                let link = map.recognize(closure.place, closure.known, displacement).map_err(MapperError::from)?;
                self.changes.push(Change::LinkRecognized(link));
                closed = true;
            }
        }
        if !closed {
            return Ok(());
        }
        self.relax()?;
        self.reject_contradicted()?;
        while let Some(Doubled { absorbed, kept, offset, covariance }) = same::doubled(&self.mapper, &self.optimum)? {
            let (map, _, _) = self.mapper.charted();
            self.explorer.merge(map, absorbed, kept, offset, covariance)?;
            self.relax()?;
            for change in self.explorer.take_changes() {
                self.follow_merge(absorbed, kept, covariance);
                self.changes.push(change);
            }
        }
        Ok(())
    }

    /// What a closure measures.
    ///
    /// Along an axis of which the views say nothing (see [`local_grid::unseen_by_sonar`]) the displacement is that of the
    /// map: as unsure as it was measured, so that it holds nothing, but not made up either. Elsewhere the map has no say. It
    /// took part in the decision that a whole stretch is known, and its errors are those of headings, the same over many
    /// places: each closure by itself would seem to contradict it.
    fn seen_by(&self, closure: &Closure) -> Option<Displacement> {
        let Closure { place, known, displacement: measured, .. } = *closure;
        let at = |place| self.mapper.coordinates().map_from_place(place).translation.vector;
        let believed = at(known) - at(place);
        let anywhere = Matrix2::identity() * ANYWHERE.powi(2);
        let seen = anywhere * (anywhere + measured.covariance).try_inverse()?;
        let vector = believed + seen * (measured.vector - believed);
        Some(Displacement { vector, ..measured })
    }

    /// Takes back recognitions that the rest of the map contradicts: all but the recognised links were driven.
    fn reject_contradicted(&mut self) -> Result<(), ExplorationError> {
        let (map, coordinates, _) = self.mapper.charted();
        let at = |place| coordinates.map_from_place(place).translation.vector;
        let contradicted = |link: &&Link| {
            let off = at(link.to) - at(link.from) - link.displacement.vector;
            let information = link.displacement.covariance.try_inverse();
            link.origin == LinkOrigin::Recognized
                && link.is_measured()
                && information.is_some_and(|information| (off.transpose() * information * off)[0] > CONTRADICTED)
        };
        let links: Vec<LinkId> = map.links().iter().filter(contradicted).map(|link| link.id).collect();
        for &link in &links {
            map.set_link_state(link, LinkState::Rejected).map_err(MapperError::from)?;
            self.changes.push(Change::LinkRejected(link));
        }
        if links.is_empty() { Ok(()) } else { self.relax() }
    }

    fn follow_merge(&mut self, absorbed: PlaceId, kept: PlaceId, covariance: Matrix2<f64>) {
        let (map, _, trajectory) = self.mapper.charted();
        let Some(PlaceState::Merged { offset, .. }) = map.place(absorbed).map(|place| &place.state) else { return };
        let offset = *offset;
        trajectory.merge(absorbed, kept, offset);
        self.descriptions.remove(&absorbed);
        if let Some(last) = self.last.as_mut().filter(|last| last.place == absorbed) {
            let covariance = last.covariance + covariance;
            *last = Known { place: kept, center: last.center - offset, covariance, ..*last };
        }
    }

    /// Turns the map to what is known of the building's direction by now.
    fn follow_building(&mut self) -> Result<(), ExplorationError> {
        let Some(turn) = self.mapper.building().and_then(|now| self.building.learn(&now)) else { return Ok(()) };
        let (map, _, trajectory) = self.mapper.charted();
        map.turn(turn);
        trajectory.turn_at_places(turn);
        self.relax()
    }

    fn relax(&mut self) -> Result<(), ExplorationError> {
        let (map, coordinates, _) = self.mapper.charted();
        let positions = self.optimum.follow(map)?;
        coordinates.settle(map, positions);
        Ok(())
    }

    /// The robot is at a place, `offset` metres from its centre.
    fn stand_at(&mut self, place: PlaceId, offset: Vector2<f64>, covariance: Matrix2<f64>) {
        self.mapper.stand_at(place, offset);
        let at = Point2::from(self.mapper.track_from_robot().translation.vector);
        let travelled = self.mapper.tracker().travelled();
        self.last = Some(Known { place, center: at - offset, covariance, at, travelled });
    }

    /// Says which place this is, by what is seen and by where the robot should be.
    ///
    /// Where it may well be a known place but cannot be said to be, the robot is unsure: to chart that place once more would
    /// not tell it either, and the double would beget doubles.
    fn identify(
        &mut self,
        expected: Option<PlaceId>,
        thorough: bool,
    ) -> Result<Identity<Arc<Signature>>, ExplorationError> {
        let (last, model) = (self.last.as_ref(), &self.explorer.options().dead_reckoning);
        let mut identity = same::identify(&self.mapper, &self.optimum, last, model)?;
        if let Identity::New { signature } = &identity
            && (!thorough || same::may_be_known(&self.mapper, last, expected, signature))
        {
            identity = Identity::Unsure;
        }
        if self.is_elsewhere(&identity) {
            identity = Identity::Unsure;
            if let Some(last) = &mut self.last {
                last.covariance += Matrix2::identity() * LOST.powi(2);
            }
        }
        if let Identity::Known { place, offset, covariance, .. } = identity {
            self.stand_at(place, offset, covariance);
        }
        if !matches!(identity, Identity::New { .. }) {
            self.survey.clear(); // a place is described once
        }
        Ok(identity)
    }

    /// Whether the way to a place that was recognised is another one than it was when the robot went there before: then it was
    /// not where it believed to be, or is not there now.
    fn is_elsewhere(&self, identity: &Identity<Arc<Signature>>) -> bool {
        let Identity::Known { place, offset, seen: Some(seen), .. } = identity else { return false };
        let Some(last) = self.last.as_ref().filter(|last| last.place != *place) else { return false };
        let at = Point2::from(self.mapper.track_from_robot().translation.vector);
        let driven = self.mapper.tracker().travelled() - last.travelled;
        let covariance = last.uncertainty(at, driven, &self.explorer.options().dead_reckoning) + seen;
        let measured = Displacement { vector: at - offset - last.center, covariance, turn: None };
        let links = self.mapper.topology().links_between(last.place, *place);
        let mut gone = links.filter(|link| link.origin == LinkOrigin::Traveled);
        gone.any(|link| link.displacement_from(last.place).disagreement(&measured) > ELSEWHERE)
    }
}

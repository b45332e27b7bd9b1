//! A robot in a simulated building, driven by the explorer: what stands between the two on a real robot as well.

use std::sync::Arc;

use local_grid::nalgebra::{Isometry2, Matrix2, Point2, Vector2};
use local_grid::{
    AlignOptions, Fuzzy, Scan, Signature, SignatureOptions, SonarCone, WorkingGrid, WorkingGridOptions, align,
};
use relaxation::{Network, Spring};
use simulator::robot_log::EntryKind;
use simulator::{Robot, RobotDescription, World};
use topo_map::local_grid;
use topo_map::{Change, Command, Explorer, ExplorerOptions, Identity, LinkOrigin, Observation, PlaceId, TopoMap};
use topo_map::{NearbyOptions, PlaceLikelihood, Supposed, identify_nearby};

type Error = Box<dyn std::error::Error>;

/// Scans, each with the pose where it was taken.
type Posed = Vec<(Isometry2<f64>, Scan)>;

/// How an exploration went.
#[derive(Debug)]
pub(crate) struct Explored {
    pub(crate) map: TopoMap<Arc<Signature>>,
    /// Where each visited place really is.
    pub(crate) truth: Vec<Option<Point2<f64>>>,
    /// Where the map says it is.
    pub(crate) positions: Vec<Point2<f64>>,
    pub(crate) changes: Vec<Change>,
    pub(crate) commands: usize,
    pub(crate) ended: bool,
    pub(crate) bumps: usize,
    pub(crate) path_length: f64,
    /// Recognitions of a place that was really elsewhere (more than a metre).
    pub(crate) false_recognitions: usize,
}

pub(crate) struct Host<'w> {
    robot: Robot<'w>,
    track_from_robot: Isometry2<f64>,
    odom_from_robot: Option<Isometry2<f64>>,
    window: WorkingGrid<Fuzzy>,
    map: TopoMap<Arc<Signature>>,
    positions: Vec<Point2<f64>>,
    truth: Vec<Option<Point2<f64>>>,
    /// The place last identified, the track position of its centre, and the path driven by then.
    last: Option<(PlaceId, Point2<f64>, f64)>,
    false_recognitions: usize,
}

impl<'w> Host<'w> {
    pub(crate) fn new(world: &'w World, description: RobotDescription, seed: u64) -> Result<Self, Error> {
        Ok(Self {
            robot: Robot::new(world, description, seed)?,
            track_from_robot: Isometry2::identity(),
            odom_from_robot: None,
            window: WorkingGrid::new(&WorkingGridOptions::default(), Point2::origin())?,
            map: TopoMap::new(),
            positions: Vec::new(),
            truth: Vec::new(),
            last: None,
            false_recognitions: 0,
        })
    }

    /// Lets the explorer drive until it is done, or for so many commands.
    pub(crate) fn explore(mut self, options: ExplorerOptions, most_commands: usize) -> Result<Explored, Error> {
        let mut explorer = Explorer::new(options)?;
        let (mut scans, mut bumped, mut identity) = (Vec::new(), false, None);
        let (mut all_changes, mut ended, mut commands) = (Vec::new(), false, 0);
        while commands < most_commands && !ended {
            commands += 1;
            let positions = std::mem::take(&mut self.positions);
            let position = |place: PlaceId| positions.get(place.index()).copied();
            let observation = Observation {
                scans: &scans,
                bumped,
                identity: identity.take(),
                ..Observation::at(self.track_from_robot, &position)
            };
            let command = explorer.observe(&mut self.map, observation)?;
            self.positions = positions;
            let changes = explorer.take_changes();
            if !changes.is_empty() {
                self.relax()?;
                self.note(&changes);
                all_changes.extend(changes);
            }
            scans.clear();
            bumped = false;
            match command {
                Command::Turn { to } => _ = self.act(&simulator::Command::Turn { to })?,
                Command::Drive { distance } => {
                    bumped = self.act(&simulator::Command::Drive { distance })?.1;
                }
                Command::Look { to } => _ = self.act(&simulator::Command::Look { to })?,
                Command::Fire { .. } => scans = self.act(&simulator::Command::Fire)?.0,
                Command::Identify { thorough, .. } => identity = Some(self.identify(thorough)),
                Command::Done => ended = true,
            }
        }
        Ok(Explored {
            truth: self.truth,
            positions: self.positions,
            map: self.map,
            changes: all_changes,
            commands,
            ended,
            bumps: self.robot.bumps(),
            path_length: self.robot.path_length(),
            false_recognitions: self.false_recognitions,
        })
    }

    /// Lets the robot do something; answers its scans and whether it was stopped.
    fn act(&mut self, command: &simulator::Command) -> Result<(Posed, bool), Error> {
        let mut log = Vec::new();
        let outcome = self.robot.execute(command, &mut log);
        let mut scans = Vec::new();
        for entry in log {
            match entry.kind {
                EntryKind::Odometry { odom_from_robot } => self.follow(odom_from_robot),
                EntryKind::Heading { heading, .. } => {
                    let at = self.track_from_robot.translation.vector;
                    self.track_from_robot = Isometry2::new(at, heading.radians());
                }
                EntryKind::Scan { scan, .. } => {
                    self.window.integrate(&SonarCone::default(), &self.track_from_robot, &scan)?;
                    scans.push((self.track_from_robot, scan));
                }
                _ => {}
            }
        }
        Ok((scans, outcome.blocked))
    }

    /// Adds a step of odometry, in the direction that the compass says.
    fn follow(&mut self, odom_from_robot: Isometry2<f64>) {
        if let Some(before) = self.odom_from_robot {
            let step = before.inverse() * odom_from_robot;
            let at = self.track_from_robot * Point2::from(step.translation.vector);
            self.track_from_robot.translation.vector = at.coords;
        }
        self.odom_from_robot = Some(odom_from_robot);
    }

    fn relax(&mut self) -> Result<(), Error> {
        let measured = self.map.links().iter().filter(|link| link.is_measured());
        let springs: Vec<Spring> = measured
            .map(|link| Spring {
                from: link.from.index(),
                to: link.to.index(),
                rest: link.displacement.vector,
                covariance: link.displacement.covariance,
            })
            .collect();
        let network = Network::new(self.map.places().len(), &springs)?;
        self.positions = relaxation::optimum(&network)?;
        Ok(())
    }

    fn note(&mut self, changes: &[Change]) {
        self.truth.resize(self.map.places().len(), None);
        for change in changes {
            if let Change::PlaceVisited(place) = change {
                self.truth[place.index()] = Some(self.real_position());
                let at = Point2::from(self.track_from_robot.translation.vector);
                self.last = Some((*place, at, self.robot.path_length()));
            }
        }
    }

    /// Compares the view with those of the places near where the robot should be.
    fn identify(&mut self, thorough: bool) -> Identity<Arc<Signature>> {
        let at = Point2::from(self.track_from_robot.translation.vector);
        let view = Arc::new(self.window.signature(at, &SignatureOptions::default()));
        let Some((place, center, driven)) = self.last else { return Identity::New { signature: view } };
        let covariance = Matrix2::identity() * (0.008 * (self.robot.path_length() - driven));
        let supposed = Supposed { place, offset: at - center, covariance };
        let position = |place: PlaceId| self.positions.get(place.index()).copied();
        let compare = |place, signature: &Arc<Signature>| compare(place, signature, &view);
        let options = NearbyOptions::default();
        let identity = identify_nearby(&self.map, &supposed, Arc::clone(&view), &options, position, compare);
        match identity {
            Identity::Known { place, offset, .. } => {
                let off = self.truth[place.index()].map_or(0.0, |truth| (self.real_position() - offset - truth).norm());
                self.false_recognitions += usize::from(off > 0.7);
                self.last = Some((place, at - offset, self.robot.path_length()));
                identity
            }
            Identity::New { .. } if !thorough => Identity::Unsure,
            identity => identity,
        }
    }

    fn real_position(&self) -> Point2<f64> {
        Point2::from(self.robot.map_from_robot().translation.vector)
    }
}

/// How much a view speaks for a place: the score of their alignment against that of unlike views, about 0.55.
fn compare(place: PlaceId, known: &Signature, view: &Signature) -> Option<PlaceLikelihood> {
    let found = align(known, view, &AlignOptions::default());
    let ratio = (12.0 * (found.score - 0.55) - 4.0 * found.contradiction).exp();
    let covariance = found.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    (found.score > 0.0).then_some(PlaceLikelihood { place, ratio, offset: found.offset, covariance, turn: found.turn })
}

impl Explored {
    pub(crate) fn visited(&self) -> impl Iterator<Item = Point2<f64>> + '_ {
        let visited = self.map.places().iter().filter(|place| place.is_visited());
        visited.filter_map(|place| self.truth[place.id.index()])
    }

    /// The share of the floor that the robot could reach which lies within `radius` of a visited place and in its sight.
    pub(crate) fn coverage(&self, world: &World, radius: f64) -> f64 {
        world.coverage(&self.visited().collect::<Vec<_>>(), 0.225 + 0.05, radius)
    }

    /// Visited places that lie within `radius` of an earlier one.
    pub(crate) fn duplicates(&self, radius: f64) -> usize {
        let all: Vec<_> = self.visited().collect();
        (0..all.len()).filter(|&k| all[..k].iter().any(|before| (before - all[k]).norm() < radius)).count()
    }

    pub(crate) fn count(&self, origin: LinkOrigin) -> usize {
        self.map.links().iter().filter(|link| link.origin == origin && link.is_passable()).count()
    }

    /// Mean distance of places from the truth, after moving the map as a whole so that it fits best.
    pub(crate) fn mean_error(&self) -> f64 {
        let pairs: Vec<_> = self
            .map
            .places()
            .iter()
            .filter(|place| place.is_visited())
            .filter_map(|place| Some((self.positions[place.id.index()], self.truth[place.id.index()]?)))
            .collect();
        let mean = pairs.iter().fold(Vector2::zeros(), |sum, (map, truth)| sum + (truth - map)) / pairs.len() as f64;
        pairs.iter().map(|(map, truth)| (truth - map - mean).norm()).sum::<f64>() / pairs.len() as f64
    }
}

use std::sync::Arc;

use local_grid::{
    AlignOptions, FrameError, Fuzzy, Heading, Scan, Signature, SignatureOptions, SonarCone, WorkingGrid,
    WorkingGridOptions, align,
};
use nalgebra::{Isometry2, Point2, UnitComplex, Vector2};
use relaxation::{NetworkError, SolveError};
use robot_log::{Entry, EntryKind};
use topo_map::{
    Change, Command, ExploreError, Explorer, ExplorerOptions, Identity, NearbyOptions, Observation, PlaceId,
    PlaceLikelihood, Supposed, TopoMap, identify_nearby,
};

use crate::problem::network;

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
    /// The robot believes to be where no grid can be.
    #[error("the robot's pose is out of range")]
    Frame(#[from] FrameError),
    /// The links of the map are no network.
    #[error("the map cannot be relaxed")]
    Network(#[from] NetworkError),
    /// The network cannot be solved.
    #[error("the map cannot be relaxed")]
    Solve(#[from] SolveError),
}

/// Explores a building by a robot that somebody else moves: takes what the robot records, says what it should do next.
///
/// It joins the levels that exploring needs while it goes on: dead reckoning by compass and odometry, the local grid and
/// its signatures, the explorer with its topological map, and the relaxed coordinates by which the explorer sees that two
/// predictions mean one place. A real robot and a simulated one are driven alike; what they record is a log that
/// [`Mapper`](crate::Mapper) turns into the whole hierarchy, on line or later.
#[derive(Debug)]
pub struct Exploration {
    explorer: Explorer,
    map: TopoMap<Arc<Signature>>,
    positions: Vec<Point2<f64>>,
    window: WorkingGrid<Fuzzy>,
    track: Track,
    scans: Vec<(Isometry2<f64>, Scan)>,
    last: Option<Known>,
    changes: Vec<Change>,
}

/// Where the robot last knew to be.
#[derive(Debug, Clone, Copy)]
struct Known {
    place: PlaceId,
    /// The place's centre in the track frame.
    center: Point2<f64>,
    /// Metres driven by then.
    driven: f64,
}

/// Dead reckoning: the odometry's steps, turned to where the compass points.
#[derive(Debug, Default)]
struct Track {
    track_from_robot: Isometry2<f64>,
    odom_from_robot: Option<Isometry2<f64>>,
    has_compass: bool,
    driven: f64,
}

impl Track {
    fn odometry(&mut self, odom_from_robot: Isometry2<f64>) {
        if let Some(before) = self.odom_from_robot {
            let step = before.inv_mul(&odom_from_robot);
            self.driven += step.translation.vector.norm();
            let turn = if self.has_compass { UnitComplex::identity() } else { step.rotation };
            self.track_from_robot *= Isometry2::from_parts(step.translation, turn);
        } else if !self.has_compass {
            self.track_from_robot.rotation = odom_from_robot.rotation;
        }
        self.odom_from_robot = Some(odom_from_robot);
    }

    fn heading(&mut self, heading: Heading) {
        self.has_compass = true;
        self.track_from_robot.rotation = UnitComplex::new(heading.radians());
    }

    fn at(&self) -> Point2<f64> {
        Point2::from(self.track_from_robot.translation.vector)
    }
}

impl Exploration {
    /// An exploration that begins where the robot stands.
    ///
    /// # Errors
    ///
    /// An option out of its range.
    pub fn new(options: ExplorerOptions) -> Result<Self, ExplorationError> {
        Ok(Self {
            explorer: Explorer::new(options)?,
            map: TopoMap::new(),
            positions: Vec::new(),
            window: WorkingGrid::new(&WorkingGridOptions::default(), Point2::origin())?,
            track: Track::default(),
            scans: Vec::new(),
            last: None,
            changes: Vec::new(),
        })
    }

    /// Takes what the robot recorded.
    ///
    /// # Errors
    ///
    /// A pose where no grid can be.
    pub fn push(&mut self, entry: &Entry) -> Result<(), ExplorationError> {
        match &entry.kind {
            EntryKind::Odometry { odom_from_robot } => self.track.odometry(*odom_from_robot),
            EntryKind::Heading { heading, .. } => self.track.heading(*heading),
            EntryKind::Scan { odom_from_robot, scan } => {
                if let Some(odom_from_robot) = odom_from_robot {
                    self.track.odometry(*odom_from_robot);
                }
                let track_from_robot = self.track.track_from_robot;
                self.window.integrate(&SonarCone::default(), &track_from_robot, scan)?;
                self.scans.push((track_from_robot, scan.clone()));
            }
            _ => {} // the truth is not for the robot
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
        loop {
            let positions = &self.positions;
            let position = |place: PlaceId| positions.get(place.index()).copied();
            let observation = Observation {
                scans: &self.scans,
                bumped: std::mem::take(&mut bumped),
                identity: identity.take(),
                ..Observation::at(self.track.track_from_robot, &position)
            };
            let command = self.explorer.observe(&mut self.map, observation)?;
            self.scans.clear();
            self.follow_changes()?;
            match command {
                Command::Identify { thorough, .. } => identity = Some(self.identify(thorough)),
                Command::Turn { to } => return Ok(Errand::Turn { to }),
                Command::Drive { distance } => return Ok(Errand::Drive { distance }),
                Command::Look { to } => return Ok(Errand::Look { to }),
                Command::Fire { .. } => return Ok(Errand::Fire),
                Command::Done => return Ok(Errand::Done),
            }
        }
    }

    /// The topological map so far.
    #[must_use]
    pub fn map(&self) -> &TopoMap<Arc<Signature>> {
        &self.map
    }

    /// The relaxed coordinates of the places, by their index, in metres; the first place is the origin.
    #[must_use]
    pub fn positions(&self) -> &[Point2<f64>] {
        &self.positions
    }

    /// What changed in the map since this was last asked, in order.
    pub fn take_changes(&mut self) -> Vec<Change> {
        std::mem::take(&mut self.changes)
    }

    fn follow_changes(&mut self) -> Result<(), ExplorationError> {
        let changes = self.explorer.take_changes();
        if changes.is_empty() {
            return Ok(());
        }
        self.relax()?;
        for change in &changes {
            if let Change::PlaceVisited(place) = change {
                self.last = Some(Known { place: *place, center: self.track.at(), driven: self.track.driven });
            }
        }
        self.changes.extend(changes);
        Ok(())
    }

    fn relax(&mut self) -> Result<(), ExplorationError> {
        self.positions = relaxation::optimum(&network(&self.map)?)?;
        Ok(())
    }

    /// Compares the view with those of the places near where the robot should be.
    fn identify(&mut self, thorough: bool) -> Identity<Arc<Signature>> {
        let at = self.track.at();
        let view = Arc::new(self.window.signature(at, &SignatureOptions::default()));
        let Some(Known { place, center, driven }) = self.last else { return Identity::New { signature: view } };
        let supposed = Supposed { place, offset: at - center, driven: self.track.driven - driven };
        let position = |place: PlaceId| self.positions.get(place.index()).copied();
        let compare = |place, signature: &Arc<Signature>| compare(place, signature, &view);
        let options = NearbyOptions::default();
        let identity = identify_nearby(&self.map, &supposed, Arc::clone(&view), &options, position, compare);
        match identity {
            Identity::Known { place, offset, .. } => {
                self.last = Some(Known { place, center: at - offset, driven: self.track.driven });
                identity
            }
            Identity::New { .. } if !thorough => Identity::Unsure,
            identity => identity,
        }
    }
}

/// The score of the alignment of two unlike views.
const UNLIKE: f64 = 0.55;

/// How much a view speaks for a place: the score of their alignment against that of unlike views.
fn compare(place: PlaceId, known: &Signature, view: &Signature) -> Option<PlaceLikelihood> {
    let found = align(known, view, &AlignOptions::default());
    let ratio = (12.0 * (found.score - UNLIKE) - 4.0 * found.contradiction).exp();
    let covariance = found.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let offset: Vector2<f64> = found.offset;
    (found.score > 0.0).then_some(PlaceLikelihood { place, ratio, offset, covariance, turn: found.turn })
}

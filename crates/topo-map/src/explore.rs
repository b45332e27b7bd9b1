mod chart;
mod message;
mod obstacles;
mod travel;

use std::collections::BTreeMap;

use local_grid::{Fuzzy, Heading, LaserRay, Scan, SensorKind, SonarCone, WorkingGrid, WorkingGridOptions};
use nalgebra::{Isometry2, Matrix2, Point2, Vector2};

use crate::{
    DeadReckoning, Displacement, FeatureOptions, LinkId, MapError, OpenSpace, PeakOptions, PlaceId, RangeRose, TopoMap,
};

pub use message::{Change, Command, Firing, Identity, Observation};
pub use obstacles::ObstacleOptions;
use obstacles::Obstacles;
use travel::Travel;

/// The settings of the exploration.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct ExplorerOptions {
    /// How far from a place new ones are predicted, in metres.
    pub spacing: f64,
    /// No place is predicted nearer than this to another, in metres; a link is predicted instead.
    pub suppression: f64,
    /// No link is predicted so near in direction to another of the same place, in radians.
    pub link_separation: f64,
    /// The standard deviation of a predicted place along both axes, in metres.
    pub predicted_sigma: f64,
    /// A place counts as reached within so many metres.
    pub arrival: f64,
    /// A predicted place that can be approached only this near, in metres, counts as reached.
    pub near_enough: f64,
    /// What travelling adds to the uncertainty of a displacement.
    pub dead_reckoning: DeadReckoning,
    /// How many times the sensors fire at a new place, turned by one more step each time.
    pub survey_firings: u32,
    /// That step, in radians.
    pub survey_step: f64,
    /// How the sensors are turned for it.
    pub survey: SurveyMotion,
    /// The longest straight piece driven before the sensors fire again, in metres.
    pub stride: f64,
    /// A way that is so many times longer than the straight line, and a metre more, is no link.
    pub detour: f64,
    /// No link is predicted between two places that up to three links join already over a way at most this many times as
    /// long.
    pub redundancy: f64,
    /// Predicted links between visited places count as this much farther away than predicted places, in metres.
    pub link_penalty: f64,
    /// How many times a way that was blocked, or a prediction that could not be reached, is tried again before it is given
    /// up.
    pub retries: u32,
    /// What is left to be found out within so many metres of way is finished before the robot leaves for anything farther,
    /// and the host is asked for more there; with 0 it always goes to what is nearest.
    pub neighbourhood: f64,
    /// The exploration ends when the map has so many visited places, whatever is still predicted.
    pub max_places: usize,
    /// How openings are measured.
    pub features: FeatureOptions,
    /// How openings are picked.
    pub peaks: PeakOptions,
    /// The body, and how near it may come to obstacles.
    pub obstacles: ObstacleOptions,
}

/// How the sensors are turned between the firings of a survey.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum SurveyMotion {
    /// The turret is turned.
    #[default]
    Turret,
    /// The robot turns on the spot.
    Body,
}

impl Default for ExplorerOptions {
    /// For a Nomad 200: places about a metre apart, surveys of three firings of 16 sonars 7.5° apart.
    fn default() -> Self {
        Self {
            // Measured on forty explored offices: 1.00 m makes a tenth more places, 1.10 m twice as many false links.
            spacing: 1.05,
            suppression: 0.95,
            link_separation: 30_f64.to_radians(),
            predicted_sigma: 0.25,
            arrival: 0.12,
            near_enough: 0.35,
            dead_reckoning: DeadReckoning::default(),
            survey_firings: 3,
            survey_step: 7.5_f64.to_radians(),
            survey: SurveyMotion::Turret,
            stride: 0.5,
            detour: 1.8,
            redundancy: 1.8,
            link_penalty: 2.0,
            retries: 2,
            neighbourhood: 4.0,
            max_places: 10_000,
            features: FeatureOptions::default(),
            peaks: PeakOptions::default(),
            obstacles: ObstacleOptions::default(),
        }
    }
}

/// Explores an unknown building: a state machine that is told what the robot observes and answers what it should do.
///
/// The strategy is that of Duckett & Nehmzow (1999). At each new place the network says in which directions the way is
/// open, and there *predicted places* enter the map. The robot goes to the nearest of them, that is to the edge of the
/// charted territory, and finds that it can be reached (it becomes a visited place, or turns out to be one that is known
/// already) or not (it is refuted). It finishes a neighbourhood before it leaves it, and the
/// host may expect more there ([`Command::Leave`]). When nothing predicted is left, the building is explored.
///
/// The explorer moves nothing itself, opens nothing, and knows no clock: a real robot and a simulated one are driven alike.
/// It changes the map that it is given and reports every change ([`Explorer::take_changes`]), so that the levels above can
/// follow. What it needs from them are the positions of visited places (to see that two predictions mean one place) and,
/// when it asks, the identity of the place where the robot stands.
///
/// # It ends
///
/// Every travel resolves the predicted link it set out for, after [`ExplorerOptions::retries`] more tries at the latest
/// (it becomes traveled, blocked or rejected, and nothing makes a link predicted again), or blocks a traveled link on
/// the way there, which is opened again at most [`ExplorerOptions::retries`] times, and as often after each of the
/// times that the robot would else be shut in: at most three between two predicted links that are resolved. From a
/// place something is predicted only in directions that are [`ExplorerOptions::link_separation`] from all that were
/// predicted from it before, so at most `2π / separation` times, and there are at most [`ExplorerOptions::max_places`]
/// places. A single hop ends, because its length driven is bounded.
#[derive(Debug)]
pub struct Explorer {
    options: ExplorerOptions,
    network: OpenSpace,
    window: WorkingGrid<Fuzzy>,
    obstacles: Obstacles,
    /// Where the robot is, once the first place is known.
    here: Option<Here>,
    robot: Isometry2<f64>,
    phase: Phase,
    rose: RangeRose,
    surveys: u32,
    /// The directions in which something was predicted, for each place.
    asked: BTreeMap<PlaceId, Vec<Heading>>,
    /// How many times the robot was stopped on each predicted link, or a traveled one was opened again.
    tried: BTreeMap<LinkId, u32>,
    /// How often in a row it seemed that no way leads out.
    shut_in: u32,
    /// The journey at whose end the survey is made.
    pending: Option<Travel>,
    changes: Vec<Change>,
}

/// The place that the robot is at or has last been at.
#[derive(Debug, Clone, Copy)]
struct Here {
    place: PlaceId,
    /// The centre of that place in the track frame.
    center: Point2<f64>,
    /// The covariance of that centre, in m².
    covariance: Matrix2<f64>,
    /// Metres driven since the robot was found to be at that place.
    driven: f64,
}

#[derive(Debug)]
enum Phase {
    /// The sensors are being turned and fired; so many firings are done.
    Surveying { fired: u32, turned: bool },
    /// The host was asked where the robot is, at the end of a travel or (without one) at the start.
    Identifying(Option<Travel>),
    /// Nothing is going on.
    Choosing,
    /// Nothing is left nearby, and the host has been told.
    Leaving,
    /// Under way.
    Traveling(Travel),
    /// Nothing predicted is left.
    Done,
}

/// Why the explorer cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExploreError {
    /// The map refused a change; it was changed by somebody else, or holds another exploration.
    #[error("the map refused a change")]
    Map(#[from] MapError),
    /// A pose must be one.
    #[error("the pose of the robot is not finite")]
    Pose,
    /// An option is out of its range.
    #[error("option `{name}` must lie in {range}, got {value}")]
    Option {
        /// Its name.
        name: &'static str,
        /// What it must lie in.
        range: &'static str,
        /// What it was.
        value: f64,
    },
    /// The host recognised a place that the map does not have.
    #[error("{0} was recognised, but is not a visited place of the map")]
    Unknown(PlaceId),
}

impl Explorer {
    /// An explorer that stands at its first place, with the network that comes along.
    ///
    /// # Errors
    ///
    /// An option out of its range.
    pub fn new(options: ExplorerOptions) -> Result<Self, ExploreError> {
        Self::with_network(options, OpenSpace::trained())
    }

    /// An explorer with a network of one's own.
    ///
    /// # Errors
    ///
    /// An option out of its range.
    ///
    /// # Panics
    ///
    /// Never: the default window can be made.
    pub fn with_network(options: ExplorerOptions, network: OpenSpace) -> Result<Self, ExploreError> {
        options.check()?;
        let window =
            WorkingGrid::new(&WorkingGridOptions::default(), Point2::origin()).expect("the default window is a frame");
        Ok(Self {
            obstacles: Obstacles::new(options.obstacles),
            options,
            network,
            window,
            here: None,
            robot: Isometry2::identity(),
            phase: Phase::Surveying { fired: 0, turned: false },
            rose: RangeRose::new(Point2::origin()),
            surveys: 0,
            asked: BTreeMap::new(),
            tried: BTreeMap::new(),
            shut_in: 0,
            pending: None,
            changes: Vec::new(),
        })
    }

    /// The settings.
    #[must_use]
    pub fn options(&self) -> &ExplorerOptions {
        &self.options
    }

    /// The place that the robot is at or has last been at.
    #[must_use]
    pub fn place(&self) -> Option<PlaceId> {
        self.here.map(|here| here.place)
    }

    /// Merges two visited places that coordinates and views now say are one, `absorbed` lying at `offset` metres from `kept`,
    /// known to `covariance` (m²).
    ///
    /// The explorer may be at one of them, or on the way to it: it then finds itself at the one that is kept, and chooses anew
    /// where to go.
    ///
    /// # Errors
    ///
    /// As [`TopoMap::merge`].
    pub fn merge<S>(
        &mut self,
        map: &mut TopoMap<S>,
        absorbed: PlaceId,
        kept: PlaceId,
        offset: Vector2<f64>,
        covariance: Matrix2<f64>,
    ) -> Result<(), ExploreError> {
        map.merge(absorbed, kept, offset, covariance)?;
        self.changes.push(Change::PlaceMerged { absorbed, kept });
        if let Some(here) = self.here.as_mut().filter(|here| here.place == absorbed) {
            here.place = kept;
            here.center -= offset;
            here.covariance += covariance;
        }
        let asked = self.asked.remove(&absorbed).unwrap_or_default();
        self.asked.entry(kept).or_default().extend(asked);
        if matches!(&self.phase, Phase::Traveling(travel) if travel.passes(absorbed) || travel.passes(kept)) {
            self.phase = Phase::Choosing;
        }
        travel::drop_idle_predictions(map, kept)
    }

    /// What was changed in the map since this was last asked, in order.
    pub fn take_changes(&mut self) -> Vec<Change> {
        std::mem::take(&mut self.changes)
    }

    /// What is around the robot: the temporary local grid, in the track frame.
    #[must_use]
    pub fn window(&self) -> &WorkingGrid<Fuzzy> {
        &self.window
    }

    /// Takes in what the robot observed and answers what it should do next.
    ///
    /// Once the answer is [`Command::Done`] it stays so.
    ///
    /// # Errors
    ///
    /// A pose that is not finite, a recognised place that is not in the map, a map that somebody else changed.
    pub fn observe<S>(
        &mut self,
        map: &mut TopoMap<S>,
        observation: Observation<'_, S>,
    ) -> Result<Command, ExploreError> {
        let Observation { track_from_robot, scans, bumped, identity, position } = observation;
        self.follow(track_from_robot)?;
        for (pose, scan) in scans {
            self.sense(pose, scan)?;
        }
        if let Some(identity) = identity {
            self.identified(map, identity, position)?;
        }
        if bumped {
            self.bumped();
        }
        loop {
            match std::mem::replace(&mut self.phase, Phase::Done) {
                Phase::Surveying { fired, turned } => {
                    if let Some(command) = self.survey(fired, turned) {
                        return Ok(command);
                    }
                }
                Phase::Identifying(travel) => {
                    let expected = travel.as_ref().map(Travel::next_place);
                    let thorough = travel.as_ref().is_none_or(Travel::is_last);
                    self.phase = Phase::Identifying(travel);
                    return Ok(Command::Identify { expected, thorough });
                }
                phase @ (Phase::Choosing | Phase::Leaving) => {
                    if let Some(command) = self.choose(map, position, matches!(phase, Phase::Leaving))? {
                        return Ok(command);
                    }
                }
                Phase::Traveling(travel) => {
                    if let Some(command) = self.travel(map, travel)? {
                        return Ok(command);
                    }
                }
                Phase::Done => return Ok(Command::Done),
            }
        }
    }

    /// Follows the robot's own idea of where it is.
    fn follow(&mut self, track_from_robot: Isometry2<f64>) -> Result<(), ExploreError> {
        let at = track_from_robot.translation.vector;
        if !(at.x.is_finite() && at.y.is_finite() && track_from_robot.rotation.angle().is_finite()) {
            return Err(ExploreError::Pose);
        }
        let step = (at - self.robot.translation.vector).norm();
        self.robot = track_from_robot;
        self.obstacles.tread(Point2::from(at));
        if let Some(here) = &mut self.here {
            here.driven += step;
        }
        if let Phase::Traveling(travel) = &mut self.phase {
            travel.driven += step;
        }
        Ok(())
    }

    fn at(&self) -> Point2<f64> {
        Point2::from(self.robot.translation.vector)
    }

    fn sense(&mut self, track_from_robot: &Isometry2<f64>, scan: &Scan) -> Result<(), ExploreError> {
        let drawn = match scan.sensor().kind() {
            SensorKind::Sonar => self.window.integrate(&SonarCone::default(), track_from_robot, scan),
            SensorKind::Laser | SensorKind::Infrared => {
                self.window.integrate(&LaserRay::default(), track_from_robot, scan)
            }
        };
        drawn.and_then(|()| self.obstacles.integrate(track_from_robot, scan)).map_err(|_| ExploreError::Pose)?;
        if let Phase::Surveying { .. } = self.phase {
            self.rose.add(track_from_robot, scan);
        }
        Ok(())
    }

    /// The next step of a survey, or `None` when it is complete.
    fn survey(&mut self, fired: u32, turned: bool) -> Option<Command> {
        if fired == 0 && !turned {
            self.rose = RangeRose::new(self.at());
            self.surveys += 1;
        }
        if fired >= self.options.survey_firings {
            self.phase = Phase::Identifying(self.pending.take());
            return None;
        }
        if !turned {
            self.phase = Phase::Surveying { fired, turned: true };
            return Some(self.survey_turn(fired));
        }
        self.phase = Phase::Surveying { fired: fired + 1, turned: false };
        Some(Command::Fire { purpose: Firing::Survey })
    }

    fn survey_turn(&self, fired: u32) -> Command {
        match self.options.survey {
            SurveyMotion::Turret => {
                // Every other survey runs backwards, so that the turret need not come back first.
                let back = self.surveys.is_multiple_of(2);
                let steps = if back { self.options.survey_firings - 1 - fired } else { fired };
                Command::Look { to: Heading::from_radians(f64::from(steps) * self.options.survey_step) }
            }
            SurveyMotion::Body => {
                let heading = Heading::from_radians(self.robot.rotation.angle());
                Command::Turn { to: heading + if fired == 0 { 0.0 } else { self.options.survey_step } }
            }
        }
    }

    /// Where a point at `center` in the track frame lies, seen from the place that the robot was last at.
    fn displacement_to(&self, here: &Here, center: Point2<f64>, covariance: Matrix2<f64>) -> Displacement {
        // At least a centimetre: also a robot that did not move is not at the centre to the micrometre.
        let vector = center - here.center;
        let traveled = self.options.dead_reckoning.covariance(vector, here.driven) + Matrix2::identity() * 1e-4;
        Displacement { vector, covariance: here.covariance + covariance + traveled, turn: None }
    }
}

impl ExplorerOptions {
    fn check(&self) -> Result<(), ExploreError> {
        let positive = [
            ("spacing", self.spacing),
            ("suppression", self.suppression),
            ("link_separation", self.link_separation),
            ("predicted_sigma", self.predicted_sigma),
            ("arrival", self.arrival),
            ("near_enough", self.near_enough),
            ("dead_reckoning.along", self.dead_reckoning.along),
            ("dead_reckoning.sideways", self.dead_reckoning.sideways),
            ("survey_step", self.survey_step),
            ("stride", self.stride),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ExploreError::Option { name, range: "(0, ∞)", value });
            }
        }
        if self.survey_firings == 0 {
            return Err(ExploreError::Option { name: "survey_firings", range: "[1, ∞)", value: 0.0 });
        }
        if !(self.neighbourhood >= 0.0 && self.neighbourhood.is_finite()) {
            return Err(ExploreError::Option { name: "neighbourhood", range: "[0, ∞)", value: self.neighbourhood });
        }
        if !(self.detour >= 1.0 && self.detour.is_finite()) {
            return Err(ExploreError::Option { name: "detour", range: "[1, ∞)", value: self.detour });
        }
        self.obstacles.check()
    }
}

/// What a hop leaves behind when it succeeds or fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HopEnd {
    Arrived,
    Blocked(LinkId),
}

use nalgebra::Isometry2;
use robot_log::local_grid::{Heading, Learnt, LocalMapError, Scan, SensorKind};
use robot_log::{Entry, EntryKind};

use crate::HeadingMode;
use crate::config::Config;
use crate::laser::LaserTrack;
use crate::tracker::Tracker;
use crate::trajectory::Sample;
use crate::wall_heading::{Sight, WallHeading};

/// The lowest level at work: where the robot is, locally, and what is around it now.
#[derive(Debug)]
pub(crate) struct FrontEnd {
    pub(crate) tracker: Tracker,
    /// The scans that hold the pose, once a precise sensor has spoken; never where odometry alone is asked for.
    laser_track: Option<LaserTrack>,
    scans_may_hold: bool,
    /// The walls along which the robot drives, where no scan is precise enough to be matched.
    walls: WallHeading,
    held_by_walls: bool,
    /// Whether the walls take the disturbance out of a compass.
    walls_beside_compass: bool,
    odom_from_robot: Isometry2<f64>,
}

/// What an entry meant to the lowest level.
#[derive(Debug)]
pub(crate) enum Sensed {
    /// Nothing that the higher levels see.
    Nothing,
    /// The whole track frame turned: a first compass reading arrived before any place held it.
    FrameTurned(Isometry2<f64>),
    /// A scan, with the pose at which it was taken.
    Scan(Sample),
}

/// Why a scan cannot be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SenseError {
    /// The robot left the plane that a map of walls can cover.
    #[error("map of walls: {0}")]
    LocalMap(#[from] LocalMapError),
}

impl FrontEnd {
    pub(crate) fn new(config: &Config) -> Self {
        Self {
            tracker: Tracker::new(config),
            laser_track: None,
            scans_may_hold: matches!(config.heading.source, HeadingMode::Auto | HeadingMode::Structure),
            walls: WallHeading::new(config),
            held_by_walls: false,
            walls_beside_compass: false,
            odom_from_robot: Isometry2::identity(),
        }
    }

    /// The same for a robot whose compass is to be freed from its disturbance by the walls beside it.
    pub(crate) fn with_walls_beside_compass(self) -> Self {
        Self { walls_beside_compass: self.scans_may_hold, ..self }
    }

    /// The front end as it was after the last of some samples.
    pub(crate) fn restored(
        config: &Config,
        tracker: Tracker,
        held_by_scans: bool,
        samples: &[Sample],
        walls: Learnt,
    ) -> Result<Self, SenseError> {
        let drawn = || LaserTrack::restored(lasers(samples), walls);
        let laser_track = held_by_scans.then(drawn).transpose()?;
        let mut restored = Self { tracker, laser_track, ..Self::new(config) };
        for sample in samples {
            restored.odom_from_robot = sample.odom_from_robot;
            restored.held_by_walls |= restored.sight_of_walls(&sample.scan).is_some();
        }
        restored.odom_from_robot = restored.tracker.last_odometry().unwrap_or_else(Isometry2::identity);
        Ok(restored)
    }

    /// What precise scans have taught of the building's direction.
    pub(crate) fn known_walls(&self) -> Learnt {
        self.laser_track.as_ref().map(LaserTrack::walls).unwrap_or_default()
    }

    /// Follows one entry.
    pub(crate) fn observe(&mut self, entry: &Entry) -> Result<Sensed, SenseError> {
        match &entry.kind {
            EntryKind::Odometry { odom_from_robot } => {
                self.follow(*odom_from_robot);
                Ok(Sensed::Nothing)
            }
            EntryKind::Heading { heading, deviation } => {
                let turned = self.tracker.observe_heading(entry.stamp, *heading, *deviation);
                self.hear_compass(*heading, *deviation);
                Ok(turned.map_or(Sensed::Nothing, Sensed::FrameTurned))
            }
            EntryKind::Gyro { heading, deviation } => {
                let turned = self.tracker.observe_gyro(entry.stamp, *heading, *deviation);
                Ok(turned.map_or(Sensed::Nothing, Sensed::FrameTurned))
            }
            EntryKind::Scan { odom_from_robot, scan } => {
                if let Some(odom_from_robot) = odom_from_robot {
                    self.follow(*odom_from_robot);
                }
                self.sense(entry.stamp, scan).map(Sensed::Scan)
            }
            _ => Ok(Sensed::Nothing), // truth is for evaluation only
        }
    }

    fn follow(&mut self, odom_from_robot: Isometry2<f64>) {
        self.odom_from_robot = odom_from_robot;
        self.tracker.follow(odom_from_robot);
    }

    /// Whether scans hold the robot's pose.
    pub(crate) fn is_held_by_scans(&self) -> bool {
        self.laser_track.is_some()
    }

    /// Whether the walls of places have turned the heading.
    pub(crate) fn is_held_by_walls(&self) -> bool {
        self.held_by_walls
    }

    /// Lets a compass tie the walls' direction to the world.
    fn hear_compass(&mut self, reading: Heading, deviation: f64) {
        if self.walls_beside_compass && self.tracker.has_compass() {
            let (variance, correlation) = self.tracker.compass_disturbance();
            let reading = reading + -self.tracker.compass_offset();
            self.walls.hear_compass(&self.odom_from_robot, reading, variance + deviation.powi(2), correlation);
        }
    }

    /// What the walls beside the robot say of its heading, where neither gyro nor laser knows better.
    fn sight_of_walls(&mut self, scan: &Scan) -> Option<Sight> {
        let by_compass = self.tracker.has_compass() && !self.walls_beside_compass;
        let known = by_compass || self.tracker.has_gyro() || self.is_held_by_scans();
        let wanted = self.scans_may_hold && !known && scan.sensor().kind() == SensorKind::Sonar;
        if wanted { self.walls.observe(&self.odom_from_robot, scan) } else { None }
    }

    fn sense(&mut self, stamp: f64, scan: &Scan) -> Result<Sample, SenseError> {
        if scan.sensor().kind() == SensorKind::Laser && self.scans_may_hold {
            let predicted = self.tracker.track_from_robot();
            let found = self.laser_track.get_or_insert_with(LaserTrack::new).follow(&predicted, scan)?;
            if let Some(found) = found {
                self.tracker.correct(&found);
            }
        }
        if let Some(sight) = self.sight_of_walls(scan) {
            let held = Heading::from_radians(self.odom_from_robot.rotation.angle()) + sight.turned;
            let track = Heading::from_radians(self.tracker.track_from_robot().rotation.angle());
            let turn = if self.tracker.has_compass() { held - track } else { sight.turn };
            self.tracker.turn_by_walls(turn, sight.variance);
            self.held_by_walls = true;
        }
        let track_from_robot = self.tracker.track_from_robot();
        Ok(Sample {
            stamp,
            track_from_robot,
            odom_from_robot: self.odom_from_robot,
            travelled: self.tracker.travelled(),
            scan: scan.clone(),
        })
    }
}

/// The scans that a map of walls is drawn from, each where it was taken.
fn lasers(samples: &[Sample]) -> impl Iterator<Item = (&Isometry2<f64>, &Scan)> {
    let lasers = samples.iter().filter(|sample| sample.scan.sensor().kind() == SensorKind::Laser);
    lasers.map(|sample| (&sample.track_from_robot, &sample.scan))
}

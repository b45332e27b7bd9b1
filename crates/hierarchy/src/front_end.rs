pub(crate) mod eyes;
pub(crate) mod gyro;
pub(crate) mod laser;
pub(crate) mod tracker;
pub(crate) mod wall_heading;

use nalgebra::Isometry2;
use robot_log::local_grid::{Heading, Learnt, LocalMapError, Scan, SensorKind};
use robot_log::{Entry, EntryKind};

use crate::HeadingMode;
use crate::config::Config;
use crate::front_end::laser::{LaserTrack, tells_a_pose};
use crate::front_end::tracker::Tracker;
pub(crate) use crate::front_end::wall_heading::Direction;
use crate::front_end::wall_heading::{Sight, WallHeading, WallMemory};
use crate::recognize::reach::Held;
use crate::trajectory::Sample;

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
    odom_from_robot: Isometry2<f64>,
}

/// What walls have taught: all of a front end that is neither its tracker nor can be made again from scans.
#[derive(Debug, Default)]
pub(crate) struct Taught {
    /// The building's direction, by precise scans.
    pub(crate) building: Learnt,
    /// The walls that sonars heard; absent in sessions of a time when they were not stored.
    pub(crate) walls: Option<KnownWalls>,
}

/// The walls along which the robot drove, and whether they have turned its heading.
#[derive(Debug)]
pub(crate) struct KnownWalls {
    pub(crate) held: bool,
    pub(crate) memory: WallMemory,
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
            odom_from_robot: Isometry2::identity(),
        }
    }

    /// The front end as it was after the last of some samples.
    pub(crate) fn restored(
        config: &Config,
        tracker: Tracker,
        held_by_scans: bool,
        samples: &[Sample],
        taught: Taught,
    ) -> Result<Self, SenseError> {
        let Taught { building, walls } = taught;
        let drawn = || LaserTrack::restored(lasers(samples), building);
        let laser_track = held_by_scans.then(drawn).transpose()?;
        let mut restored = Self { tracker, laser_track, ..Self::new(config) };
        if let Some(KnownWalls { held, memory }) = walls {
            restored.walls = WallHeading::recalling(config, memory);
            restored.held_by_walls = held;
        } else {
            for sample in samples {
                restored.odom_from_robot = sample.odom_from_robot;
                restored.held_by_walls |= restored.sight_of_walls(&sample.scan).is_some();
            }
        }
        restored.odom_from_robot = restored.tracker.last_odometry().unwrap_or_else(Isometry2::identity);
        Ok(restored)
    }

    /// What walls have taught so far.
    pub(crate) fn taught(&self) -> Taught {
        Taught {
            building: self.laser_track.as_ref().map(LaserTrack::walls).unwrap_or_default(),
            walls: Some(KnownWalls { held: self.held_by_walls, memory: self.walls.memory() }),
        }
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

    /// The robot was carried before the first of these samples: what was known of the building is of no use here, and what they
    /// were laid onto was somewhere else.
    pub(crate) fn set_down(&mut self, samples: &mut [Sample]) -> Result<(), SenseError> {
        self.tracker.set_down();
        self.walls.forget();
        let odom_from_track = self.odom_from_robot * self.tracker.track_from_robot().inverse();
        for sample in &mut *samples {
            sample.track_from_robot = odom_from_track.inv_mul(&sample.odom_from_robot);
        }
        if self.is_held_by_scans() {
            self.laser_track = Some(LaserTrack::restored(lasers(samples), Learnt::default())?);
        }
        Ok(())
    }

    /// Whether scans hold the robot's pose.
    pub(crate) fn is_held_by_scans(&self) -> bool {
        self.laser_track.is_some()
    }

    /// What holds the robot's pose.
    pub(crate) fn held(&self) -> Held {
        match &self.tracker {
            _ if self.is_held_by_scans() => Held::Scans,
            tracker if tracker.has_compass() && self.held_by_walls => Held::Walls, // which free it from its disturbance
            tracker if tracker.has_compass() => Held::Compass,
            tracker if tracker.has_gyro() => Held::Gyro,
            _ if self.held_by_walls => Held::Walls,
            _ => Held::Wheels,
        }
    }

    /// What walls have taught of the building's direction beside a compass; see [`WallHeading::building`].
    pub(crate) fn building(&self) -> Option<Direction> {
        self.walls.building().filter(|_| self.tracker.has_compass())
    }

    /// Whether the walls of places have turned the heading.
    pub(crate) fn is_held_by_walls(&self) -> bool {
        self.held_by_walls
    }

    /// Lets a compass tie the walls' direction to the world; they free it from its disturbance.
    fn hear_compass(&mut self, reading: Heading, deviation: f64) {
        if self.scans_may_hold && self.tracker.has_compass() {
            let (variance, correlation) = self.tracker.compass_disturbance();
            let reading = reading + -self.tracker.compass_offset();
            self.walls.hear_compass(&self.odom_from_robot, reading, variance + deviation.powi(2), correlation);
        }
    }

    /// What the walls beside the robot say of its heading, where neither gyro nor laser knows better.
    fn sight_of_walls(&mut self, scan: &Scan) -> Option<Sight> {
        let known = self.tracker.has_gyro() || self.is_held_by_scans();
        let wanted = self.scans_may_hold && !known && scan.sensor().kind() == SensorKind::Sonar;
        if wanted { self.walls.observe(&self.odom_from_robot, scan) } else { None }
    }

    fn sense(&mut self, stamp: f64, scan: &Scan) -> Result<Sample, SenseError> {
        if scan.sensor().kind() == SensorKind::Laser && self.scans_may_hold && tells_a_pose(scan) {
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
    let lasers = lasers.filter(|sample| tells_a_pose(&sample.scan));
    lasers.map(|sample| (&sample.track_from_robot, &sample.scan))
}

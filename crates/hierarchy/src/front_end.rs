use std::sync::Arc;

use nalgebra::{Isometry2, Point2};
use robot_log::local_grid::{
    FrameError, Fuzzy, LaserRay, Scan, SensorKind, Signature, SignatureOptions, SonarCone, WorkingGrid,
    WorkingGridOptions,
};
use robot_log::{Entry, EntryKind};

use crate::config::Config;
use crate::tracker::Tracker;
use crate::trajectory::Sample;

/// The lowest level at work: where the robot is, locally, and what is around it now.
#[derive(Debug)]
pub(crate) struct FrontEnd {
    pub(crate) tracker: Tracker,
    working: WorkingGrid<Fuzzy>,
    sonar: SonarCone,
    laser: LaserRay,
    signature: SignatureOptions,
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

impl FrontEnd {
    pub(crate) fn new(config: &Config) -> Self {
        Self {
            tracker: Tracker::new(config),
            working: new_window(),
            sonar: SonarCone::default(),
            laser: LaserRay::default(),
            signature: SignatureOptions::default(),
            odom_from_robot: Isometry2::identity(),
        }
    }

    /// Follows one entry.
    pub(crate) fn observe(&mut self, entry: &Entry) -> Result<Sensed, FrameError> {
        match &entry.kind {
            EntryKind::Odometry { odom_from_robot } => {
                self.follow(*odom_from_robot);
                Ok(Sensed::Nothing)
            }
            EntryKind::Heading { heading, deviation } => Ok(self
                .tracker
                .observe_heading(*heading, *deviation)
                .map_or(Sensed::Nothing, |turn| self.turn_frame(turn))),
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

    /// What was drawn in the old orientation is of no use in the new one.
    fn turn_frame(&mut self, turn: Isometry2<f64>) -> Sensed {
        self.working = new_window();
        Sensed::FrameTurned(turn)
    }

    fn sense(&mut self, stamp: f64, scan: &Scan) -> Result<Sample, FrameError> {
        let track_from_robot = self.tracker.track_from_robot();
        match scan.sensor().kind() {
            SensorKind::Sonar => self.working.integrate(&self.sonar, &track_from_robot, scan)?,
            SensorKind::Laser | SensorKind::Infrared => self.working.integrate(&self.laser, &track_from_robot, scan)?,
        }
        Ok(Sample {
            stamp,
            track_from_robot,
            odom_from_robot: self.odom_from_robot,
            travelled: self.tracker.travelled(),
            scan: scan.clone(),
        })
    }

    /// What the surroundings of a point of the track frame look like now, with that point as origin.
    pub(crate) fn signature(&self, track_from_place: Point2<f64>) -> Arc<Signature> {
        Arc::new(self.working.signature(track_from_place, &self.signature))
    }
}

fn new_window() -> WorkingGrid<Fuzzy> {
    WorkingGrid::new(&WorkingGridOptions::default(), Point2::origin()).expect("the default window is a frame")
}

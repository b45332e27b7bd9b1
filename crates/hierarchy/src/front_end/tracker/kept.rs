//! What a session keeps of a tracker.

use nalgebra::{Matrix2, Vector2};

use super::{Tracker, Travel};
use crate::config::Config;
use crate::front_end::gyro::{Gyro, GyroBesideWheels, HeadingDrift};
use crate::session::SessionError;
use crate::session::records::{StoredTracker, isometry, pose};

impl Tracker {
    pub(crate) fn heading_drift(&self) -> HeadingDrift {
        HeadingDrift {
            rest: self.rest.clone(),
            gyro: self.gyro.as_ref().map(Gyro::stored),
            first_heading: self.first_heading,
        }
    }

    pub(crate) fn with_heading_drift(self, drift: HeadingDrift) -> Self {
        let HeadingDrift { rest, gyro, first_heading } = drift;
        Self { rest, gyro: gyro.map(Gyro::restored), first_heading, ..self }
    }

    /// What the gyro knows of the wheels beside it.
    pub(crate) fn gyro_beside_wheels(&self) -> Option<GyroBesideWheels> {
        self.gyro.as_ref().map(Gyro::beside_wheels)
    }

    /// The same tracker, whose gyro knows the wheels beside it.
    pub(crate) fn with_gyro_beside_wheels(self, known: GyroBesideWheels) -> Self {
        Self { gyro: self.gyro.map(|gyro| gyro.knowing_wheels(known)), ..self }
    }

    pub(crate) fn state(&self) -> StoredTracker {
        let Travel { path, distance_variance, position: p, turn_variance, .. } = self.since_place;
        StoredTracker {
            last_odometry: self.last_odometry.as_ref().map(pose),
            track_from_robot: pose(&self.track_from_robot),
            heading_variance: self.heading_variance,
            since_compass: self.since_compass,
            seen_compass: self.seen_compass,
            compass_offset: self.compass_offset,
            tied: self.tied,
            travelled: self.travelled,
            since_place: [path, distance_variance, p[(0, 0)], p[(0, 1)], p[(1, 1)], turn_variance],
        }
    }

    pub(crate) fn restored(config: &Config, state: &StoredTracker) -> Result<Self, SessionError> {
        let [path, distance_variance, xx, xy, yy, turn_variance] = state.since_place;
        let position = Matrix2::new(xx, xy, xy, yy);
        Ok(Self {
            last_odometry: state.last_odometry.as_ref().map(isometry).transpose()?,
            track_from_robot: isometry(&state.track_from_robot)?,
            heading_variance: state.heading_variance,
            since_compass: state.since_compass,
            seen_compass: state.seen_compass,
            compass_offset: state.compass_offset,
            tied: state.tied,
            travelled: state.travelled,
            since_place: Travel { path, distance_variance, position, turn_variance, with_heading: Vector2::zeros() },
            ..Self::new(config)
        })
    }

    /// The same tracker, knowing how what was driven since the last place goes with the heading.
    pub(crate) fn with_travel_along_heading(mut self, covariance: Vector2<f64>) -> Self {
        self.since_place.with_heading = covariance;
        self
    }
}

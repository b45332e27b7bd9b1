mod heading;
mod kept;
mod travel;

use nalgebra::{Isometry2, Matrix3, Vector2};
use robot_log::local_grid::Match;

use crate::config::{Config, HeadingMode};
use crate::front_end::gyro::{Gyro, GyroDrift, RestWatch};
pub use travel::Travel;

/// Dead reckoning with whatever knows the heading best: the robot's pose in the `track` frame, which is locally
/// right and drifts, with the uncertainty gathered since the last place.
///
/// With a compass the frame's axes are the map's and a scalar Kalman filter fuses turns and compass; without, the
/// frame is that of the first pose and the heading drifts with the odometry.
#[derive(Debug, Clone)]
pub struct Tracker {
    noise: Noise,
    source: HeadingMode,
    last_odometry: Option<Isometry2<f64>>,
    track_from_robot: Isometry2<f64>,
    /// Variance of the heading in the track frame, rad².
    heading_variance: f64,
    /// Path driven since the last compass reading that was taken as independent, in metres.
    since_compass: f64,
    seen_compass: bool,
    /// What the compass reads more than the track frame's heading, where that was tied down before the compass spoke.
    compass_offset: f64,
    tied: bool,
    travelled: f64,
    since_place: Travel,
    rest: RestWatch,
    /// By how much the last reading of a compass exceeded the heading, in radians.
    contradicted: f64,
    /// What was taken for a compass until it turned while the robot stood still, with the seconds since it first spoke.
    gyro: Option<Gyro>,
    /// How a gyro that has not spoken yet will drift.
    expected_drift: Option<GyroDrift>,
    first_heading: Option<f64>,
}

/// Noise rates in SI units.
#[derive(Debug, Clone, Copy)]
struct Noise {
    distance_per_m: f64,
    heading_per_m: f64,
    heading_per_rad: f64,
    compass_disturbance: f64,
    compass_correlation: f64,
}

impl Tracker {
    /// A robot at rest at the origin, facing east until a heading is known.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let odometry = &config.odometry;
        let noise = Noise {
            distance_per_m: odometry.distance_m.powi(2),
            heading_per_m: odometry.heading_per_m_deg.to_radians().powi(2),
            heading_per_rad: odometry.heading_per_turn_deg.to_radians().powi(2) / std::f64::consts::TAU,
            compass_disturbance: config.heading.compass_disturbance_deg.to_radians().powi(2),
            compass_correlation: config.heading.compass_correlation_m,
        };
        Self {
            noise,
            source: config.heading.source,
            last_odometry: None,
            track_from_robot: Isometry2::identity(),
            heading_variance: 0.0,
            since_compass: f64::INFINITY,
            seen_compass: false,
            compass_offset: 0.0,
            tied: false,
            travelled: 0.0,
            since_place: Travel::default(),
            rest: RestWatch::default(),
            contradicted: 0.0,
            gyro: None,
            expected_drift: None,
            first_heading: None,
        }
    }

    /// Where the odometry last said that the robot is.
    pub(crate) fn last_odometry(&self) -> Option<Isometry2<f64>> {
        self.last_odometry
    }

    /// The robot in the track frame.
    #[must_use]
    pub fn track_from_robot(&self) -> Isometry2<f64> {
        self.track_from_robot
    }

    /// Path driven since the start, in metres.
    #[must_use]
    pub fn travelled(&self) -> f64 {
        self.travelled
    }

    /// Whether a compass holds the heading.
    #[must_use]
    pub fn has_compass(&self) -> bool {
        self.seen_compass
    }

    /// Whether a gyro tells the turns, which drifts and so holds no heading.
    #[must_use]
    pub fn has_gyro(&self) -> bool {
        self.gyro.is_some()
    }

    /// Says that places hold the track frame from now on: the first compass reading no longer turns it.
    pub fn tie(&mut self) {
        self.tied = true;
    }

    /// What was driven since [`Tracker::depart`].
    #[must_use]
    pub fn since_place(&self) -> &Travel {
        &self.since_place
    }

    /// Starts to gather uncertainty anew, from a place.
    pub fn depart(&mut self) {
        self.since_place = Travel::default();
        if let Some(gyro) = &mut self.gyro {
            gyro.depart();
        }
    }

    /// Follows the odometry to its next pose; the first pose sets where it starts.
    pub fn follow(&mut self, odom_from_robot: Isometry2<f64>) {
        let Some(last) = self.last_odometry.replace(odom_from_robot) else {
            self.track_from_robot = Isometry2::rotation(odom_from_robot.rotation.angle());
            return;
        };
        self.advance(last.inverse() * odom_from_robot);
    }

    /// Moves by a step in the robot's own frame.
    fn advance(&mut self, step: Isometry2<f64>) {
        let (length, turn) = (step.translation.vector.norm(), step.rotation.angle().abs());
        let turn_noise = self.noise.heading_per_m * length + self.noise.heading_per_rad * turn;
        let moved = self.track_from_robot.rotation * step.translation.vector;
        // The heading's own error turns every later step: to first order it moves the robot sideways, and always to the
        // side on which it was moved before.
        let sideways = Vector2::new(-moved.y, moved.x);
        let heading_variance = if self.seen_compass { self.heading_variance } else { self.since_place.turn_variance };
        let travel = &mut self.since_place;
        let again = sideways * travel.with_heading.transpose();
        travel.position += again
            + again.transpose()
            + sideways * sideways.transpose() * heading_variance
            + moved * moved.transpose() * (self.noise.distance_per_m / length.max(1e-9));
        travel.with_heading += sideways * heading_variance;
        travel.distance_variance += self.noise.distance_per_m * length;
        travel.path += length;
        self.since_place.turn_variance += turn_noise;
        self.heading_variance += turn_noise;
        let moved = length > 0.0 || turn > 0.0;
        if moved {
            self.rest.moved();
        }
        match &mut self.gyro {
            Some(gyro) if moved => gyro.moved(),
            Some(gyro) => gyro.rested(),
            None => {}
        }
        self.travelled += length;
        self.since_compass += length;
        self.track_from_robot *= step;
    }

    /// The robot was carried: a compass alone knows how it is turned now.
    pub(crate) fn set_down(&mut self) {
        let turn = self.contradicted();
        self.turn_in_place(turn);
        self.contradicted = 0.0;
        if self.seen_compass {
            self.heading_variance = self.noise.compass_disturbance;
            self.since_compass = 0.0;
        }
        self.depart();
    }

    /// Turns the robot, and nothing before.
    fn turn_in_place(&mut self, turn: f64) {
        let position = self.track_from_robot.translation;
        let turned = nalgebra::UnitComplex::new(turn) * self.track_from_robot.rotation;
        self.track_from_robot = Isometry2::from_parts(position, turned);
    }

    /// Replaces the pose by the one at which a scan fits its surroundings.
    ///
    /// What was gathered since the last place is fused with the covariance of the fit, which counts twice because the
    /// place was left with a fit of its own. Along an axis of which the scan says nothing odometry keeps its word.
    pub fn correct(&mut self, found: &Match) {
        self.track_from_robot = found.map_from_robot;
        let information = |covariance: Matrix3<f64>| (covariance + Matrix3::identity() * 1e-10).try_inverse();
        let mut dead = self.since_place.covariance();
        if self.seen_compass {
            dead[(2, 2)] = self.heading_variance;
        }
        let sum = information(dead).zip(information(found.covariance * 2.0));
        let Some(fused) = sum.and_then(|(dead, fit)| (dead + fit).try_inverse()) else { return };
        self.since_place.position = fused.fixed_view::<2, 2>(0, 0).into_owned();
        self.since_place.with_heading = fused.fixed_view::<2, 1>(0, 2).into_owned();
        self.since_place.turn_variance = fused[(2, 2)];
        self.heading_variance = self.heading_variance.min(fused[(2, 2)]);
    }
}

#[cfg(test)]
mod tests {
    use robot_log::local_grid::Heading;

    use super::*;

    fn drive(tracker: &mut Tracker, meters: i32) {
        for step in 0..=meters * 10 {
            tracker.follow(Isometry2::translation(f64::from(step) * 0.1, 0.0));
        }
    }

    #[test]
    fn uncertainty_grows_with_the_root_of_the_path() {
        let mut tracker = Tracker::new(&Config::default());
        drive(&mut tracker, 4);
        let travel = tracker.since_place();
        approx::assert_relative_eq!(travel.path, 4.0, epsilon = 1e-9);
        approx::assert_relative_eq!(travel.position[(0, 0)].sqrt(), 0.05 * 2.0, epsilon = 1e-9);
        approx::assert_relative_eq!(travel.turn_variance.sqrt(), 3f64.to_radians(), epsilon = 1e-9);
        assert!(travel.position[(1, 1)] > 0.0, "an uncertain heading moves the robot sideways");
    }

    #[test]
    fn the_first_compass_reading_turns_the_frame() {
        let mut tracker = Tracker::new(&Config::default());
        tracker.follow(Isometry2::identity());
        let turn = tracker.observe_heading(0.0, Heading::from_radians(1.0), 0.01).unwrap();
        approx::assert_relative_eq!(turn.rotation.angle(), 1.0);
        approx::assert_relative_eq!(tracker.track_from_robot().rotation.angle(), 1.0);
    }

    #[test]
    fn a_compass_that_speaks_late_finds_the_frame_tied() {
        let mut tracker = Tracker::new(&Config::default());
        tracker.follow(Isometry2::identity());
        tracker.tie();
        assert_eq!(tracker.observe_heading(0.0, Heading::from_radians(1.0), 0.01), None);
        approx::assert_relative_eq!(tracker.track_from_robot().rotation.angle(), 0.0);
    }

    #[test]
    fn a_compass_holds_the_heading_against_drift() {
        let mut tracker = Tracker::new(&Config::default());
        let mut odometry = Isometry2::identity();
        tracker.follow(odometry);
        for _ in 0..2000 {
            tracker.observe_heading(0.0, Heading::from_radians(0.0), 0.01);
            odometry *= Isometry2::new(Vector2::new(0.1, 0.0), 0.001); // 0.57° per metre
            tracker.follow(odometry);
        }
        assert!(odometry.rotation.angle().abs() > 1.0 && tracker.track_from_robot().rotation.angle().abs() < 0.1);
    }

    #[test]
    fn a_compass_at_rest_says_the_same_thing_again() {
        let mut tracker = Tracker::new(&Config::default());
        tracker.follow(Isometry2::identity());
        for _ in 0..1000 {
            tracker.observe_heading(0.0, Heading::from_radians(0.0), 0.01);
        }
        assert!(tracker.heading_variance > 0.9 * 4f64.to_radians().powi(2));
    }
}

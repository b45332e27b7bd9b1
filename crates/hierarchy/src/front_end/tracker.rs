use nalgebra::{Isometry2, Matrix2, Matrix3, Rotation2, Vector2, Vector3};
use robot_log::local_grid::{Heading, Match};

use crate::config::{Config, HeadingMode};
use crate::front_end::gyro::{Gyro, GyroBesideWheels, GyroDrift, HeadingDrift, RestWatch};
use crate::session::SessionError;
use crate::session::records::{StoredTracker, isometry, pose};

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

/// What was driven between two moments, with the uncertainty that it gathered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Travel {
    /// Summed length of the steps, in metres.
    pub path: f64,
    /// Variance of the distance driven, in m², along the robot's heading.
    pub distance_variance: f64,
    /// Covariance of the displacement in the track frame, in m², the heading at the start taken as right.
    pub position: Matrix2<f64>,
    /// Variance of the turn, in rad².
    pub turn_variance: f64,
    /// Covariance of the displacement with the heading at its end, in m·rad.
    pub with_heading: Vector2<f64>,
}

impl Default for Travel {
    fn default() -> Self {
        Self {
            path: 0.0,
            distance_variance: 0.0,
            position: Matrix2::zeros(),
            turn_variance: 0.0,
            with_heading: Vector2::zeros(),
        }
    }
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

    pub(crate) fn heading_drift(&self) -> HeadingDrift {
        HeadingDrift {
            rest: self.rest.clone(),
            gyro: self.gyro.as_ref().map(Gyro::stored),
            first_heading: self.first_heading,
        }
    }

    /// Says how the gyro, which has not spoken yet, will drift at first.
    pub(crate) fn expect_drift(&mut self, drift: GyroDrift) {
        self.expected_drift = Some(drift);
    }

    /// What the gyro knows of the wheels beside it.
    pub(crate) fn gyro_beside_wheels(&self) -> Option<GyroBesideWheels> {
        self.gyro.as_ref().map(Gyro::beside_wheels)
    }

    /// The same tracker, whose gyro knows the wheels beside it.
    pub(crate) fn with_gyro_beside_wheels(self, known: GyroBesideWheels) -> Self {
        Self { gyro: self.gyro.map(|gyro| gyro.knowing_wheels(known)), ..self }
    }

    pub(crate) fn with_heading_drift(self, drift: HeadingDrift) -> Self {
        let HeadingDrift { rest, gyro, first_heading } = drift;
        Self { rest, gyro: gyro.map(Gyro::restored), first_heading, ..self }
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

    /// Takes a compass reading into account; returns the turn of the whole frame when it is the first one.
    ///
    /// Once places hold the frame, the first reading no longer turns it but is remembered as the compass' offset.
    ///
    /// A compass indoors is disturbed by a field that stays the same over some distance: readings closer together
    /// than that are not independent, so that each counts only for the path driven since the last.
    ///
    /// What goes on turning while the robot stands still is no compass but a gyro, and tells turns from then on.
    pub fn observe_heading(&mut self, stamp: f64, heading: Heading, deviation: f64) -> Option<Isometry2<f64>> {
        if matches!(self.source, HeadingMode::Structure | HeadingMode::Odometry) {
            return None;
        }
        let passed = self.rest.read(stamp, heading.radians());
        if self.gyro.is_some() {
            self.turn_by_gyro(passed.unwrap_or(0.0), heading);
            return None;
        }
        let elapsed = stamp - *self.first_heading.get_or_insert(stamp);
        let may_rest = self.last_odometry.is_some(); // without odometry it may turn all the time
        let drift = self.rest.drift().filter(|_| may_rest && self.seen_compass);
        if let (HeadingMode::Auto, Some(drift)) = (self.source, drift) {
            let held = innovation_of(heading, self.compass_offset + drift.0 * elapsed, &self.track_from_robot);
            self.turn_in_place(held);
            self.gyro = Some(Gyro::drifting(drift, elapsed));
            self.seen_compass = false;
            return None;
        }
        let innovation = innovation_of(heading, self.compass_offset, &self.track_from_robot);
        let variance = deviation.powi(2) + self.noise.compass_disturbance;
        if !self.seen_compass {
            self.seen_compass = true;
            self.heading_variance = variance;
            self.since_compass = 0.0;
            if self.tied {
                self.compass_offset = innovation;
                return None;
            }
            let turn = Isometry2::rotation(innovation);
            self.track_from_robot = turn * self.track_from_robot;
            return Some(turn);
        }
        self.contradicted = innovation;
        let novelty = (self.since_compass / self.noise.compass_correlation).min(1.0);
        if novelty <= 0.0 {
            return None;
        }
        let gain = self.heading_variance / (self.heading_variance + variance / novelty);
        self.since_compass = 0.0;
        self.turn_by(innovation * gain, gain);
        None
    }

    /// By how much the last reading of a compass exceeded the heading, in radians; 0 without one.
    pub(crate) fn contradicted(&self) -> f64 {
        if self.seen_compass { self.contradicted } else { 0.0 }
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

    /// Takes into account what a gyro has added up; the turn of the frame, where `--heading compass` takes it for one.
    pub fn observe_gyro(&mut self, stamp: f64, heading: Heading, deviation: f64) -> Option<Isometry2<f64>> {
        match self.source {
            HeadingMode::Structure | HeadingMode::Odometry => return None,
            HeadingMode::Compass => return self.observe_heading(stamp, heading, deviation),
            HeadingMode::Auto => {}
        }
        let passed = self.rest.read(stamp, heading.radians());
        if self.gyro.is_none() {
            let gyro = Gyro::new(deviation);
            self.gyro = Some(self.expected_drift.map_or(gyro.clone(), |drift| gyro.expecting(drift)));
            self.compass_offset = innovation_of(heading, 0.0, &self.track_from_robot);
        }
        self.turn_by_gyro(passed.unwrap_or(0.0), heading);
        None
    }

    fn turn_by_gyro(&mut self, seconds: f64, reading: Heading) {
        let Some(gyro) = &mut self.gyro else { return };
        let believed = self.track_from_robot.rotation.angle() + self.compass_offset;
        let correction = gyro.read(seconds, reading.radians(), believed);
        let turn_variance = gyro.turn_variance();
        self.since_place.know_turn_to(turn_variance);
        self.turn_in_place(correction);
    }

    /// Turns the robot by what walls say, which leaves its heading uncertain by `variance` against their direction.
    pub(crate) fn turn_by_walls(&mut self, turn: f64, variance: f64) {
        let gain = (1.0 - variance / self.heading_variance.max(f64::MIN_POSITIVE)).max(0.0);
        self.turn_by(turn, gain);
        // The place was left with a heading of its own, about as uncertain.
        self.since_place.turn_variance = self.since_place.turn_variance.min(2.0 * variance);
    }

    /// A Kalman filter's step: turns the robot by what was learnt of its heading, and puts it where that heading would have
    /// led it from the last place. The heading's variance falls by a share `gain`.
    fn turn_by(&mut self, turn: f64, gain: f64) {
        let travel = &mut self.since_place;
        // Without a compass the displacement goes with the turn since the place, which walls may leave less sure.
        let variance =
            if self.seen_compass { self.heading_variance } else { self.heading_variance.max(travel.turn_variance) };
        if variance > 0.0 {
            let shift = travel.with_heading / variance;
            self.track_from_robot.translation.vector += shift * turn;
            travel.position -= shift * shift.transpose() * (gain * variance);
            travel.with_heading *= 1.0 - gain;
        }
        self.heading_variance *= 1.0 - gain;
        self.turn_in_place(turn);
    }

    /// The variance of a compass' disturbance, rad², and over how many metres it is the same.
    pub(crate) fn compass_disturbance(&self) -> (f64, f64) {
        (self.noise.compass_disturbance, self.noise.compass_correlation)
    }

    /// What the compass reads more than the track frame's heading.
    pub(crate) fn compass_offset(&self) -> f64 {
        self.compass_offset
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

/// By how much a reading that is `offset` too large exceeds the heading that the pose has, in `(−π, π]`.
fn innovation_of(reading: Heading, offset: f64, track_from_robot: &Isometry2<f64>) -> f64 {
    reading + -offset - Heading::from_radians(track_from_robot.rotation.angle())
}

impl Travel {
    /// The covariance of (x, y, heading) in the track frame.
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        let mut covariance = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, self.turn_variance));
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&self.position);
        covariance.fixed_view_mut::<2, 1>(0, 2).copy_from(&self.with_heading);
        covariance.fixed_view_mut::<1, 2>(2, 0).copy_from(&self.with_heading.transpose());
        covariance
    }

    /// The turn is known better, by something that says nothing of the displacement.
    fn know_turn_to(&mut self, variance: f64) {
        if variance < self.turn_variance {
            self.with_heading *= variance / self.turn_variance;
            self.turn_variance = variance;
        }
    }

    /// The covariance of the displacement in a frame turned by `−heading`, with a floor of `floor` metres.
    #[must_use]
    pub fn position_in(&self, heading: f64, floor: f64) -> Matrix2<f64> {
        let turn = Rotation2::new(-heading);
        turn * self.position * turn.transpose() + Matrix2::identity() * floor.powi(2)
    }
}

#[cfg(test)]
mod tests {
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

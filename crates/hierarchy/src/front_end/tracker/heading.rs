//! What a tracker learns of its heading from a compass, a gyro, or walls.

use nalgebra::Isometry2;
use robot_log::local_grid::Heading;

use super::Tracker;
use crate::config::HeadingMode;
use crate::front_end::gyro::{Gyro, GyroDrift};

impl Tracker {
    /// Says how the gyro, which has not spoken yet, will drift at first.
    pub(crate) fn expect_drift(&mut self, drift: GyroDrift) {
        self.expected_drift = Some(drift);
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
}

/// By how much a reading that is `offset` too large exceeds the heading that the pose has, in `(−π, π]`.
fn innovation_of(reading: Heading, offset: f64, track_from_robot: &Isometry2<f64>) -> f64 {
    reading + -offset - Heading::from_radians(track_from_robot.rotation.angle())
}

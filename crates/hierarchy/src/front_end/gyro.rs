use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Watches a heading while the wheels rest: a compass stays where it is, a gyro's heading goes on turning.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RestWatch {
    /// The latest reading: seconds, radians.
    last: Option<(f64, f64)>,
    /// When the wheels last turned; `None` while they never did.
    stopped: Option<f64>,
    moved: bool,
    /// Of all turns per second read at rest: how many, their sum, the sum of their squares.
    readings: f64,
    sum: f64,
    squares: f64,
}

/// A damped compass may take so many seconds to settle after a turn: five time constants of one second.
const SETTLES: f64 = 5.0;
/// The least readings at rest that say anything.
const LEAST_READINGS: f64 = 4.0;
/// Standard errors by which the mean turn at rest must differ from none.
const SIGNIFICANT: f64 = 5.0;
/// A drift slower than this, in radians per second, is a compass' for our purposes: 20° in a quarter of an hour.
const SLOWEST: f64 = 4e-4;

impl RestWatch {
    /// The wheels have turned.
    pub(crate) fn moved(&mut self) {
        self.moved = true;
    }

    /// Takes a reading: seconds and radians; answers the seconds since the one before.
    pub(crate) fn read(&mut self, stamp: f64, heading: f64) -> Option<f64> {
        let moved = std::mem::take(&mut self.moved);
        if moved {
            self.stopped = Some(stamp);
        }
        let (before, from) = self.last.replace((stamp, heading))?;
        let (seconds, turned) = (stamp - before, wrapped(heading - from));
        if seconds <= 0.0 {
            return None;
        }
        if !moved && self.stopped.is_none_or(|stopped| before - stopped >= SETTLES) {
            self.readings += 1.0;
            self.sum += turned / seconds;
            self.squares += (turned / seconds).powi(2);
        }
        Some(seconds)
    }

    /// Radians per second by which the heading turns at rest, with their variance; `None` where it does not.
    pub(crate) fn drift(&self) -> Option<(f64, f64)> {
        if self.readings < LEAST_READINGS {
            return None;
        }
        let mean = self.sum / self.readings;
        let variance = (self.squares / self.readings - mean * mean).max(0.0) / (self.readings - 1.0);
        let drifts = mean.abs() > SLOWEST && mean.abs() > SIGNIFICANT * variance.sqrt();
        drifts.then_some((mean, variance + SLOWEST * SLOWEST))
    }
}

/// Holds a heading by a gyro that drifts, and learns how fast: a Kalman filter over
///
/// ```text
/// ψ  the robot's heading: the wheels turn it, with their noise
/// β  what the gyro reads more than that: grows by b every second
/// b  its drift, in radians per second, nearly constant
/// z = ψ + β
/// ```
///
/// So the gyro tells turns, which wheels that slip do not, and the wheels tell the drift, above all while they rest.
/// The heading itself is held by neither: it drifts like any dead reckoning, only slowly.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Gyro {
    beta: f64,
    drift: f64,
    covariance: Matrix3<f64>,
    /// Standard deviation of one reading, in radians.
    reading: f64,
    /// Seconds since the last place.
    since_place: f64,
}

/// What a session keeps of a gyro: `β`, `b`, the covariance, the deviation of a reading, the seconds since the last place.
pub(crate) type StoredGyro = (f64, f64, [f64; 9], f64, f64);

/// What a session keeps of the watch over a heading's drift.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct HeadingDrift {
    pub(crate) rest: RestWatch,
    pub(crate) gyro: Option<StoredGyro>,
    pub(crate) first_heading: Option<f64>,
}

/// Standard deviation of a reading, in radians, of what was taken for a compass: rounded to a degree, or late by a moment.
const READING: f64 = 0.0175;
/// How fast a gyro of which nothing is known yet may drift, as a standard deviation in radians per second: 1° in each.
const UNKNOWN_DRIFT: f64 = 0.0175;
/// The least standard deviation of a turn between two places, in radians: no gyro's scale is exact.
const TURN: f64 = 0.01;
/// Variance by which the drift changes in a second, (rad/s)²: by 0.1°/s in a minute.
const DRIFT_WALK: f64 = 5e-8;

impl Gyro {
    /// A gyro of which nothing is known but the deviation of a reading.
    pub(crate) fn new(reading: f64) -> Self {
        let covariance = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, UNKNOWN_DRIFT * UNKNOWN_DRIFT));
        Self { beta: 0.0, drift: 0.0, covariance, reading, since_place: 0.0 }
    }

    /// A gyro that was taken for a compass for `elapsed` seconds while it drifted by `drift` ± `variance`.
    pub(crate) fn drifting((drift, variance): (f64, f64), elapsed: f64) -> Self {
        let jacobian = Vector3::new(-elapsed, elapsed, 1.0);
        let covariance = jacobian * variance * jacobian.transpose() + Matrix3::from_diagonal_element(1e-8);
        Self { beta: drift * elapsed, drift, covariance, reading: READING, since_place: elapsed }
    }

    pub(crate) fn stored(&self) -> StoredGyro {
        let mut covariance = [0.0; 9];
        covariance.copy_from_slice(self.covariance.as_slice());
        (self.beta, self.drift, covariance, self.reading, self.since_place)
    }

    pub(crate) fn restored((beta, drift, covariance, reading, since_place): StoredGyro) -> Self {
        Self { beta, drift, covariance: Matrix3::from_column_slice(&covariance), reading, since_place }
    }

    /// The wheels turned the heading, with this variance.
    pub(crate) fn turned(&mut self, variance: f64) {
        self.covariance[(0, 0)] += variance;
    }

    /// Takes a reading, `seconds` after the one before, of a robot believed to face `heading`; answers the correction.
    pub(crate) fn read(&mut self, seconds: f64, reading: f64, heading: f64) -> f64 {
        self.beta += self.drift * seconds;
        self.since_place += seconds;
        let mut step = Matrix3::identity();
        step[(1, 2)] = seconds;
        let mut p = step * self.covariance * step.transpose();
        p[(2, 2)] += DRIFT_WALK * seconds;
        let innovation = wrapped(reading - heading - self.beta);
        let seen = Vector3::new(1.0, 1.0, 0.0);
        let variance = seen.dot(&(p * seen)) + self.reading * self.reading;
        let gain = p * seen / variance;
        let kept = Matrix3::identity() - gain * seen.transpose();
        self.covariance = kept * p * kept.transpose() + gain * gain.transpose() * self.reading.powi(2); // Joseph's form
        self.beta += gain[1] * innovation;
        self.drift += gain[2] * innovation;
        gain[0] * innovation
    }

    /// Variance of the turn since the last place, in rad²: that of the drift. The errors of readings do not add up.
    pub(crate) fn turn_variance(&self) -> f64 {
        TURN * TURN + self.covariance[(2, 2)] * self.since_place * self.since_place
    }

    /// The robot is at a new place.
    pub(crate) fn depart(&mut self) {
        self.since_place = 0.0;
    }
}

fn wrapped(angle: f64) -> f64 {
    nalgebra::UnitComplex::new(angle).angle()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that turns to and fro, resting in between, whose gyro reads whole degrees and drifts by 5.6° a second.
    fn drive(drift: f64) -> (f64, Option<f64>) {
        let (mut watch, mut gyro, mut heading, mut believed) = (RestWatch::default(), None::<Gyro>, 0.0f64, 0.0f64);
        for k in 0..1200u32 {
            let stamp = 0.3 * f64::from(k);
            let turn = if k % 12 < 5 { 0.0 } else { 0.2 * (f64::from(k) * 0.05).sin() };
            let wheels = turn * if k % 2 == 0 { 1.1 } else { 0.9 }; // they slip
            heading += turn;
            believed += wheels;
            if turn != 0.0 {
                watch.moved();
            }
            let reading = (heading + drift * stamp).to_degrees().round().to_radians();
            let Some(seconds) = watch.read(stamp, reading) else { continue };
            match &mut gyro {
                Some(gyro) => {
                    gyro.turned(0.01 * turn.abs());
                    believed += gyro.read(seconds, reading, believed);
                }
                None => {
                    gyro = watch.drift().map(|drift| Gyro::drifting(drift, stamp));
                    let drifted = gyro.as_ref().map_or(0.0, |gyro| gyro.beta);
                    believed = if gyro.is_some() { reading - drifted } else { believed };
                }
            }
        }
        (wrapped(believed - heading), gyro.map(|gyro| gyro.drift))
    }

    #[test]
    fn a_drift_is_noticed_at_rest_and_taken_away() {
        let (off, drift) = drive(0.098);
        assert!(off.abs() < 0.1, "{} degrees off", off.to_degrees());
        approx::assert_relative_eq!(drift.unwrap(), 0.098, epsilon = 0.002);
    }

    #[test]
    fn a_compass_that_settles_late_does_not_drift() {
        assert_eq!(drive(0.0).1, None);
        let mut watch = RestWatch::default();
        let (mut reading, mut heading) = (0.0, 0.0);
        for k in 0..2000u32 {
            if k % 100 < 10 {
                heading += 0.05;
                watch.moved();
            }
            reading += 0.1 * (heading - reading); // at ten readings a second: settles within a second
            watch.read(0.1 * f64::from(k), reading + 0.01 * f64::from(k % 3));
        }
        assert_eq!(watch.drift(), None);
    }
}

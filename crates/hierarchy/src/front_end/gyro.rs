use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

mod rest;
mod survey;
mod watch;

pub(crate) use rest::Rest;
pub use survey::{GyroDrift, GyroSurvey};
pub(crate) use watch::RestWatch;

/// Holds a heading by a gyro that drifts, and learns how fast: a Kalman filter over
///
/// ```text
/// ψ  the robot's heading: stays while the wheels rest, may be any after they turned
/// β  what the gyro reads more than that: grows by b every second
/// b  its drift, in radians per second, nearly constant
/// z = ψ + β
/// ```
///
/// So the gyro alone tells turns, and the drift is learnt where it is all that turns: at rest. What wheels say of a turn is
/// not used, since they slip by the same share in every turn to one side, which looks like drift however it is weighed.
/// The heading itself drifts like any dead reckoning, only slowly.
///
/// A gyro is calibrated and drifts hardly, or it is not: it is taken for calibrated until a [`Rest`] shows otherwise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Gyro {
    beta: f64,
    drift: f64,
    covariance: Matrix3<f64>,
    /// Standard deviation of one reading, in radians.
    reading: f64,
    /// Seconds since the last place.
    since_place: f64,
    wheels: WheelsSince,
    rest: Rest,
}

/// What the wheels did, and the gyro read, since the last reading that was compared with them.
///
/// Where the gyro speaks more often than the wheels, most readings wait: what has not been told yet is no rest.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct WheelsSince {
    pub(crate) told: bool,
    pub(crate) moved: bool,
    /// The gyro's: its latest reading, and over how many seconds it turned by how much.
    pub(crate) last: Option<f64>,
    pub(crate) seconds: f64,
    pub(crate) turned: f64,
}

/// What a session keeps of a gyro: `β`, `b`, the covariance, the deviation of a reading, the seconds since the last place.
pub(crate) type StoredGyro = (f64, f64, [f64; 9], f64, f64);

/// What a session keeps of a gyro besides: what wheels told since the last reading, and the rest.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct GyroBesideWheels {
    pub(crate) wheels: WheelsSince,
    pub(crate) rest: Rest,
}

/// What a session keeps of the watch over a heading's drift.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct HeadingDrift {
    pub(crate) rest: RestWatch,
    pub(crate) gyro: Option<StoredGyro>,
    pub(crate) first_heading: Option<f64>,
}

/// Standard deviation of a reading, in radians, of what was taken for a compass: rounded to a degree, or late by a moment.
const READING: f64 = 0.0175;
/// How fast a calibrated gyro may drift, as a standard deviation in radians per second: 0.05° in each.
const CALIBRATED_DRIFT: f64 = 0.000_87;
/// The least standard deviation of a turn between two places, in radians: no gyro's scale is exact.
const TURN: f64 = 0.01;
/// Variance of the heading after wheels turned: as good as unknown.
const ANY_TURN: f64 = 1.0;
/// Variance by which the drift changes in a second, (rad/s)²: by 0.03°/s in a minute.
const DRIFT_WALK: f64 = 5e-9;

impl Gyro {
    /// A gyro of which nothing is known but the deviation of a reading.
    pub(crate) fn new(reading: f64) -> Self {
        let covariance = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, CALIBRATED_DRIFT * CALIBRATED_DRIFT));
        Self::restored((0.0, 0.0, matrix_numbers(&covariance), reading, 0.0))
    }

    /// The same gyro, which is known to drift.
    pub(crate) fn expecting(self, drift: GyroDrift) -> Self {
        let covariance = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, drift.variance));
        Self { drift: drift.rate, covariance, ..self }
    }

    /// A gyro that was taken for a compass for `elapsed` seconds while it drifted by `drift` ± `variance`.
    pub(crate) fn drifting((drift, variance): (f64, f64), elapsed: f64) -> Self {
        let jacobian = Vector3::new(-elapsed, elapsed, 1.0);
        let covariance = jacobian * variance * jacobian.transpose() + Matrix3::from_diagonal_element(1e-8);
        Self::restored((drift * elapsed, drift, matrix_numbers(&covariance), READING, elapsed))
    }

    pub(crate) fn stored(&self) -> StoredGyro {
        (self.beta, self.drift, matrix_numbers(&self.covariance), self.reading, self.since_place)
    }

    pub(crate) fn beside_wheels(&self) -> GyroBesideWheels {
        GyroBesideWheels { wheels: self.wheels, rest: self.rest }
    }

    /// The filter as it was stored, of which it is not known whether the wheels rest.
    pub(crate) fn restored((beta, drift, covariance, reading, since_place): StoredGyro) -> Self {
        let covariance = Matrix3::from_column_slice(&covariance);
        let (wheels, rest) = (WheelsSince::default(), Rest::default());
        Self { beta, drift, covariance, reading, since_place, wheels, rest }
    }

    /// The same gyro, with what it knew of the wheels.
    pub(crate) fn knowing_wheels(self, GyroBesideWheels { wheels, rest }: GyroBesideWheels) -> Self {
        Self { wheels, rest, ..self }
    }

    /// The wheels moved the robot.
    pub(crate) fn moved(&mut self) {
        self.covariance[(0, 0)] += ANY_TURN;
        self.wheels.told = true;
        self.wheels.moved = true;
    }

    /// The wheels say that they rest.
    pub(crate) fn rested(&mut self) {
        self.wheels.told = true;
    }

    /// Takes a reading, `seconds` after the one before, of a robot believed to face `heading`; answers the correction.
    pub(crate) fn read(&mut self, seconds: f64, reading: f64, heading: f64) -> f64 {
        self.beta += self.drift * seconds;
        self.since_place += seconds;
        let mut step = Matrix3::identity();
        step[(1, 2)] = seconds;
        self.covariance = step * self.covariance * step.transpose();
        self.covariance[(2, 2)] += DRIFT_WALK * seconds;
        let innovation = wrapped(reading - heading - self.beta);
        let Some(last) = self.wheels.last.replace(reading) else {
            self.wheels = WheelsSince { last: Some(reading), ..WheelsSince::default() };
            return self.correct(innovation);
        };
        self.wheels.seconds += seconds;
        self.wheels.turned += wrapped(reading - last);
        if !self.wheels.told {
            return 0.0;
        }
        self.compare();
        self.correct(innovation)
    }

    /// Learns from what gyro and wheels said of the same time.
    fn compare(&mut self) {
        let WheelsSince { moved, last, seconds, turned, .. } = self.wheels;
        self.wheels = WheelsSince { last, ..WheelsSince::default() };
        let noise = 2.0 * self.reading * self.reading; // of a difference of two readings
        let unexplained = turned - self.drift * seconds;
        if moved {
            self.rest.ends(seconds);
        } else if let Some(surprise) = self.rest.goes_on(seconds, unexplained, noise, self.covariance[(2, 2)]) {
            // As if the drift had been unknown all the time since it was last seen to be right.
            let jacobian = Vector3::new(-surprise.driven, surprise.driven + surprise.rested, 1.0);
            self.covariance += jacobian * surprise.rate.powi(2) * jacobian.transpose();
        }
    }

    /// A step of the filter: the reading is so much larger than was expected.
    fn correct(&mut self, innovation: f64) -> f64 {
        let (p, seen) = (self.covariance, Vector3::new(1.0, 1.0, 0.0));
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

fn matrix_numbers(matrix: &Matrix3<f64>) -> [f64; 9] {
    let mut numbers = [0.0; 9];
    numbers.copy_from_slice(matrix.as_slice());
    numbers
}

fn wrapped(angle: f64) -> f64 {
    nalgebra::UnitComplex::new(angle).angle()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tell(gyro: &mut Gyro, turn: f64) {
        if turn == 0.0 {
            gyro.rested();
        } else {
            gyro.moved();
        }
    }

    /// A robot that turns to and fro, resting in between, whose gyro reads whole degrees and drifts: by how much it errs, in
    /// radians, and the gyro.
    fn drive(drift: f64) -> (f64, Option<Gyro>) {
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
                    tell(gyro, turn);
                    believed += gyro.read(seconds, reading, believed);
                }
                None => {
                    gyro = watch.drift().map(|drift| Gyro::drifting(drift, stamp));
                    let drifted = gyro.as_ref().map_or(0.0, |gyro| gyro.beta);
                    believed = if gyro.is_some() { reading - drifted } else { believed };
                }
            }
        }
        (wrapped(believed - heading), gyro)
    }

    #[test]
    fn a_drift_is_noticed_at_rest_and_taken_away() {
        let (off, gyro) = drive(0.098);
        errs_as_it_says(off, &gyro.unwrap(), 0.098);
    }

    /// The variance of `β` is that of the heading, since only their sum is read.
    fn errs_as_it_says(off: f64, gyro: &Gyro, drift: f64) {
        let (sigma, drift_sigma) = (gyro.covariance[(1, 1)].sqrt(), gyro.covariance[(2, 2)].sqrt());
        let said =
            format!("{:.1}° ± {:.1}° off, drift {} ± {drift_sigma}", off.to_degrees(), sigma.to_degrees(), gyro.drift);
        assert!(off.abs() < 3.0 * sigma && (gyro.drift - drift).abs() < 3.0 * drift_sigma, "{said}");
        assert!(drift_sigma < 0.002 && sigma < 0.8, "{said}");
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

    /// Wheels that overdo each turn to the left by a fifth, beside a gyro that rests for some seconds now and then.
    fn beside_slipping_wheels(drift: impl Fn(f64) -> f64) {
        let (mut gyro, mut heading, mut believed, mut drifted) = (Gyro::new(0.01), 0.0f64, 0.0f64, 0.0f64);
        for k in 0..1500u32 {
            let turn = if k % 60 < 12 { 0.0 } else { 0.1 * (f64::from(k) * 0.2).sin() };
            heading += turn;
            believed += turn + 0.2 * turn.max(0.0);
            let reading = (heading + drifted).to_degrees().round().to_radians();
            tell(&mut gyro, turn);
            believed += gyro.read(if k == 0 { 0.0 } else { 0.3 }, reading, believed);
            drifted += 0.3 * drift(0.3 * f64::from(k));
        }
        errs_as_it_says(wrapped(believed - heading), &gyro, drift(450.0));
    }

    #[test]
    fn slipping_wheels_are_no_drift_of_a_gyro() {
        beside_slipping_wheels(|_| 0.0);
    }

    #[test]
    fn a_gyro_that_is_not_calibrated_is_found_out_in_its_first_rest() {
        beside_slipping_wheels(|_| 0.1);
        beside_slipping_wheels(|_| -0.05);
    }

    #[test]
    fn a_gyro_that_calibrates_itself_while_it_rests_is_believed_again() {
        beside_slipping_wheels(|stamp| if stamp < 2.0 { 0.1 } else { 0.0 });
    }

    #[test]
    fn a_gyro_that_speaks_more_often_than_the_wheels_turns_at_no_rest() {
        let (mut gyro, mut heading, mut believed) = (Gyro::new(READING), 0.0f64, 0.0f64);
        for k in 0..2000 {
            heading += 0.02;
            if k % 10 == 9 {
                gyro.moved();
                believed += 0.2;
            }
            believed += gyro.read(0.01, heading, believed);
        }
        approx::assert_relative_eq!(wrapped(believed - heading), 0.0, epsilon = 0.01);
        assert!(gyro.drift.abs() < 1e-3, "{} rad/s", gyro.drift);
    }
}

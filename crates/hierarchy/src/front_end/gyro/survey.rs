use robot_log::local_grid::nalgebra::Isometry2;
use robot_log::{Entry, EntryKind};

use super::wrapped;

/// How fast a gyro drifts when a log begins, as the rests of the whole log tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GyroDrift {
    /// In radians per second.
    pub rate: f64,
    /// Variance of the rate, in (rad/s)².
    pub variance: f64,
}

/// Looks through a log for its gyro's drift before the log is mapped.
///
/// A gyro turns while the wheels rest by what it drifts. A mapper that meets a log entry by entry learns that in the first
/// rest only, after it has bent all that was driven before, and a rest of a second tells it to a degree a second at best.
/// All rests of a recording together tell it from the beginning: the first rest and those after it that agree with the ones
/// before, up to the first that does not, as if the gyro had been calibrated there.
///
/// ```
/// # let entries = Vec::<robot_log::Entry>::new();
/// # let mut mapper = hierarchy::Mapper::new(hierarchy::Config::default())?;
/// let mut survey = hierarchy::GyroSurvey::default();
/// entries.iter().for_each(|entry| survey.see(entry));
/// if let Some(drift) = survey.drift() {
///     mapper.expect_drift(drift);
/// }
/// # Ok::<(), hierarchy::MapperError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct GyroSurvey {
    last_odometry: Option<Isometry2<f64>>,
    /// What the wheels said since the last reading that was compared with them.
    told: bool,
    moved: bool,
    /// The last reading: seconds, radians, and its standard deviation.
    last: Option<Reading>,
    /// The rest that goes on: seconds and radians since its second reading.
    rest: Option<(f64, f64)>,
    /// All rests that ended.
    rests: Vec<GyroDrift>,
}

#[derive(Debug, Clone, Copy)]
struct Reading {
    stamp: f64,
    heading: f64,
    deviation: f64,
}

/// Standard deviations by which a rest differs from those before where the gyro drifts otherwise, and by which a drift
/// differs from none.
const SURPRISING: f64 = 4.0;

impl GyroSurvey {
    /// Takes in one entry.
    pub fn see(&mut self, entry: &Entry) {
        match &entry.kind {
            EntryKind::Odometry { odom_from_robot }
            | EntryKind::Scan { odom_from_robot: Some(odom_from_robot), .. } => {
                self.told = true;
                self.moved |= self.last_odometry.replace(*odom_from_robot).is_some_and(|last| last != *odom_from_robot);
            }
            EntryKind::Gyro { heading, deviation } => {
                self.read(Reading { stamp: entry.stamp, heading: heading.radians(), deviation: *deviation });
            }
            _ => {}
        }
    }

    /// The drift at the beginning; `None` where there is no gyro, no rest, or no drift that would show.
    #[must_use]
    pub fn drift(&self) -> Option<GyroDrift> {
        let open = self.rest.zip(self.last).and_then(|(rest, last)| drift_of(rest, last.deviation));
        let mut together: Option<GyroDrift> = None;
        for rest in self.rests.iter().copied().chain(open) {
            let Some(known) = together else {
                together = Some(rest);
                continue;
            };
            if (rest.rate - known.rate).powi(2) > SURPRISING.powi(2) * (rest.variance + known.variance) {
                break;
            }
            let variance = 1.0 / (1.0 / rest.variance + 1.0 / known.variance);
            let rate = variance * (rest.rate / rest.variance + known.rate / known.variance);
            together = Some(GyroDrift { rate, variance });
        }
        together.filter(|drift| drift.rate.abs() > SURPRISING * drift.variance.sqrt())
    }

    fn read(&mut self, reading: Reading) {
        let Some(last) = self.last else {
            self.last = Some(reading);
            return;
        };
        if reading.stamp <= last.stamp {
            return;
        }
        self.last = Some(reading);
        let (told, moved) = (std::mem::take(&mut self.told), std::mem::take(&mut self.moved));
        let (seconds, turned) = (reading.stamp - last.stamp, wrapped(reading.heading - last.heading));
        match &mut self.rest {
            _ if moved => self.end_rest(last.deviation),
            _ if !told => {} // the wheels may have turned
            Some(rest) => *rest = (rest.0 + seconds, rest.1 + turned),
            rest => *rest = Some((0.0, 0.0)), // what is read right after a turn may lag behind it
        }
    }

    fn end_rest(&mut self, deviation: f64) {
        self.rests.extend(self.rest.take().and_then(|rest| drift_of(rest, deviation)));
    }
}

/// What a rest of so many seconds and radians tells.
fn drift_of((seconds, turned): (f64, f64), deviation: f64) -> Option<GyroDrift> {
    let variance = 2.0 * (deviation / seconds).powi(2);
    (seconds > 0.0).then(|| GyroDrift { rate: turned / seconds, variance })
}

#[cfg(test)]
mod tests {
    use robot_log::local_grid::Heading;

    use super::*;

    /// A robot that drives in circles and rests for a second now and then, beside a gyro that drifts as told; it begins to
    /// drive at once.
    fn surveyed(drift: impl Fn(f64) -> f64) -> Option<GyroDrift> {
        let (mut survey, mut heading, mut drifted) = (GyroSurvey::default(), 0.0f64, 0.0f64);
        for k in 0..600u32 {
            let stamp = 0.25 * f64::from(k);
            heading += if k % 50 < 45 { 0.1 } else { 0.0 };
            drifted += 0.25 * drift(stamp);
            let odom_from_robot = Isometry2::rotation(heading);
            survey.see(&Entry { stamp, kind: EntryKind::Odometry { odom_from_robot } });
            let reading = (heading + drifted).to_degrees().round().to_radians();
            let kind = EntryKind::Gyro { heading: Heading::from_radians(reading), deviation: 0.0175 };
            survey.see(&Entry { stamp, kind });
        }
        survey.drift()
    }

    #[test]
    fn rests_tell_together_what_one_does_not() {
        let drift = surveyed(|_| 0.04).unwrap();
        assert!((drift.rate - 0.04).abs() < 3.0 * drift.variance.sqrt() && drift.variance.sqrt() < 0.01, "{drift:?}");
    }

    #[test]
    fn a_calibrated_gyro_has_no_drift_to_expect() {
        assert_eq!(surveyed(|_| 0.0), None);
    }

    #[test]
    fn what_holds_later_says_nothing_of_the_beginning() {
        let drift = surveyed(|stamp| if stamp < 60.0 { 0.15 } else { 0.0 }).unwrap();
        assert!((drift.rate - 0.15).abs() < 3.0 * drift.variance.sqrt(), "{drift:?}");
        assert_eq!(surveyed(|stamp| if stamp < 60.0 { 0.0 } else { 0.15 }), None);
    }
}

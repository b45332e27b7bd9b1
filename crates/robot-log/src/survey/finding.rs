use std::fmt;

use local_grid::SensorKind;

use crate::report::LogReport;

use super::Survey;

/// Something about a log that a user should know before trusting a map made from it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// No scan, and no recogniser of the robot's own: there is nothing to make a map from.
    NoScans,
    /// No odometry: there is nothing to place the scans by.
    NoOdometry,
    /// Every entry has the same stamp.
    NoClock,
    /// Nothing was logged for so many seconds, up to the stamp.
    Gap {
        /// Length in seconds.
        seconds: f64,
        /// Its end.
        stamp: f64,
    },
    /// The odometry leaps.
    Leap {
        /// Length in metres.
        metres: f64,
        /// When.
        stamp: f64,
    },
    /// The sensor hears hardly anything.
    Deaf {
        /// The sensor.
        sensor: String,
        /// The share of its measurements that are echoes.
        echo_share: f64,
    },
    /// Many readings of the sensor are no measurement.
    Invalid {
        /// The sensor.
        sensor: String,
        /// The share of its readings that are no measurement.
        share: f64,
    },
    /// The scans of one sensor state different mounts: one of the line's two poses is corrected and the other is not.
    Mounts {
        /// How many scans.
        scans: u64,
    },
    /// Stamps lay a little behind and were held.
    Held {
        /// How many.
        entries: u64,
    },
    /// Faulty lines were left out.
    Skipped {
        /// How many.
        lines: u64,
    },
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoScans => write!(f, "no range scans: there is nothing to draw a map from"),
            Self::NoOdometry => write!(f, "no odometry: there is nothing to place the scans by"),
            Self::NoClock => write!(f, "the clock stands still: every entry has the same stamp"),
            Self::Gap { seconds, stamp } => write!(f, "nothing was logged for {seconds:.1} s before stamp {stamp:.3}"),
            Self::Leap { metres, stamp } => write!(f, "the odometry leaps by {metres:.2} m at stamp {stamp:.3}"),
            Self::Deaf { sensor, echo_share } => {
                write!(
                    f,
                    "`{sensor}` hears hardly anything: {:.1} % of its measurements are echoes",
                    100.0 * echo_share
                )
            }
            Self::Invalid { sensor, share } => {
                write!(f, "{:.1} % of the readings of `{sensor}` are no measurement", 100.0 * share)
            }
            Self::Mounts { scans } => {
                write!(f, "{scans} scans state another sensor mount than the first: is one of the two poses corrected?")
            }
            Self::Held { entries } => write!(f, "{entries} stamps lay a little behind the entry before and were held"),
            Self::Skipped { lines } => write!(f, "{lines} faulty lines were left out"),
        }
    }
}

impl Finding {
    /// Whether a map made in spite of it can hardly be right; the others are worth knowing only.
    #[must_use]
    pub fn is_grave(&self) -> bool {
        !matches!(self, Self::Held { .. } | Self::Gap { .. } | Self::NoClock | Self::Invalid { .. })
    }
}

impl Survey {
    /// What is remarkable about the log, the worst first.
    #[must_use]
    pub fn findings<'a>(&self, reports: impl IntoIterator<Item = &'a LogReport>) -> Vec<Finding> {
        let mut findings = Vec::new();
        let mut note = |holds: bool, finding: Finding| holds.then(|| findings.push(finding));
        note(self.scans == 0 && self.recognitions == 0, Finding::NoScans);
        note(self.poses == 0, Finding::NoOdometry);
        let (metres, stamp) = self.longest_step;
        // Robots of such logs drive below 3 m/s; thinned-out logs have a pose every few metres.
        note(metres > 5.0 + 3.0 * self.longest_gap.0.min(2.0), Finding::Leap { metres, stamp });
        for survey in &self.sensors {
            let sensor = survey.sensor.name().to_owned();
            let (echo_share, invalid) =
                (survey.echo_share() / (1.0 - survey.invalid_share()).max(1e-9), survey.invalid_share());
            // An infrared sensor sees half a metre; that nothing was so near is no fault.
            let short_sighted = survey.sensor.kind() == SensorKind::Infrared;
            note(echo_share < 0.02 && !short_sighted, Finding::Deaf { sensor: sensor.clone(), echo_share });
            note(invalid > 0.5 && echo_share >= 0.02, Finding::Invalid { sensor, share: invalid });
        }
        let reports: Vec<&LogReport> = reports.into_iter().collect();
        let sum = |count: fn(&LogReport) -> u64| reports.iter().map(|report| count(report)).sum::<u64>();
        let (skipped, mounts) = (sum(LogReport::skipped_lines), sum(|report| report.mounts_ignored));
        note(skipped > 0, Finding::Skipped { lines: skipped });
        note(mounts > 0, Finding::Mounts { scans: mounts });
        note(self.entries > 1 && self.duration() == 0.0, Finding::NoClock);
        let (seconds, stamp) = self.longest_gap;
        let usual = self.sensors.iter().filter_map(super::SensorSurvey::interval).fold(0.0, f64::max);
        note(seconds > 2.0 && seconds > 10.0 * usual, Finding::Gap { seconds, stamp });
        let held = sum(|report| report.stamps_held);
        note(held > 0, Finding::Held { entries: held });
        findings
    }
}

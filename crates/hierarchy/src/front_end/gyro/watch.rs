use serde::{Deserialize, Serialize};

use super::wrapped;

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

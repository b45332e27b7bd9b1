use crate::error::LogErrorKind;
use crate::report::LogReport;

/// Where the stamps of the entries come from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Clock {
    /// The time at which the message was sent (`ipc_time`), which is what reference data is stamped with.
    #[default]
    Message,
    /// The time at which the logger wrote the line (`logger_time`).
    Logger,
    /// No clock: every scan is `period` seconds after the one before it, other entries share its stamp.
    Counted {
        /// Seconds from scan to scan.
        period: f64,
    },
}

/// Keeps the stamps of a log in order.
///
/// Processes that share a log write a little out of step: a stamp at most `hold` seconds behind is held at the latest one.
/// A stamp of zero (or below a nanosecond) after others means that nobody set it: the entry gets the latest one.
/// Anything else that is behind is a fault. Equal stamps are in order.
#[derive(Debug)]
pub(crate) struct Watch {
    hold: f64,
    latest: Option<f64>,
}

impl Watch {
    pub(crate) fn new(hold: f64) -> Self {
        Self { hold, latest: None }
    }

    /// The stamp in order, from the `stamp` of a line.
    pub(crate) fn accept(&mut self, stamp: f64, report: &mut LogReport) -> Result<f64, LogErrorKind> {
        let Some(latest) = self.latest else {
            self.latest = Some(stamp);
            return Ok(stamp);
        };
        if stamp >= latest {
            self.latest = Some(stamp);
            return Ok(stamp);
        }
        if stamp.abs() < 1e-9 {
            report.stamps_given += 1;
            return Ok(latest);
        }
        if latest - stamp <= self.hold {
            report.stamps_held += 1;
            return Ok(latest);
        }
        Err(LogErrorKind::Backwards { stamp, by: latest - stamp })
    }

    /// The stamp of the next entry of a log without a clock: a scan starts the next period.
    pub(crate) fn count(&mut self, period: f64, is_scan: bool, report: &mut LogReport) -> f64 {
        let stamp = match self.latest {
            None => 0.0,
            Some(latest) if is_scan => latest + period,
            Some(latest) => latest,
        };
        self.latest = Some(stamp);
        report.stamps_given += 1;
        stamp
    }
}

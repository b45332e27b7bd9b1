pub(crate) mod edits;
mod log;
pub(crate) mod place_name;
pub(crate) mod posed;
pub(crate) mod session;

use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use robot_log::{CarmenOptions, Clock, LogReport, ReadOptions, RobotDescription};

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

pub(crate) use log::Log;

/// A log on the command line.
#[derive(Debug, Args)]
pub(crate) struct LogArgs {
    /// The log: CARMEN, CSV or libRSF text, plain or gzip; several files are merged by stamp; `-` reads standard input
    #[arg(value_name = "LOG", required = true)]
    pub(crate) logs: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
}

/// How to read a log.
#[derive(Debug, Args)]
pub(crate) struct ReadingArgs {
    /// The robot whose tables of numbers the files are: a TOML file, or one of bigwheel, cas, coreslam, ring8, roombot3,
    /// rover2016, rover2017, scitos24, wean, zumo3
    #[arg(long, value_name = "FILE|NAME", help_heading = "Reading")]
    pub(crate) robot: Option<String>,
    /// Leave faulty lines out; they are counted and reported
    #[arg(long, help_heading = "Reading")]
    pub(crate) lenient: bool,
    /// Ranges of lasers from here on are no echo, where the log does not say [default: 30]
    #[arg(long, value_name = "M", value_parser = positive, help_heading = "Reading")]
    pub(crate) laser_max: Option<f64>,
    /// Ranges of sonars from here on are no echo, where the log does not say [default: 5]
    #[arg(long, value_name = "M", value_parser = positive, help_heading = "Reading")]
    pub(crate) sonar_max: Option<f64>,
    /// Which stamp of a CARMEN line counts; `none`: scans come at a steady --period
    #[arg(long, value_name = "CLOCK", default_value = "message", help_heading = "Reading")]
    pub(crate) clock: ClockChoice,
    /// Seconds from scan to scan with --clock none
    #[arg(long, value_name = "S", value_parser = positive, default_value_t = 1.0, help_heading = "Reading")]
    pub(crate) period: f64,
}

/// Which stamp of a CARMEN line counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum ClockChoice {
    Message,
    Logger,
    None,
}

impl LogArgs {
    /// Opens the log.
    pub(crate) fn open(&self) -> Result<Log, Failure> {
        open(&self.logs, &self.reading)
    }
}

/// Opens the log that consists of the files `logs`.
pub(crate) fn open(logs: &[PathBuf], reading: &ReadingArgs) -> Result<Log, Failure> {
    Log::open(logs, reading.options()?)
}

impl ReadingArgs {
    /// How the library is to read.
    pub(crate) fn options(&self) -> Result<ReadOptions, Failure> {
        let standard = CarmenOptions::default();
        let clock = match self.clock {
            ClockChoice::Message => Clock::Message,
            ClockChoice::Logger => Clock::Logger,
            ClockChoice::None => Clock::Counted { period: self.period },
        };
        let carmen = CarmenOptions {
            lenient: self.lenient,
            clock,
            laser_max_range: self.laser_max.unwrap_or(standard.laser_max_range),
            sonar_max_range: self.sonar_max.unwrap_or(standard.sonar_max_range),
            ..standard
        };
        Ok(ReadOptions { carmen, robot: self.robot()? })
    }

    /// The description that `--robot` names: one that is shipped, else a file.
    pub(crate) fn robot(&self) -> Result<Option<RobotDescription>, Failure> {
        let Some(name) = &self.robot else { return Ok(None) };
        if let Some(robot) = RobotDescription::builtin(name) {
            return Ok(Some(robot));
        }
        let path = Path::new(name);
        if !path.exists() && path.extension().is_none() {
            let known: Vec<&str> = RobotDescription::builtin_names().collect();
            let message = format!("there is no robot `{name}`");
            let failure = Failure::new(Exit::Usage, "robot.unknown", message);
            return Err(failure.help(format!("name a TOML file, or one of {}", known.join(", "))));
        }
        let text = io::read_to_string(files::open(path)?).map_err(|error| Failure::reading(path, &error))?;
        RobotDescription::from_toml(&text)
            .map(Some)
            .map_err(|error| Failure::rejected(path, "robot.description", &error))
    }
}

/// Warns of what a lenient reader left out: the first faults in full, the rest by kind.
pub(crate) fn warn_of_skipped<'a>(reports: impl Iterator<Item = &'a LogReport>, context: &Context) {
    for report in reports {
        for error in &report.errors {
            context.warn(&format!("left out: {error}"));
        }
        let more = report.skipped_lines() - report.errors.len() as u64;
        if more > 0 {
            context.warn(&format!("left out {more} more lines of {} kinds", report.skipped.len()));
        }
    }
}

/// A number of metres or seconds that makes sense as one.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a finite number above 0".to_owned()),
    }
}

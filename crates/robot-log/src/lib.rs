#![doc = include_str!("../README.md")]

mod carmen;
mod clock;
mod csv;
mod description;
mod entry;
mod error;
mod lines;
mod merge;
mod open;
mod report;
mod rsf;
mod source;
mod survey;
mod told;
mod write;

pub use carmen::{CarmenOptions, CarmenReader};
pub use clock::Clock;
pub use csv::CsvReader;
pub use description::{DescriptionError, OdometryNoise, RobotDescription};
pub use entry::{Entry, EntryKind};
pub use error::{Excerpt, LogError, LogErrorKind};
pub use open::{Input, LogReader, ReadOptions, open_log};
pub use report::LogReport;
pub use survey::{Finding, SensorSurvey, Survey};
pub use write::CarmenWriter;

pub use local_grid;

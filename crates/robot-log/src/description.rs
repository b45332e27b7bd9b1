use std::sync::Arc;

use local_grid::RangeSensor;
use serde::Deserialize;

mod check;
mod sensor;
mod table;

pub(crate) use table::{
    BeamText, Column, HeadingColumn, Layout, PairsText, PointsText, PoseColumns, Ranges, Separator, Table, Turn, Wheels,
};

use sensor::SensorText;

/// What a robot's own tables of numbers mean: which column holds what, in which unit, and where its range sensors sit.
///
/// It is written as TOML; every key is described in `docs/formats.md`, and a key that does not exist is an error.
///
/// ```
/// let robot = robot_log::RobotDescription::from_toml(r#"
///     name = "cart"
///     [[table]]
///     separator = ","
///     stamp = { column = 1, seconds = 0.001 }
///     pose = { x = 2, y = 3, heading = 4, metres = 0.01, degrees = 1.0 }
///     ranges = [{ sensor = "sonar", columns = [5, 6], metres = 0.01 }]
///     [[sensor]]
///     name = "sonar"
///     kind = "sonar"
///     beam_width_deg = 25.0
///     range_m = [0.1, 4.0]
///     mounts = [[0.1, 0.1, 45.0], [0.1, -0.1, -45.0]] # metres ahead, metres to the left, degrees to the left
/// "#)?;
/// assert_eq!(robot.sensors()[0].mounts().len(), 2);
/// # Ok::<(), robot_log::DescriptionError>(())
/// ```
#[derive(Debug, Clone)]
pub struct RobotDescription {
    name: String,
    about: String,
    odometry_noise: Option<OdometryNoise>,
    tables: Vec<Table>,
    sensors: Vec<Arc<RangeSensor>>,
}

/// How far off a robot's odometry is, as standard deviations that grow with the way.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryNoise {
    /// Metres of error in the distance per metre driven.
    pub metres_per_metre: f64,
    /// Radians of error in the heading per metre driven.
    pub radians_per_metre: f64,
    /// Radians of error in the heading per radian turned.
    pub radians_per_radian: f64,
}

/// Why a robot description cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DescriptionError {
    /// Not TOML, or not the keys and values that a description has.
    #[error("the robot description is not valid: {0}")]
    Toml(String),
    /// The parts do not fit each other.
    #[error("the robot description does not fit together: {0}")]
    Content(String),
    /// A sensor that cannot exist.
    #[error("the robot description has a sensor that cannot exist")]
    Sensor(#[source] local_grid::SensorError),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    name: String,
    #[serde(default)]
    about: String,
    odometry_noise: Option<OdometryNoise>,
    table: Vec<Table>,
    #[serde(default)]
    sensor: Vec<SensorText>,
}

/// The descriptions that come with this crate.
const BUILTIN: [(&str, &str); 10] = [
    ("bigwheel", include_str!("../robots/bigwheel.toml")),
    ("cas", include_str!("../robots/cas.toml")),
    ("coreslam", include_str!("../robots/coreslam.toml")),
    ("ring8", include_str!("../robots/ring8.toml")),
    ("roombot3", include_str!("../robots/roombot3.toml")),
    ("rover2016", include_str!("../robots/rover2016.toml")),
    ("rover2017", include_str!("../robots/rover2017.toml")),
    ("scitos24", include_str!("../robots/scitos24.toml")),
    ("wean", include_str!("../robots/wean.toml")),
    ("zumo3", include_str!("../robots/zumo3.toml")),
];

impl RobotDescription {
    /// The description that `text` holds as TOML.
    ///
    /// # Errors
    ///
    /// Text that is no TOML, unknown keys, columns that do not exist, sensors that cannot exist or are not described.
    pub fn from_toml(text: &str) -> Result<Self, DescriptionError> {
        let text: Text = toml::from_str(text).map_err(|error| DescriptionError::Toml(error.to_string()))?;
        let sensors = text.sensor.iter().map(SensorText::build).collect::<Result<Vec<_>, _>>()?;
        check::check(&text.table, &sensors)?;
        let (name, about, odometry_noise) = (text.name, text.about, text.odometry_noise);
        Ok(Self { name, about, odometry_noise, tables: text.table, sensors })
    }

    /// The description of this name that comes with this crate.
    ///
    /// # Panics
    ///
    /// Never: the tests read every one of them.
    #[must_use]
    pub fn builtin(name: &str) -> Option<Self> {
        let (_, text) = BUILTIN.iter().find(|(known, _)| *known == name)?;
        Some(Self::from_toml(text).expect("the tests read every one of them"))
    }

    /// The names of the descriptions that come with this crate.
    pub fn builtin_names() -> impl Iterator<Item = &'static str> {
        BUILTIN.iter().map(|(name, _)| *name)
    }

    /// What the robot is called.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the robot is, in a sentence.
    #[must_use]
    pub fn about(&self) -> &str {
        &self.about
    }

    /// How far off its odometry is, where somebody measured it.
    #[must_use]
    pub fn odometry_noise(&self) -> Option<OdometryNoise> {
        self.odometry_noise
    }

    /// Its range sensors.
    #[must_use]
    pub fn sensors(&self) -> &[Arc<RangeSensor>] {
        &self.sensors
    }

    pub(crate) fn tables(&self) -> &[Table] {
        &self.tables
    }

    pub(crate) fn sensor(&self, name: &str) -> Option<&Arc<RangeSensor>> {
        self.sensors.iter().find(|sensor| sensor.name() == name)
    }
}

use std::f64::consts::PI;
use std::sync::Arc;

use local_grid::{RangeSensor, SensorError, SensorKind};
use nalgebra::Isometry2;

use crate::{CompassModel, OdometryModel, RayModel, SonarModel};

/// What a simulated robot is: body, drive, sensors and their errors. `Default` is the Nomad 200.
///
/// ```
/// let robot = simulator::RobotDescription::from_toml("speed = 0.3\n[odometry]\nscale = 0.02\n")?;
/// assert_eq!(robot.radius, 0.225); // the Nomad's, as it was not named
/// # Ok::<(), simulator::DescriptionError>(())
/// ```
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotDescription {
    /// What it is called.
    pub name: String,
    /// Radius of the body in metres.
    pub radius: f64,
    /// How near to a surface the bumper stops the robot, in metres from the skin.
    pub margin: f64,
    /// Largest speed in metres per second.
    pub speed: f64,
    /// Acceleration in metres per second squared.
    pub acceleration: f64,
    /// Rate of steering and of the turret in radians per second.
    pub turn_rate: f64,
    /// What the turret does.
    pub turret: Turret,
    /// Seconds between two records of odometry and compass while something moves.
    pub log_period: f64,
    /// Errors of dead reckoning.
    pub odometry: OdometryModel,
    /// The compass, if there is one.
    #[serde(default)] // none, not the Nomad's: `from_toml` starts from a whole description
    pub compass: Option<CompassModel>,
    /// The ring of sonars, if there is one.
    #[serde(default)] // none, not the Nomad's: `from_toml` starts from a whole description
    pub sonar: Option<SonarRing>,
    /// The ring of infrared sensors, if there is one.
    #[serde(default)] // none, not the Nomad's: `from_toml` starts from a whole description
    pub infrared: Option<InfraredRing>,
    /// The laser, if there is one.
    #[serde(default)] // none, not the Nomad's: `from_toml` starts from a whole description
    pub laser: Option<LaserFan>,
}

/// What a turret does while the robot drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Turret {
    /// It holds its heading by the compass: each sonar looks into the same direction everywhere.
    #[default]
    Held,
    /// It looks where the robot drives, as on a robot without a turret.
    Ahead,
}

/// A ring of Polaroid sonars.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SonarRing {
    /// How many.
    pub count: usize,
    /// Nominal full width of a beam in radians, as the log states it.
    pub beam_width: f64,
    /// Nearest range in metres: anything nearer reads as this.
    pub min_range: f64,
    /// Farthest range in metres.
    pub max_range: f64,
    /// How it hears.
    pub model: SonarModel,
}

/// A ring of infrared sensors.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InfraredRing {
    /// How many.
    pub count: usize,
    /// Nearest range in metres.
    pub min_range: f64,
    /// Farthest range in metres.
    pub max_range: f64,
    /// How it measures.
    pub model: RayModel,
}

/// A laser range finder that looks ahead from the robot's centre.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LaserFan {
    /// How many rays.
    pub count: usize,
    /// Angle between the first and the last ray in radians.
    pub view: f64,
    /// Nearest range in metres.
    pub min_range: f64,
    /// Farthest range in metres.
    pub max_range: f64,
    /// How it measures.
    pub model: RayModel,
}

const INCH: f64 = 0.0254;

impl Default for RobotDescription {
    fn default() -> Self {
        Self::nomad200()
    }
}

impl Default for SonarRing {
    /// The Nomad's: 16 Polaroids of 25°, 17 to 254 inches (255 is "nothing heard").
    fn default() -> Self {
        let beam_width = 25.0 * PI / 180.0;
        Self { count: 16, beam_width, min_range: 17.0 * INCH, max_range: 254.0 * INCH, model: SonarModel::default() }
    }
}

impl Default for InfraredRing {
    /// The Nomad's: 16, up to 0.6 m.
    fn default() -> Self {
        Self { count: 16, min_range: 0.0, max_range: 0.6, model: RayModel::INFRARED }
    }
}

impl Default for LaserFan {
    /// A scanner of 180° in steps of 1°, up to 8 m.
    fn default() -> Self {
        Self { count: 181, view: PI, min_range: 0.05, max_range: 8.0, model: RayModel::LASER }
    }
}

/// Why a robot cannot exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DescriptionError {
    /// The text is not TOML, or a key is unknown or of the wrong type.
    #[error("not a robot description: {0}")]
    Syntax(String),
    /// The robot to start from is not one that comes with the simulator.
    #[error("robot description: base must be one of {}, got `{name}`", RobotDescription::NAMES.join(", "))]
    Base {
        /// What was asked for.
        name: String,
    },
    /// A quantity is out of its range.
    #[error("robot description: {name} must be {expected}, got {value}")]
    Value {
        /// The quantity.
        name: &'static str,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        value: f64,
    },
    /// A sensor cannot exist.
    #[error("robot description: a sensor is impossible")]
    Sensor(#[from] SensorError),
}

impl RobotDescription {
    /// The Nomad 200 of the paper: a turret held by a compass, 16 sonars, 16 infrared sensors, drifting odometry.
    ///
    /// Radius 0.225 m, 20 in/s, 30 in/s², 45 °/s.
    #[must_use]
    pub fn nomad200() -> Self {
        Self {
            name: "nomad200".into(),
            radius: 0.225,
            margin: 0.02,
            speed: 20.0 * INCH,
            acceleration: 30.0 * INCH,
            turn_rate: 45f64.to_radians(),
            turret: Turret::Held,
            log_period: 0.2,
            odometry: OdometryModel::NOMAD,
            compass: Some(CompassModel::INDOORS),
            sonar: Some(SonarRing::default()),
            infrared: None,
            laser: None,
        }
    }

    /// The Nomad with a compass that is always right.
    #[must_use]
    pub fn with_perfect_compass(self) -> Self {
        Self { compass: Some(CompassModel::PERFECT), ..self }
    }

    /// Reads a description: TOML, in which only what differs from the robot called `base` is named; without a `base`,
    /// from the Nomad 200.
    ///
    /// # Errors
    ///
    /// Text that is no description, unknown keys, an unknown base, or quantities out of range.
    pub fn from_toml(text: &str) -> Result<Self, DescriptionError> {
        let syntax = |error: String| DescriptionError::Syntax(error);
        let mut changes: toml::Table = toml::from_str(text).map_err(|error| syntax(error.to_string()))?;
        let base = match changes.remove("base") {
            None => Self::nomad200(),
            Some(toml::Value::String(name)) => Self::named(&name).ok_or(DescriptionError::Base { name })?,
            Some(other) => return Err(syntax(format!("base must be a name, got {other}"))),
        };
        let mut whole = toml::Table::try_from(&base).map_err(|error| syntax(error.to_string()))?;
        overlay(&mut whole, changes);
        let description: Self = whole.try_into().map_err(|error| syntax(error.to_string()))?;
        description.check()?;
        Ok(description)
    }

    /// The description that comes with the simulator under `name`: `nomad200`; `nomad200-perfect-compass`;
    /// `nomad200-infrared` with its infrared ring; `laser` without sonar or compass, which looks ahead; `perfect` without any error of odometry or compass.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let nomad = Self::nomad200();
        let robot = match name {
            "nomad200" => nomad,
            "nomad200-perfect-compass" => nomad.with_perfect_compass(),
            "nomad200-infrared" => Self { infrared: Some(InfraredRing::default()), ..nomad },
            "perfect" => Self { odometry: OdometryModel::PERFECT, ..nomad }.with_perfect_compass(),
            "laser" => {
                Self { laser: Some(LaserFan::default()), compass: None, sonar: None, turret: Turret::Ahead, ..nomad }
            }
            _ => return None,
        };
        Some(Self { name: name.into(), ..robot })
    }

    /// The names that [`RobotDescription::named`] knows.
    pub const NAMES: [&str; 5] = ["nomad200", "nomad200-infrared", "nomad200-perfect-compass", "laser", "perfect"];

    /// Refuses what no robot can have.
    ///
    /// # Errors
    ///
    /// The first quantity that is out of range.
    pub fn check(&self) -> Result<(), DescriptionError> {
        let positive = [
            ("radius", self.radius),
            ("speed", self.speed),
            ("acceleration", self.acceleration),
            ("turn_rate", self.turn_rate),
            ("log_period", self.log_period),
        ];
        for (name, value) in positive {
            within(name, value, 1e-6, 1e3, "between 0.000001 and 1000")?;
        }
        within("margin", self.margin, 0.0, 10.0, "between 0 and 10")?;
        let OdometryModel { walk, scale, heading_drift, heading_walk, turn_scale, carpet } = self.odometry;
        for (name, value) in [
            ("odometry.walk", walk),
            ("odometry.scale", scale),
            ("odometry.heading_drift", heading_drift),
            ("odometry.heading_walk", heading_walk),
            ("odometry.turn_scale", turn_scale),
            ("odometry.carpet", carpet),
        ] {
            within(name, value, 0.0, 1.0, "between 0 and 1")?;
        }
        if let Some(compass) = &self.compass {
            within("compass.correlation_length", compass.correlation_length, 1e-3, 1e6, "between 0.001 and 1000000")?;
            within("compass.disturbance", compass.disturbance, 0.0, PI, "between 0 and π")?;
            within("compass.noise", compass.noise, 0.0, PI, "between 0 and π")?;
            within("compass.quantum", compass.quantum, 0.0, PI, "between 0 and π")?;
            within("compass.lag", compass.lag, 0.0, 100.0, "between 0 and 100")?;
        }
        if let Some(sonar) = &self.sonar {
            sonar.check()?;
        }
        self.sensors().map(|_| ())
    }

    /// The sensors in the order in which they fire.
    pub(crate) fn sensors(&self) -> Result<Vec<Arc<RangeSensor>>, DescriptionError> {
        let mut sensors = Vec::new();
        if let Some(SonarRing { count, beam_width, min_range, max_range, .. }) = self.sonar {
            let range = min_range..=max_range;
            sensors.push(RangeSensor::ring("sonar", SensorKind::Sonar, count, self.radius, beam_width, range)?);
        }
        if let Some(InfraredRing { count, min_range, max_range, .. }) = self.infrared {
            let range = min_range..=max_range;
            sensors.push(RangeSensor::ring("infrared", SensorKind::Infrared, count, self.radius, 0.0, range)?);
        }
        if let Some(LaserFan { count, view, min_range, max_range, .. }) = self.laser {
            #[expect(clippy::cast_precision_loss, reason = "a fan has few rays")]
            let step = view / (count.max(2) - 1) as f64;
            let range = min_range..=max_range;
            sensors.push(RangeSensor::fan("laser", Isometry2::identity(), -0.5 * view, step, count, range)?);
        }
        Ok(sensors.into_iter().map(Arc::new).collect())
    }
}

impl SonarRing {
    fn check(&self) -> Result<(), DescriptionError> {
        let model = &self.model;
        within("sonar.model.dropout", model.dropout, 0.0, 1.0, "a probability")?;
        within("sonar.model.cross_talk", model.cross_talk, 0.0, 1.0, "a probability")?;
        within("sonar.model.range_deviation", model.range_deviation, 0.0, 1.0, "between 0 and 1")?;
        within("sonar.model.quantum", model.quantum, 0.0, self.min_range.max(1e-3), "between 0 and the minimum range")?;
        #[expect(clippy::cast_precision_loss, reason = "counts of a description are small or refused here")]
        let (rays, bounces) = (model.rays as f64, model.bounces as f64);
        within("sonar.model.rays", rays, 1.0, 1000.0, "between 1 and 1000")?;
        within("sonar.model.bounces", bounces, 0.0, 20.0, "between 0 and 20")
    }
}

/// Puts `changes` over `whole`, table by table.
fn overlay(whole: &mut toml::Table, changes: toml::Table) {
    for (key, change) in changes {
        match (whole.get_mut(&key), change) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(change)) => overlay(inner, change),
            (_, change) => {
                whole.insert(key, change);
            }
        }
    }
}

/// Refuses a value outside `[low, high]`, NaN included.
fn within(name: &'static str, value: f64, low: f64, high: f64, expected: &'static str) -> Result<(), DescriptionError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(DescriptionError::Value { name, expected, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_named_robot_can_exist_and_is_read_back_from_its_own_text() {
        for name in RobotDescription::NAMES {
            let robot = RobotDescription::named(name).unwrap();
            robot.check().unwrap();
            assert_eq!(robot.name, name);
        }
        assert_eq!(RobotDescription::named("r2d2"), None);
    }

    #[test]
    fn a_description_changes_its_base_key_by_key() {
        let robot = RobotDescription::from_toml("base = 'laser'\n[laser]\ncount = 361\n[sonar]\ncount = 8").unwrap();
        assert_eq!(robot.compass, None); // the base has none
        assert_eq!(robot.laser.unwrap(), LaserFan { count: 361, ..LaserFan::default() });
        assert_eq!(robot.sonar.unwrap(), SonarRing { count: 8, ..SonarRing::default() });
    }

    #[test]
    fn wrong_descriptions_say_what_and_why() {
        let error = |text| RobotDescription::from_toml(text).unwrap_err().to_string();
        assert!(error("speed = -1").contains("speed must be between 0.000001 and 1000, got -1"));
        assert!(error("[sonar]\ncount = 0").contains("a sensor is impossible"));
        assert!(error("[odometry]\nwalk = nan").contains("odometry.walk"));
        assert!(error("base = 'r2d2'").contains("base must be one of nomad200"));
        assert!(error("sped = 1").contains("unknown field"));
    }
}

mod about;

use global_grid::{GridOptions, SharedEcho, SonarModel};
use robot_log::local_grid::{SonarCone, SonarRegions};
use serde::{Deserialize, Serialize};

/// Everything that can be chosen about a run; the defaults are the paper's where it states them.
///
/// As a file it is TOML: name only what you change, unknown keys are errors.
///
/// ```
/// let config = hierarchy::Config::from_toml("[places]\nspacing_m = 0.8\n")?;
/// assert_eq!(config.places.spacing_m, 0.8);
/// assert!(hierarchy::Config::from_toml("[places]\nspacing = 0.8\n").is_err());
/// # Ok::<(), hierarchy::ConfigError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Where the robot's heading comes from.
    pub heading: HeadingConfig,
    /// How far dead reckoning may be trusted.
    pub odometry: OdometryConfig,
    /// When a new place is added.
    pub places: PlaceConfig,
    /// When a place counts as known.
    pub recognition: RecognitionConfig,
    /// When and how coordinates are made consistent.
    pub relaxation: RelaxationConfig,
    /// The gridmap.
    pub grid: GridConfig,
}

/// Where headings come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeadingMode {
    /// The log's compass or inertial unit where it has one; else the walls and the scans; else the odometry.
    #[default]
    Auto,
    /// Only the log's compass or inertial unit.
    Compass,
    /// The directions of walls and the alignment of successive scans, a compass ignored.
    Structure,
    /// The odometry alone.
    Odometry,
}

/// How headings are fused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HeadingConfig {
    /// The source.
    pub source: HeadingMode,
    /// Standard deviation in degrees of the disturbance that a compass suffers indoors, beyond its own noise:
    /// a smooth field of 3–5° is usual.
    pub compass_disturbance_deg: f64,
    /// Distance in metres over which that disturbance stays the same.
    pub compass_correlation_m: f64,
}

impl Default for HeadingConfig {
    fn default() -> Self {
        Self { source: HeadingMode::Auto, compass_disturbance_deg: 4.0, compass_correlation_m: 2.0 }
    }
}

/// Noise of dead reckoning: random walks whose variance grows with what was driven.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryConfig {
    /// Standard deviation of the distance after one metre, in metres; it grows with the root of the path.
    pub distance_m: f64,
    /// Standard deviation of the heading after one metre, in degrees.
    pub heading_per_m_deg: f64,
    /// Standard deviation of the heading after one full turn, in degrees.
    pub heading_per_turn_deg: f64,
}

impl Default for OdometryConfig {
    fn default() -> Self {
        Self { distance_m: 0.05, heading_per_m_deg: 1.5, heading_per_turn_deg: 6.0 }
    }
}

/// When places are added.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlaceConfig {
    /// Distance between places, in metres (the paper: about 1 m).
    pub spacing_m: f64,
}

impl Default for PlaceConfig {
    fn default() -> Self {
        Self { spacing_m: 1.0 }
    }
}

/// When a place counts as known. Precision before recall: a false recognition is the worst error of the system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecognitionConfig {
    /// Whether places are recognised at all; without it the map stays a chain.
    pub enabled: bool,
    /// Similarity of two signatures, in `[0, 1]`, below which nothing is recognised.
    pub floor: f64,
    /// Successive places that must agree before a loop is closed.
    pub agreement: usize,
    /// Half width in σ of the region in which a known place is looked for.
    pub gate_sigma: f64,
}

impl Default for RecognitionConfig {
    fn default() -> Self {
        Self { enabled: true, floor: 0.5, agreement: 3, gate_sigma: 3.0 }
    }
}

/// When coordinates are made consistent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RelaxationPolicy {
    /// One sweep for each added place, and the optimum whenever a loop closes.
    #[default]
    Converge,
    /// One sweep for each added place and nothing else: the paper's policy, kept to compare with.
    OneSweep,
}

/// When and how coordinates are made consistent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RelaxationConfig {
    /// The policy.
    pub policy: RelaxationPolicy,
}

/// The gridmap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GridConfig {
    /// Metres per cell.
    pub resolution_m: f64,
    /// Farthest reading that is drawn, in metres; `0` leaves it to the sensor's model.
    pub range_max_m: f64,
    /// By which model sonar readings are drawn.
    pub sonar: SonarDrawing,
}

impl Default for GridConfig {
    fn default() -> Self {
        Self { resolution_m: 0.1, range_max_m: 0.0, sonar: SonarDrawing::default() }
    }
}

/// By which model sonar readings are drawn into the gridmap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SonarDrawing {
    /// Oriolo's cone, the paper's: short-sighted, so that it keeps its word where echoes are specular.
    #[default]
    Oriolo,
    /// A flat cone whose echo is shared out by what all readings say.
    Shared,
    /// Murphy's regions.
    Murphy,
}

impl SonarDrawing {
    /// The model, with its own defaults.
    #[must_use]
    pub fn model(self) -> SonarModel {
        match self {
            Self::Oriolo => SonarModel::Cone(SonarCone::default()),
            Self::Shared => SonarModel::Shared(SharedEcho::default()),
            Self::Murphy => SonarModel::Regions(SonarRegions::default()),
        }
    }
}

impl GridConfig {
    /// How the global level is to build the gridmap.
    #[must_use]
    pub fn options(&self) -> GridOptions {
        let options =
            GridOptions { resolution: self.resolution_m, sonar: self.sonar.model(), ..GridOptions::default() };
        if self.range_max_m > 0.0 { options.within_range(self.range_max_m) } else { options }
    }
}

/// Why a configuration cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The text is no configuration; the message names line, column and key.
    #[error("{0}")]
    Syntax(String),
    /// A value lies outside of what makes sense.
    #[error("{key} must be {expected}, got {value}")]
    Value {
        /// The key, with its table.
        key: &'static str,
        /// What would do.
        expected: &'static str,
        /// What was given.
        value: f64,
    },
}

impl Config {
    /// Reads a configuration from TOML and checks every value.
    ///
    /// # Errors
    ///
    /// Text that is not TOML, unknown keys, and values outside of what makes sense.
    pub fn from_toml(text: &str) -> Result<Self, ConfigError> {
        let config: Self = toml::from_str(text).map_err(|error| ConfigError::Syntax(error.to_string()))?;
        config.check()?;
        Ok(config)
    }

    /// The effective configuration as TOML; reading it back gives the same configuration.
    ///
    /// # Panics
    ///
    /// Never: all fields are numbers, words and tables.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("numbers, words and tables are TOML")
    }

    /// Checks every value.
    ///
    /// # Errors
    ///
    /// The first value outside of what makes sense.
    pub fn check(&self) -> Result<(), ConfigError> {
        let positive: [(&'static str, f64); 6] = [
            ("heading.compass_correlation_m", self.heading.compass_correlation_m),
            ("odometry.distance_m", self.odometry.distance_m),
            ("odometry.heading_per_m_deg", self.odometry.heading_per_m_deg),
            ("odometry.heading_per_turn_deg", self.odometry.heading_per_turn_deg),
            ("places.spacing_m", self.places.spacing_m),
            ("recognition.gate_sigma", self.recognition.gate_sigma),
        ];
        for (key, value) in positive {
            within(key, value, f64::MIN_POSITIVE..=1e6, "a positive number")?;
        }
        within("heading.compass_disturbance_deg", self.heading.compass_disturbance_deg, 0.0..=180.0, "in 0..=180")?;
        within("recognition.floor", self.recognition.floor, 0.0..=1.0, "in 0..=1")?;
        within("grid.resolution_m", self.grid.resolution_m, 1e-3..=100.0, "in 0.001..=100 metres per cell")?;
        within("grid.range_max_m", self.grid.range_max_m, 0.0..=1e4, "in 0..=10000 metres")?;
        if self.recognition.agreement == 0 {
            let (key, expected) = ("recognition.agreement", "at least 1");
            return Err(ConfigError::Value { key, expected, value: 0.0 });
        }
        Ok(())
    }
}

/// Refuses a value outside of `range`; NaN lies outside of every range.
fn within(
    key: &'static str,
    value: f64,
    range: std::ops::RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), ConfigError> {
    if range.contains(&value) { Ok(()) } else { Err(ConfigError::Value { key, expected, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let config = Config::default();
        assert_eq!(Config::from_toml(&config.to_toml()).unwrap(), config);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let error = Config::from_toml("[grid]\nresolution_m = 0.0\n").unwrap_err();
        assert!(error.to_string().contains("grid.resolution_m"), "{error}");
        assert!(Config::from_toml("[places]\nspacing_m = nan\n").is_err());
        let error = Config::from_toml("[grid]\nresolutoin_m = 0.1\n").unwrap_err();
        assert!(error.to_string().contains("resolutoin_m"), "{error}");
    }
}

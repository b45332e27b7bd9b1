use local_grid::Reading;
use nalgebra::{Isometry2, Point2, Vector2};

use crate::noise::Noise;
use crate::sonar::echo;
use crate::world::Scene;

/// How thin rays of light measure: laser range finders and infrared triangulation sensors.
///
/// A ray ends at the first opaque surface; glass lets it through.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RayModel {
    /// Standard deviation of a range that does not depend on the range, in metres.
    pub deviation: f64,
    /// Standard deviation as a share of the range.
    pub range_deviation: f64,
    /// Probability that a reading is missing.
    pub dropout: f64,
    /// The step to which ranges are rounded, in metres; 0 for none.
    pub quantum: f64,
}

impl RayModel {
    /// A time-of-flight scanner: 1 cm deviation, centimetre steps.
    pub const LASER: Self = Self { deviation: 0.01, range_deviation: 0.0, dropout: 0.001, quantum: 0.01 };
    /// An infrared ring: a tenth of the range, in inches, as the Nomad's returned it.
    pub const INFRARED: Self = Self { deviation: 0.01, range_deviation: 0.1, dropout: 0.01, quantum: 0.0254 };
}

impl Default for RayModel {
    fn default() -> Self {
        Self::LASER
    }
}

/// The distance to the first opaque surface within `reach` metres.
pub(crate) fn first_opaque(scene: &Scene<'_>, map_from_sensor: &Isometry2<f64>, reach: f64) -> Option<f64> {
    let toward = map_from_sensor.rotation * Vector2::x();
    let start = Point2::from(map_from_sensor.translation.vector);
    let mut passed = 0.0;
    while passed < reach {
        let (distance, wall) = scene.cast(start + toward * passed, toward, reach - passed)?;
        passed += distance;
        if !wall.material.is_transparent() {
            return Some(passed);
        }
        passed += 1e-6; // behind the pane
    }
    None
}

impl RayModel {
    /// What the sensor reports for a surface at `range`.
    pub(crate) fn report(&self, range: Option<f64>, min: f64, max: f64, noise: &mut Noise) -> Reading {
        let (error, lost) = (noise.normal(), noise.happens(self.dropout));
        let Some(range) = range.filter(|_| !lost) else { return Reading::NoEcho };
        let noisy = range + error * self.deviation.hypot(self.range_deviation * range);
        let rounded = if self.quantum > 0.0 { (noisy / self.quantum).round() * self.quantum } else { noisy };
        if rounded > max {
            Reading::NoEcho
        } else if rounded < min {
            Reading::Invalid
        } else {
            echo(rounded)
        }
    }
}

use std::f64::consts::{PI, TAU};

use local_grid::Heading;
use nalgebra::{Point2, Vector2};

use crate::noise::Noise;

/// How a flux-gate compass errs indoors.
///
/// Steel in floors and walls bends the field: the heading is wrong by a smooth function of place, the same at every
/// visit. That makes a compass better than its noise for coming back and worse for measuring a building.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CompassModel {
    /// Root mean square of the disturbance over the floor, in radians.
    pub disturbance: f64,
    /// Distance over which the disturbance changes, in metres: its correlation is `exp(−d² / 2ℓ²)`.
    pub correlation_length: f64,
    /// Standard deviation of a reading, in radians.
    pub noise: f64,
    /// Time constant of the needle, in seconds.
    pub lag: f64,
    /// The step to which readings are rounded, in radians; 0 for none.
    pub quantum: f64,
}

impl CompassModel {
    /// A flux-gate compass in an office: 4° over 2 m, noise 1°, lag 1 s, steps of 0.1°.
    pub const INDOORS: Self = Self {
        disturbance: 4.0 * PI / 180.0,
        correlation_length: 2.0,
        noise: PI / 180.0,
        lag: 1.0,
        quantum: 0.1 * PI / 180.0,
    };
    /// A compass that is always right.
    pub const PERFECT: Self = Self { disturbance: 0.0, correlation_length: 2.0, noise: 0.0, lag: 0.0, quantum: 0.0 };

    /// The standard deviation of one reading against the truth, disturbance included, in radians.
    #[must_use]
    pub fn deviation(&self) -> f64 {
        self.disturbance.hypot(self.noise).hypot(self.quantum / 12f64.sqrt())
    }
}

impl Default for CompassModel {
    fn default() -> Self {
        Self::INDOORS
    }
}

/// Waves that make up the disturbance: enough for a field that looks Gaussian, few enough to be quick.
const WAVES: usize = 48;

/// One wave of the disturbance.
#[derive(Debug, Clone, Copy)]
struct Wave {
    /// Radians per metre.
    number: Vector2<f64>,
    phase: f64,
}

/// The compass of one robot in one building.
#[derive(Debug, Clone)]
pub(crate) struct Compass {
    model: CompassModel,
    noise: Noise,
    waves: Vec<Wave>,
    /// Where the needle points, in the map frame; `None` before the first step.
    needle: Option<Heading>,
}

impl Compass {
    pub(crate) fn new(model: CompassModel, mut noise: Noise) -> Self {
        // Random Fourier features: wave numbers from N(0, 1/ℓ²) give the Gaussian correlation (Rahimi & Recht 2007).
        let per_metre = 1.0 / model.correlation_length;
        let mut wave = || Wave {
            number: Vector2::new(noise.normal(), noise.normal()) * per_metre,
            phase: noise.uniform(0.0, TAU),
        };
        let waves = (0..WAVES).map(|_| wave()).collect();
        Self { model, noise, waves, needle: None }
    }

    /// By how many radians the field is bent at a point.
    pub(crate) fn disturbance(&self, at: Point2<f64>) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a small constant")]
        let amplitude = self.model.disturbance * (2.0 / WAVES as f64).sqrt();
        amplitude * self.waves.iter().map(|wave| (wave.number.dot(&at.coords) + wave.phase).cos()).sum::<f64>()
    }

    /// Lets the needle follow for `seconds`, at a true heading and place.
    pub(crate) fn follow(&mut self, truth: Heading, at: Point2<f64>, seconds: f64) {
        let target = truth + self.disturbance(at);
        self.needle = Some(match self.needle {
            Some(needle) if self.model.lag > 0.0 => {
                needle + (target - needle) * (1.0 - (-seconds / self.model.lag).exp())
            }
            _ => target,
        });
    }

    /// Where the needle points: the mean of many readings.
    pub(crate) fn needle(&self) -> Heading {
        self.needle.unwrap_or_default()
    }

    /// One reading.
    pub(crate) fn read(&mut self) -> Heading {
        let noisy = self.needle() + self.model.noise * self.noise.normal();
        if self.model.quantum > 0.0 {
            Heading::from_radians((noisy.radians() / self.model.quantum).round() * self.model.quantum)
        } else {
            noisy
        }
    }

    pub(crate) fn model(&self) -> &CompassModel {
        &self.model
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_disturbance_has_its_size_and_its_correlation() {
        let (mut square, mut near, mut far) = (0.0, 0.0, 0.0);
        for seed in 0..400 {
            let compass = Compass::new(CompassModel::INDOORS, Noise::new(seed, 0));
            let at = |x: f64| compass.disturbance(Point2::new(x, 1.0)).to_degrees();
            square += at(0.0) * at(0.0) / 400.0;
            near += at(0.0) * at(1.0) / 400.0;
            far += at(0.0) * at(8.0) / 400.0;
        }
        approx::assert_relative_eq!(square, 16.0, max_relative = 0.2); // 3 standard errors of 400 draws
        approx::assert_relative_eq!(near / square, (-0.125f64).exp(), epsilon = 0.1); // 1 m at ℓ = 2 m
        assert!((far / square).abs() < 0.15);
    }

    #[test]
    fn the_needle_lags_behind_a_turn() {
        let model = CompassModel { disturbance: 0.0, ..CompassModel::INDOORS };
        let mut compass = Compass::new(model, Noise::new(1, 0));
        compass.follow(Heading::from_radians(0.0), Point2::origin(), 0.05);
        compass.follow(Heading::from_radians(1.0), Point2::origin(), 1.0);
        approx::assert_relative_eq!(compass.needle().radians(), 1.0 - (-1f64).exp(), epsilon = 1e-12);
    }
}

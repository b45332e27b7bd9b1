use local_grid::Heading;
use nalgebra::{Isometry2, Rotation2, UnitComplex, Vector2};

use crate::noise::Noise;

/// How wrong dead reckoning is.
///
/// What is constant for one robot (scale, drift of the heading, drift of the carpet) is drawn once per seed; the rest
/// is a random walk, whose variance grows with the distance.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryModel {
    /// Deviation of the travelled distance after one metre, in metres; grows with the square root of the distance.
    pub walk: f64,
    /// Largest constant error of the scale, as a share of the distance: uniform in ±.
    pub scale: f64,
    /// Constant drift of the heading, in radians per metre; its sign is drawn.
    pub heading_drift: f64,
    /// Deviation of the heading after one metre, in radians; grows with the square root of the distance.
    pub heading_walk: f64,
    /// Largest constant error of a turn of the turret, as a share of the turn: uniform in ±.
    pub turn_scale: f64,
    /// Drift in a fixed direction that the wheels do not feel, as a share of the distance: the pile of a carpet.
    pub carpet: f64,
}

impl OdometryModel {
    /// A well kept synchro drive on a hard floor: 2 %, ±1 %, 0.5°/m and 1°/√m.
    pub const NOMAD: Self = Self {
        walk: 0.02,
        scale: 0.01,
        heading_drift: 0.5 * std::f64::consts::PI / 180.0,
        heading_walk: std::f64::consts::PI / 180.0,
        turn_scale: 0.01,
        carpet: 0.0,
    };
    /// Wheels that do not slip.
    pub const PERFECT: Self =
        Self { walk: 0.0, scale: 0.0, heading_drift: 0.0, heading_walk: 0.0, turn_scale: 0.0, carpet: 0.0 };

    /// Wheels that err by a share of the distance and by radians per metre, each as a constant and as a random walk.
    #[must_use]
    pub const fn of_shares(distance: f64, heading_per_m: f64) -> Self {
        Self {
            walk: distance,
            scale: distance,
            heading_drift: heading_per_m,
            heading_walk: heading_per_m,
            turn_scale: 0.0,
            carpet: 0.0,
        }
    }
}

impl Default for OdometryModel {
    fn default() -> Self {
        Self::NOMAD
    }
}

/// A piece of the robot's true motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    /// The true heading of the turret before the step.
    pub(crate) turret: Heading,
    /// The direction of travel, in radians counter-clockwise from the turret.
    pub(crate) direction: f64,
    /// Metres travelled.
    pub(crate) distance: f64,
    /// Radians by which the turret turned.
    pub(crate) turn: f64,
}

/// Where one robot believes to be.
#[derive(Debug, Clone)]
pub(crate) struct Odometry {
    model: OdometryModel,
    noise: Noise,
    scale: f64,
    drift: f64,
    turn_scale: f64,
    map_carpet: Vector2<f64>,
    odom_from_robot: Isometry2<f64>,
}

impl Odometry {
    pub(crate) fn new(model: OdometryModel, mut noise: Noise) -> Self {
        let scale = 1.0 + model.scale * noise.uniform(-1.0, 1.0);
        let drift = if noise.happens(0.5) { model.heading_drift } else { -model.heading_drift };
        let turn_scale = 1.0 + model.turn_scale * noise.uniform(-1.0, 1.0);
        let map_carpet = Rotation2::new(noise.uniform(0.0, std::f64::consts::TAU)) * Vector2::new(model.carpet, 0.0);
        Self { model, noise, scale, drift, turn_scale, map_carpet, odom_from_robot: Isometry2::identity() }
    }

    /// Counts the wheels' and the turret's turns.
    pub(crate) fn advance(&mut self, motion: &Motion) {
        let Motion { turret, direction, distance, turn } = *motion;
        let spread = distance.max(0.0).sqrt();
        let before = self.odom_from_robot.rotation;
        let rolled = distance * self.scale + self.model.walk * spread * self.noise.normal();
        let turned =
            turn * self.turn_scale + self.drift * distance + self.model.heading_walk * spread * self.noise.normal();
        let odom_from_map = before * UnitComplex::new(-turret.radians());
        // The step is made at the mean heading; the carpet moves the robot, not the wheels.
        let step = before * (UnitComplex::new(direction + 0.5 * turned) * Vector2::new(rolled, 0.0))
            - odom_from_map * (self.map_carpet * distance);
        self.odom_from_robot.translation.vector += step;
        self.odom_from_robot.rotation = UnitComplex::new(before.angle() + turned);
    }

    pub(crate) fn odom_from_robot(&self) -> Isometry2<f64> {
        self.odom_from_robot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(model: OdometryModel, seed: u64) -> Isometry2<f64> {
        let mut odometry = Odometry::new(model, Noise::new(seed, 0));
        for _ in 0..1000 {
            odometry.advance(&Motion { turret: Heading::from_radians(0.0), direction: 0.0, distance: 0.01, turn: 0.0 });
        }
        odometry.odom_from_robot()
    }

    #[test]
    fn perfect_wheels_count_every_step() {
        approx::assert_relative_eq!(drive(OdometryModel::PERFECT, 3).translation.x, 10.0, epsilon = 1e-9);
    }

    #[test]
    fn the_spread_after_ten_metres_is_the_models() {
        let model = OdometryModel { walk: 0.02, heading_walk: 0.02, ..OdometryModel::PERFECT };
        let ends: Vec<_> = (0..400).map(|seed| drive(model, seed)).collect();
        let rms = |value: &dyn Fn(&Isometry2<f64>) -> f64| {
            (ends.iter().map(|end| value(end).powi(2)).sum::<f64>() / 400.0).sqrt()
        };
        let heading = rms(&|end| end.rotation.angle());
        approx::assert_relative_eq!(heading, 0.02 * 10f64.sqrt(), max_relative = 0.1); // 3 standard errors of 400 draws
        // Lateral: the integral of a random walk, deviation σ √(d³ / 3).
        let lateral = rms(&|end| end.translation.y);
        approx::assert_relative_eq!(lateral, 0.02 * (1000f64 / 3.0).sqrt(), max_relative = 0.12);
    }

    #[test]
    fn a_carpet_shifts_by_its_share_of_the_path() {
        let model = OdometryModel { carpet: 0.03, ..OdometryModel::PERFECT };
        let shift = drive(model, 1).translation.vector - Vector2::new(10.0, 0.0);
        approx::assert_relative_eq!(shift.norm(), 0.3, epsilon = 1e-9);
    }
}

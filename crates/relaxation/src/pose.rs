//! A pose in the plane, with a heading that is a plain number.

use nalgebra::{Isometry2, Vector2};

/// Where a robot stands and which way it looks: metres, and radians counter-clockwise from `+x`.
///
/// The heading is kept as it was given, without wrapping, so that files read and written again stay as they are.
/// As a transform it takes points of the robot's own frame into the frame the pose is given in.
///
/// ```
/// use relaxation::Pose;
///
/// let map_from_a = Pose::new(1.0, 0.0, std::f64::consts::FRAC_PI_2);
/// let a_from_b = Pose::new(2.0, 0.0, 0.0);
/// let map_from_b = map_from_a.compose(a_from_b);
/// assert!((map_from_b.x - 1.0).abs() < 1e-15 && (map_from_b.y - 2.0).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// East, metres.
    pub x: f64,
    /// North, metres.
    pub y: f64,
    /// Radians, counter-clockwise from `+x`; any number of turns.
    pub heading: f64,
}

impl Pose {
    /// A pose from its coordinates in metres and its heading in radians.
    #[must_use]
    pub fn new(x: f64, y: f64, heading: f64) -> Self {
        Self { x, y, heading }
    }

    /// `self * other`: `other` is given in the frame of `self`.
    #[must_use]
    pub fn compose(self, other: Self) -> Self {
        let (sin, cos) = self.heading.sin_cos();
        Self {
            x: self.x + cos * other.x - sin * other.y,
            y: self.y + sin * other.x + cos * other.y,
            heading: wrap(self.heading + other.heading),
        }
    }

    /// The pose that undoes this one.
    #[must_use]
    pub fn inverse(self) -> Self {
        let (sin, cos) = self.heading.sin_cos();
        Self { x: -cos * self.x - sin * self.y, y: sin * self.x - cos * self.y, heading: wrap(-self.heading) }
    }

    /// `self⁻¹ * other`: where `other` lies as seen from `self`.
    #[must_use]
    pub fn between(self, other: Self) -> Self {
        let (sin, cos) = self.heading.sin_cos();
        let (dx, dy) = (other.x - self.x, other.y - self.y);
        Self { x: cos * dx + sin * dy, y: -sin * dx + cos * dy, heading: wrap(other.heading - self.heading) }
    }

    /// The translation part, metres.
    #[must_use]
    pub fn translation(self) -> Vector2<f64> {
        Vector2::new(self.x, self.y)
    }

    /// Whether all three numbers are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.heading.is_finite()
    }
}

impl From<Isometry2<f64>> for Pose {
    fn from(isometry: Isometry2<f64>) -> Self {
        let t = isometry.translation.vector;
        Self::new(t.x, t.y, isometry.rotation.angle())
    }
}

impl From<Pose> for Isometry2<f64> {
    fn from(pose: Pose) -> Self {
        Isometry2::new(pose.translation(), pose.heading)
    }
}

/// The same angle in `[-π, π]`.
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if (-PI..=PI).contains(&angle) {
        return angle;
    }
    angle - TAU * (angle / TAU).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn between_undoes_compose() {
        let a = Pose::new(3.0, -4.0, 2.5);
        let b = Pose::new(-1.5, 0.25, 1.9);
        let back = a.between(a.compose(b));
        assert_relative_eq!(back.x, b.x, epsilon = 1e-14);
        assert_relative_eq!(back.y, b.y, epsilon = 1e-14);
        assert_relative_eq!(back.heading, b.heading, epsilon = 1e-14);
        let unit = a.compose(a.inverse());
        assert_relative_eq!(unit.x.hypot(unit.y) + unit.heading.abs(), 0.0, epsilon = 1e-14);
    }

    #[test]
    fn wrapping_keeps_the_direction() {
        for turns in -3..=3 {
            let angle = 1.25 + f64::from(turns) * std::f64::consts::TAU;
            assert_relative_eq!(wrap(angle), 1.25, epsilon = 1e-13);
        }
        assert_eq!(wrap(std::f64::consts::PI), std::f64::consts::PI);
    }
}

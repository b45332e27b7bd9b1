use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::{Add, Sub};

use nalgebra::{Rotation2, UnitComplex, Vector2};

/// An absolute direction in the map frame: radians from `+x` (east), counter-clockwise, in `(-π, π]`.
///
/// A heading is not a turn: two headings cannot be added, their difference is an angle in radians.
///
/// ```
/// use local_grid::Heading;
///
/// let east = Heading::from_compass_degrees(90.0); // a compass turns clockwise from north
/// assert!((east - Heading::from_radians(0.0)).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "f64", into = "f64"))] // so that reading wraps, too
pub struct Heading(f64);

impl Heading {
    /// The direction `radians` counter-clockwise from `+x`; any angle is wrapped into `(-π, π]`.
    #[must_use]
    pub fn from_radians(radians: f64) -> Self {
        Self(wrap(radians))
    }

    /// The direction that a compass calls `degrees`: clockwise from north, which is `+y`.
    #[must_use]
    pub fn from_compass_degrees(degrees: f64) -> Self {
        Self::from_radians(FRAC_PI_2 - degrees.to_radians())
    }

    /// The direction of the vector `toward`; east for the zero vector.
    #[must_use]
    pub fn of(toward: Vector2<f64>) -> Self {
        Self::from_radians(toward.y.atan2(toward.x))
    }

    /// Radians from `+x`, counter-clockwise, in `(-π, π]`.
    #[must_use]
    pub fn radians(self) -> f64 {
        self.0
    }

    /// The unit vector `(cos θ, sin θ)`.
    #[must_use]
    pub fn unit_vector(self) -> Vector2<f64> {
        let (sin, cos) = self.0.sin_cos();
        Vector2::new(cos, sin)
    }

    /// The rotation that turns `+x` into this direction.
    #[must_use]
    pub fn rotation(self) -> UnitComplex<f64> {
        UnitComplex::from_rotation_matrix(&Rotation2::new(self.0))
    }

    /// The opposite direction.
    #[must_use]
    pub fn reversed(self) -> Self {
        Self::from_radians(self.0 + PI)
    }
}

/// The turn in radians, in `(-π, π]`, that leads from `other` to `self`.
impl Sub for Heading {
    type Output = f64;

    fn sub(self, other: Self) -> f64 {
        wrap(self.0 - other.0)
    }
}

/// The direction after a turn of so many radians, counter-clockwise.
impl Add<f64> for Heading {
    type Output = Self;

    fn add(self, turn: f64) -> Self {
        Self::from_radians(self.0 + turn)
    }
}

impl From<f64> for Heading {
    fn from(radians: f64) -> Self {
        Self::from_radians(radians)
    }
}

impl From<Heading> for f64 {
    fn from(heading: Heading) -> Self {
        heading.0
    }
}

/// The angle equal to `radians` modulo 2π that lies in `(-π, π]`.
fn wrap(radians: f64) -> f64 {
    if -PI < radians && radians <= PI {
        return radians; // exact, and by far the most frequent case
    }
    let turned = radians.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_wrap_into_the_half_open_circle() {
        assert_eq!(Heading::from_radians(-PI).radians(), PI);
        assert_eq!(Heading::from_radians(PI).radians(), PI);
        approx::assert_relative_eq!(Heading::from_radians(7.0).radians(), 7.0 - TAU);
    }

    #[test]
    fn differences_cross_the_seam_the_short_way() {
        let turn = Heading::from_radians(-3.1) - Heading::from_radians(3.1);
        approx::assert_relative_eq!(turn, TAU - 6.2, epsilon = 1e-12);
    }

    #[test]
    fn a_compass_turns_clockwise_from_north() {
        approx::assert_relative_eq!(Heading::from_compass_degrees(0.0).unit_vector().y, 1.0);
        approx::assert_relative_eq!(Heading::from_compass_degrees(180.0).unit_vector().y, -1.0);
        approx::assert_relative_eq!(Heading::from_compass_degrees(270.0).unit_vector().x, -1.0, epsilon = 1e-12);
    }
}

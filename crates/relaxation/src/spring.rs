//! One spring: a measured displacement between two nodes, and how sure it is.

use nalgebra::{Matrix2, Vector2};

/// A measured displacement between two nodes: one link of a topological map, one spring of the network.
///
/// Its energy at the positions `p` is the squared Mahalanobis distance
///
/// ```text
/// E = rᵀ U⁻¹ r,   r = p_to − p_from − rest
/// ```
///
/// so an isotropic spring of variance `u` has stiffness `1/u` (Duckett, Marsland & Shapiro 2000, with constant weights).
/// The reverse spring, from `to` to `from`, has the rest `−rest` and the same energy.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Spring {
    /// The node the displacement starts from.
    pub from: usize,
    /// The node the displacement leads to.
    pub to: usize,
    /// The displacement `from → to` in the map frame, in metres: x east, y north.
    pub rest: Vector2<f64>,
    /// The covariance `U` of [`rest`](Self::rest) in the map frame, in square metres: symmetric and positive definite.
    pub covariance: Matrix2<f64>,
}

impl Spring {
    /// A spring equally sure in every direction: `variance` in square metres, per axis.
    #[must_use]
    pub fn isotropic(from: usize, to: usize, rest: Vector2<f64>, variance: f64) -> Self {
        Self { from, to, rest, covariance: Matrix2::from_diagonal_element(variance) }
    }

    /// A spring from what a robot with a compass measures: it drove `distance` metres towards `heading` (radians
    /// counter-clockwise from `+x`), sure to `distance_sigma` metres along the way and `heading_sigma` radians across it.
    ///
    /// ```text
    /// U = R(heading) diag(distance_sigma², (distance · heading_sigma)²) R(heading)ᵀ
    /// ```
    #[must_use]
    pub fn polar(from: usize, to: usize, distance: f64, heading: f64, distance_sigma: f64, heading_sigma: f64) -> Self {
        let (sin, cos) = heading.sin_cos();
        let (along, across) = (distance_sigma * distance_sigma, (distance * heading_sigma).powi(2));
        let mixed = (along - across) * sin * cos;
        let covariance =
            Matrix2::new(along * cos * cos + across * sin * sin, mixed, mixed, along * sin * sin + across * cos * cos);
        Self { from, to, rest: Vector2::new(distance * cos, distance * sin), covariance }
    }

    /// Whether the spring is equally sure in every direction, exactly.
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        let u = &self.covariance;
        u.m11 == u.m22 && u.m12 == 0.0 && u.m21 == 0.0
    }

    /// The inverse covariance `U⁻¹` in 1/m²: the spring's stiffness. Not finite if the covariance is singular.
    #[must_use]
    pub fn information(&self) -> Matrix2<f64> {
        let u = &self.covariance;
        if self.is_isotropic() {
            return Matrix2::from_diagonal_element(u.m11.recip());
        }
        let determinant = u.m11 * u.m22 - u.m12 * u.m21;
        Matrix2::new(u.m22, -u.m12, -u.m21, u.m11) / determinant
    }
}

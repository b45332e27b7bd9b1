//! How soft a spring is: a variance where x and y are alike, a 2×2 covariance where not; one algebra for both.

use std::fmt::Debug;

use nalgebra::{Matrix2, Vector2};

use crate::gauss_seidel::inverse;
use crate::network::Network;

/// The compliance of a spring: its (co)variance in m².
///
/// Springs in series add compliances, springs in parallel add stiffnesses: the laws of resistors.
pub(crate) trait Compliance: Copy + Debug {
    /// The compliance of a spring of the network, its weight included.
    fn of(network: &Network, spring: usize) -> Self;

    /// Two springs end to end.
    fn series(self, next: Self) -> Self;

    /// Two springs side by side: their compliance, and their rest from both rests.
    fn parallel(self, rest: Vector2<f64>, other: Self, other_rest: Vector2<f64>) -> (Self, Vector2<f64>);

    /// The stiffness, the inverse.
    fn stiffness(self) -> Self;

    /// The matrix (or number) times a vector.
    fn times(self, v: Vector2<f64>) -> Vector2<f64>;

    /// The number or matrix with such entries.
    fn from_entries(entry: impl Fn(usize, usize) -> f64) -> Self;

    /// One entry of it as a matrix of the solver, which has one row per node (`f64`) or two (2×2).
    fn entry(self, row: usize, column: usize) -> f64;
}

impl Compliance for f64 {
    #[inline]
    fn of(network: &Network, spring: usize) -> Self {
        network.springs()[spring].covariance.m11 / network.weight(spring)
    }

    #[inline]
    fn series(self, next: Self) -> Self {
        self + next
    }

    #[inline]
    fn parallel(self, rest: Vector2<f64>, other: Self, other_rest: Vector2<f64>) -> (Self, Vector2<f64>) {
        // Written so that neither huge nor tiny variances overflow on the way.
        let share = other / (self + other);
        (self * share, other_rest + (rest - other_rest) * share)
    }

    #[inline]
    fn stiffness(self) -> Self {
        self.recip()
    }

    #[inline]
    fn times(self, v: Vector2<f64>) -> Vector2<f64> {
        v * self
    }

    fn from_entries(entry: impl Fn(usize, usize) -> f64) -> Self {
        entry(0, 0)
    }

    #[inline]
    fn entry(self, _row: usize, _column: usize) -> f64 {
        self
    }
}

impl Compliance for Matrix2<f64> {
    fn of(network: &Network, spring: usize) -> Self {
        network.covariance(spring)
    }

    fn series(self, next: Self) -> Self {
        self + next
    }

    fn parallel(self, rest: Vector2<f64>, other: Self, other_rest: Vector2<f64>) -> (Self, Vector2<f64>) {
        let share = other * inverse(&(self + other));
        let both = share * self;
        // Symmetric but for rounding: keep it so.
        let mixed = 0.5 * (both.m12 + both.m21);
        (Matrix2::new(both.m11, mixed, mixed, both.m22), other_rest + share * (rest - other_rest))
    }

    fn stiffness(self) -> Self {
        inverse(&self)
    }

    fn times(self, v: Vector2<f64>) -> Vector2<f64> {
        self * v
    }

    fn from_entries(entry: impl Fn(usize, usize) -> f64) -> Self {
        Matrix2::from_fn(entry)
    }

    fn entry(self, row: usize, column: usize) -> f64 {
        self[(row, column)]
    }
}

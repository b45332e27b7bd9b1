//! Successive over-relaxation: Gauss-Seidel that steps further than it is asked to.

use std::f64::consts::PI;

use nalgebra::Point2;

use crate::gauss_seidel::iterate;
use crate::network::Network;
use crate::solver::{RelaxOptions, Relaxed, Solver};

/// Successive over-relaxation: each node goes `factor` times as far as its neighbours ask.
///
/// ```text
/// p_i ← p_i + ω (target_i − p_i)
/// ```
///
/// Converges for every factor between 0 and 2 (Ostrowski 1954, as the matrix is positive definite); 1 is Gauss-Seidel. On
/// loops and corridors a good factor takes `O(n)` sweeps where Gauss-Seidel takes `O(n²)`; see [`Sor::for_loop_of`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sor {
    factor: f64,
    /// When to stop.
    pub options: RelaxOptions,
}

/// A factor with which over-relaxation would not converge.
///
/// The text is a fragment that fits after "could not set up the solver: ".
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("the factor of over-relaxation must lie between 0 and 2, got {factor}")]
pub struct FactorOutOfRange {
    /// The factor given.
    pub factor: f64,
}

impl Sor {
    /// Over-relaxation by `factor`.
    ///
    /// # Errors
    ///
    /// A factor outside the open interval from 0 to 2, with which the sweeps would diverge.
    pub fn new(factor: f64) -> Result<Self, FactorOutOfRange> {
        if factor > 0.0 && factor < 2.0 {
            Ok(Self { factor, options: RelaxOptions::default() })
        } else {
            Err(FactorOutOfRange { factor })
        }
    }

    /// The best factor for a single loop (or corridor) of so many places: `2 / (1 + sin(π/n))`.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the factor is a rule of thumb")]
    pub fn for_loop_of(places: usize) -> Self {
        Self { factor: 2.0 / (1.0 + (PI / places.max(2) as f64).sin()), options: RelaxOptions::default() }
    }

    /// The factor ω.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.factor
    }
}

impl Default for Sor {
    /// The best factor for a loop of 100 places, about the largest in a building.
    fn default() -> Self {
        Self::for_loop_of(100)
    }
}

impl Solver for Sor {
    fn name(&self) -> &'static str {
        "sor"
    }

    fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        let rows = network.rows();
        iterate(network, start, &self.options, |_, positions| rows.sweep_over(self.factor, positions))
    }
}

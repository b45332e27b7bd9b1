//! Costs that stop growing, and the weights they amount to.

/// A robust cost `ρ(e²)` of a spring's normalised squared residual. Its weight is `ρ'(e²)`: least squares with
/// that weight has the same gradient (iteratively reweighted least squares).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Kernel {
    /// Quadratic up to `delta` standard deviations, linear beyond (Huber 1964): false springs still pull, with constant force.
    Huber {
        /// Standard deviations; 1.345 keeps 95 % efficiency on good data.
        delta: f64,
    },
    /// Grows with the logarithm.
    Cauchy {
        /// Standard deviations where the weight is one half.
        delta: f64,
    },
    /// Tends to a constant: false springs are let go.
    GemanMcClure {
        /// Standard deviations where the weight is one quarter.
        delta: f64,
    },
    /// Dynamic covariance scaling (Agarwal et al. 2013), with the weight its cost really has: the square of the scaling.
    ///
    /// ```text
    /// ρ = e²  if e² ≤ Φ,  else 4 Φ e² / (Φ + e²) − Φ        w = min(1, 2Φ / (Φ + e²))²
    /// ```
    Dcs {
        /// The squared residual where scaling begins.
        phi: f64,
    },
}

impl Kernel {
    /// `ρ(e²)`.
    #[must_use]
    pub fn cost(self, e2: f64) -> f64 {
        match self {
            Self::Huber { delta } if e2 > delta * delta => 2.0 * delta * e2.sqrt() - delta * delta,
            Self::Huber { .. } => e2,
            Self::Cauchy { delta } => delta * delta * (e2 / (delta * delta)).ln_1p(),
            Self::GemanMcClure { delta } => delta * delta * e2 / (delta * delta + e2),
            Self::Dcs { phi } if e2 > phi => 4.0 * phi * e2 / (phi + e2) - phi,
            Self::Dcs { .. } => e2,
        }
    }

    /// `ρ'(e²)`: what a spring's information is multiplied by. Between 0 and 1.
    #[must_use]
    pub fn weight(self, e2: f64) -> f64 {
        match self {
            Self::Huber { delta } if e2 > delta * delta => delta / e2.sqrt(),
            Self::Huber { .. } => 1.0,
            Self::Cauchy { delta } => 1.0 / (1.0 + e2 / (delta * delta)),
            Self::GemanMcClure { delta } => (delta * delta / (delta * delta + e2)).powi(2),
            Self::Dcs { phi } => (2.0 * phi / (phi + e2)).min(1.0).powi(2),
        }
    }

    fn scale(self) -> f64 {
        match self {
            Self::Huber { delta } | Self::Cauchy { delta } | Self::GemanMcClure { delta } => delta,
            Self::Dcs { phi } => phi,
        }
    }
}

/// How false springs are told from true ones.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum RobustMethod {
    /// A fixed kernel, reweighted until nothing changes; finds the minimum next to the least-squares map.
    Kernel(Kernel),
    /// Graduated non-convexity with truncated least squares (Yang, Antonante, Tzoumas & Carlone 2020): every spring ends in or out.
    TruncatedLeastSquares {
        /// The largest squared residual of a true spring: the 99 % quantile of χ² is 9.210 for positions, 11.345 for poses.
        bound: f64,
    },
    /// Graduated non-convexity with the Geman-McClure cost: weights stay between 0 and 1.
    GemanMcClure {
        /// As for truncated least squares.
        bound: f64,
    },
}

impl RobustMethod {
    /// A scale that is positive and finite, or not.
    pub(super) fn scale(self) -> f64 {
        match self {
            Self::Kernel(kernel) => kernel.scale(),
            Self::TruncatedLeastSquares { bound } | Self::GemanMcClure { bound } => bound,
        }
    }
}

/// How robust relaxation goes about.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct RobustOptions {
    /// What decides.
    pub method: RobustMethod,
    /// At most so many reweightings.
    pub max_iterations: usize,
}

impl Default for RobustOptions {
    /// Truncated least squares at the 99 % quantile for poses; use 9.210 for positions.
    fn default() -> Self {
        Self { method: RobustMethod::TruncatedLeastSquares { bound: 11.345 }, max_iterations: 100 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const ALL: [Kernel; 4] = [
        Kernel::Huber { delta: 1.345 },
        Kernel::Cauchy { delta: 2.0 },
        Kernel::GemanMcClure { delta: 3.0 },
        Kernel::Dcs { phi: 1.0 },
    ];

    #[test]
    fn dcs_has_the_square_of_its_scaling_as_weight() {
        let kernel = Kernel::Dcs { phi: 1.0 };
        assert_relative_eq!(kernel.weight(2.0), 4.0 / 9.0, epsilon = 1e-15);
        assert_eq!(kernel.weight(1.0), 1.0);
        assert_eq!(kernel.weight(0.3), 1.0);
    }

    #[test]
    fn weights_are_the_slopes_of_the_costs() {
        for kernel in ALL {
            for k in 1..400 {
                let (e2, h) = (0.05 * f64::from(k), 1e-6);
                let slope = (kernel.cost(e2 + h) - kernel.cost(e2 - h)) / (2.0 * h);
                assert_relative_eq!(kernel.weight(e2), slope, epsilon = 2e-6);
                assert!((0.0..=1.0).contains(&kernel.weight(e2)));
            }
        }
    }

    #[test]
    fn costs_and_weights_have_no_jump_where_their_formulas_change() {
        for (kernel, at) in [(ALL[0], 1.345f64 * 1.345), (ALL[3], 1.0)] {
            let (below, above) = (at * (1.0 - 1e-12), at * (1.0 + 1e-12));
            assert_relative_eq!(kernel.cost(below), kernel.cost(above), epsilon = 1e-10);
            assert_relative_eq!(kernel.weight(below), kernel.weight(above), epsilon = 1e-10);
        }
    }
}

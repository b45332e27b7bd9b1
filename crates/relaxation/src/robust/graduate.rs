//! Reweighting: fixed kernels, and graduated non-convexity.

use super::{RobustError, RobustMethod, RobustOptions};

/// By what the control parameter changes from one reweighting to the next.
const PACE: f64 = 1.4;
/// Weights nearer to 0 or 1 than this count as decided.
const DECIDED: f64 = 1e-4;
/// Relative change of the cost below which nothing more will happen.
const STILL: f64 = 1e-5;

/// Finds weights for the suspects. `solve` relaxes with given weights and returns every spring's squared residual *without* its weight;
/// `e2` are the residuals to begin with. How many times it was called.
pub(super) fn reweight(
    options: &RobustOptions,
    suspects: &[usize],
    weights: &mut [f64],
    mut e2: Vec<f64>,
    mut solve: impl FnMut(&[f64]) -> Result<Vec<f64>, RobustError>,
) -> Result<usize, RobustError> {
    let mut schedule = Schedule::new(options.method, suspects.iter().map(|&k| e2[k]).fold(0.0, f64::max));
    let mut cost = f64::INFINITY;
    for iteration in 0..options.max_iterations {
        for &k in suspects {
            weights[k] = schedule.weight(e2[k]);
        }
        e2 = solve(weights)?;
        let now: f64 = weights.iter().zip(&e2).map(|(w, e2)| w * e2).sum();
        let still = (cost - now).abs() <= STILL * now;
        cost = now;
        if schedule.is_last(still, suspects.iter().map(|&k| weights[k])) {
            return Ok(iteration + 1);
        }
        schedule.advance();
    }
    Ok(options.max_iterations)
}

/// Truncated least squares begins no flatter than this: springs beyond a thousand times the bound are out at once.
const LEAST_MU: f64 = 1e-3;
/// Geman-McClure begins no flatter than this, for the same reason.
const MOST_MU: f64 = 4.0;

/// Where between convex and fully robust the cost is.
struct Schedule {
    method: RobustMethod,
    /// Small is convex for truncated least squares, large is convex for Geman-McClure.
    mu: f64,
}

impl Schedule {
    fn new(method: RobustMethod, worst: f64) -> Self {
        let mu = match method {
            RobustMethod::Kernel(_) => 1.0,
            // Where everything is an inlier already the formula gives nothing positive: begin with the robust cost itself.
            RobustMethod::TruncatedLeastSquares { bound } if 2.0 * worst > bound => {
                (bound / (2.0 * worst - bound)).max(LEAST_MU)
            }
            RobustMethod::TruncatedLeastSquares { .. } => f64::INFINITY,
            RobustMethod::GemanMcClure { bound } => (2.0 * worst / bound).clamp(1.0, MOST_MU),
        };
        Self { method, mu }
    }

    fn weight(&self, e2: f64) -> f64 {
        let mu = self.mu;
        match self.method {
            RobustMethod::Kernel(kernel) => kernel.weight(e2),
            RobustMethod::TruncatedLeastSquares { bound } if mu.is_infinite() => f64::from(u8::from(e2 <= bound)),
            RobustMethod::TruncatedLeastSquares { bound } => {
                if e2 <= mu / (mu + 1.0) * bound {
                    1.0
                } else if e2 >= (mu + 1.0) / mu * bound {
                    0.0
                } else {
                    (bound * mu * (mu + 1.0) / e2).sqrt() - mu
                }
            }
            RobustMethod::GemanMcClure { bound } => (mu * bound / (e2 + mu * bound)).powi(2),
        }
    }

    fn is_last(&self, still: bool, mut weights: impl Iterator<Item = f64>) -> bool {
        match self.method {
            RobustMethod::Kernel(_) => still,
            RobustMethod::TruncatedLeastSquares { .. } => {
                self.mu > 1.0
                    && (still || self.mu.is_infinite())
                    && weights.all(|w| !(DECIDED..=1.0 - DECIDED).contains(&w))
            }
            RobustMethod::GemanMcClure { .. } => self.mu <= 1.0 && still,
        }
    }

    fn advance(&mut self) {
        match self.method {
            RobustMethod::Kernel(_) => {}
            RobustMethod::TruncatedLeastSquares { .. } => self.mu *= PACE,
            RobustMethod::GemanMcClure { .. } => self.mu = (self.mu / PACE).max(1.0),
        }
    }
}

/// Checks what cannot be computed with.
pub(super) fn check(method: RobustMethod) -> Result<(), RobustError> {
    let scale = method.scale();
    if scale > 0.0 && scale.is_finite() { Ok(()) } else { Err(RobustError::ScaleNotPositive { scale }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn truncated_weights_are_continuous_where_their_formulas_change() {
        for mu in [1e-4, 0.1, 1.0, 30.0] {
            let schedule = Schedule { method: RobustMethod::TruncatedLeastSquares { bound: 9.21 }, mu };
            for at in [mu / (mu + 1.0) * 9.21, (mu + 1.0) / mu * 9.21] {
                let jump = schedule.weight(at * (1.0 - 1e-12)) - schedule.weight(at * (1.0 + 1e-12));
                assert!(jump.abs() < 1e-9 * (1.0 + mu), "{mu} {jump}");
            }
        }
    }

    #[test]
    fn with_nothing_to_reject_all_weights_are_one() {
        let options = RobustOptions::default();
        let mut weights = vec![1.0; 3];
        let calls =
            reweight(&options, &[1, 2], &mut weights, vec![0.1, 2.0, 3.0], |_| Ok(vec![0.1, 2.0, 3.0])).unwrap();
        assert_eq!((weights, calls), (vec![1.0; 3], 1));
    }
}

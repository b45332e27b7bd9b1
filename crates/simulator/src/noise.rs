use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// One stream of random numbers among several that grow from one seed.
///
/// Each device of a robot draws from its own stream, so that firing a laser more often does not change what the
/// odometry does: the same seed gives the same drift, whatever else is switched on.
#[derive(Debug, Clone)]
pub(crate) struct Noise {
    rng: Pcg64Mcg,
}

impl Noise {
    /// The stream number `stream` of `seed`.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        // 2⁶⁴ over the golden ratio spreads neighbouring streams over all seeds.
        Self { rng: Pcg64Mcg::seed_from_u64(seed ^ stream.wrapping_mul(0x9E37_79B9_7F4A_7C15)) }
    }

    /// A number from the normal distribution of mean 0 and deviation 1 (Box & Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.rng.random::<f64>()).ln()).sqrt(); // 1 − [0, 1) is never 0
        radius * (TAU * self.rng.random::<f64>()).cos()
    }

    /// A number from `[low, high)`.
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.rng.random::<f64>()
    }

    /// Whether something happens that happens with `probability`.
    pub(crate) fn happens(&mut self, probability: f64) -> bool {
        self.rng.random::<f64>() < probability
    }

    /// A whole number from `0..count`, 0 for an empty range.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        if count == 0 { 0 } else { self.rng.random_range(0..count) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_zero_and_deviation_one() {
        let mut noise = Noise::new(1, 2);
        let draws: Vec<f64> = (0..40_000).map(|_| noise.normal()).collect();
        let mean = draws.iter().sum::<f64>() / 40_000.0;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / 40_000.0;
        assert!(mean.abs() < 0.02, "{mean}"); // four standard errors of the mean
        assert!((variance - 1.0).abs() < 0.03, "{variance}");
    }

    #[test]
    fn streams_of_one_seed_differ_and_repeat() {
        let draw = |stream| Noise::new(7, stream).uniform(0.0, 1.0);
        assert_ne!(draw(0), draw(1));
        assert_eq!(draw(1), draw(1));
    }
}

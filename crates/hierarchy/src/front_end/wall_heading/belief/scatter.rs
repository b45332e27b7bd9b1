use super::belongs;

/// How true the walls of a building run: the variance of their directions about the building's, in rad², learnt from what
/// each wall is off beyond what was to be expected.
///
/// An office's walls stand within 2° of each other. In a flat that is lived in, or a building with oblique walls, they lean by
/// 5° to 8°; taken for as true as an office's they drag the heading along, for as long as the robot follows them, as no compass
/// would. There the compass has to count for more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scatter(f64);

/// How true walls run at best, as a standard deviation in radians: frames, pilasters, what stands along them.
/// (Of 1,342 walls of 1.2 m in four simulated drives two thirds stood within 1.3 of their own deviations and half of this.)
const TRUEST: f64 = 0.03;
/// The same at worst: what is farther off does not run with the building at all.
const LEAST_TRUE: f64 = 0.12;
/// Weight of the latest wall in what is learnt: some twenty walls, a room or two, tell the kind of building.
const LATEST: f64 = 0.05;

impl Default for Scatter {
    fn default() -> Self {
        Self(TRUEST.powi(2))
    }
}

impl Scatter {
    /// One that was learnt before; `None` if it is none.
    pub(crate) fn recalled(learnt: f64) -> Option<Self> {
        learnt.is_finite().then_some(Self(learnt))
    }

    /// What was learnt, in rad²; by chance it may be less than any variance is.
    pub(crate) fn learnt(self) -> f64 {
        self.0
    }

    /// The variance of the walls' directions, in rad².
    pub(super) fn variance(self) -> f64 {
        self.0.clamp(TRUEST.powi(2), LEAST_TRUE.powi(2))
    }

    /// A wall is `off` radians from where it was expected, where `expected` is the variance of that without scatter; answers
    /// the scatter's. A wall counts by the probability that it runs with the building at all.
    pub(super) fn learn(&mut self, off: f64, expected: f64) -> f64 {
        let counts = belongs(off, expected + LEAST_TRUE.powi(2));
        self.0 += LATEST * counts * (off * off - expected - self.0);
        self.variance()
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand::distr::Distribution;

    use super::*;

    /// What is learnt of 80 walls that scatter by `sigma` and are measured to 0.05 rad.
    fn of_walls(sigma: f64) -> f64 {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
        let normal = |random: &mut rand_pcg::Pcg64Mcg| {
            let uniform = rand::distr::Uniform::new(-0.5, 0.5).unwrap();
            (0..12).map(|_| uniform.sample(random)).sum::<f64>() // of variance 1
        };
        let mut scatter = Scatter::default();
        for _ in 0..80 {
            scatter.learn(normal(&mut random) * sigma.hypot(0.05), 0.05_f64.powi(2));
        }
        scatter.variance().sqrt()
    }

    #[test]
    fn an_office_stays_true_and_a_crooked_flat_is_found_out() {
        assert!(of_walls(0.01) < 0.035, "{}", of_walls(0.01));
        let crooked = of_walls(0.1);
        assert!((0.07..=LEAST_TRUE).contains(&crooked), "{crooked}");
    }

    #[test]
    fn oblique_furniture_teaches_nothing() {
        let mut scatter = Scatter::default();
        for _ in 0..80 {
            scatter.learn(0.7, 0.05_f64.powi(2));
        }
        approx::assert_relative_eq!(scatter.variance(), TRUEST.powi(2), epsilon = 1e-4);
    }
}

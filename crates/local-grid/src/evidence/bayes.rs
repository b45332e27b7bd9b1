use super::{Cell, Evidence};

/// A cell of a Bayesian occupancy grid: the log-odds of being occupied, 0 (probability one half) where nothing is known.
///
/// ```text
/// l ← l + logit p(occupied | reading),    p = 1 − 1 / (1 + exp l)
/// ```
///
/// The inverse sensor model is the pignistic probability `(1 + occupied − empty) / 2` of the evidence, so that a reading
/// that says nothing changes nothing and a hit can never push towards empty. One reading counts at most
/// [`Bayes::MAX_STEP`]; the sum is kept as it is, so that the map does not depend on the order of readings, and it is
/// clamped to ±[`Bayes::CLAMP`] only where it is read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Bayes {
    /// The sum of all log-odds, not clamped.
    pub log_odds: f32,
}

impl Bayes {
    /// The largest log-odds that is believed: beyond it readings are not independent enough to mean more.
    pub const CLAMP: f32 = 5.0;
    /// The most that a single reading can say: `logit 0.98`.
    pub const MAX_STEP: f32 = 3.891_82;

    /// The probability of being occupied.
    #[must_use]
    pub fn probability(&self) -> f32 {
        let clamped = self.log_odds.clamp(-Self::CLAMP, Self::CLAMP);
        1.0 - 1.0 / (1.0 + clamped.exp())
    }
}

impl Cell for Bayes {
    fn fuse(&mut self, evidence: Evidence) {
        let occupied = 0.5 * (1.0 + evidence.occupied - evidence.empty);
        let step = (occupied / (1.0 - occupied)).ln();
        self.log_odds += step.clamp(-Self::MAX_STEP, Self::MAX_STEP);
    }

    fn known(&self) -> Evidence {
        let belief = 2.0 * self.probability() - 1.0;
        Evidence { empty: (-belief).max(0.0), occupied: belief.max(0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_readings_cancel() {
        let mut cell = Bayes::default();
        cell.fuse(Evidence { empty: 0.4, occupied: 0.0 });
        cell.fuse(Evidence { empty: 0.0, occupied: 0.4 });
        approx::assert_relative_eq!(cell.probability(), 0.5, epsilon = 1e-6);
    }

    #[test]
    fn silence_leaves_the_prior() {
        let mut cell = Bayes::default();
        cell.fuse(Evidence::default());
        assert_eq!(cell, Bayes::default());
        assert_eq!(cell.probability(), 0.5);
    }

    #[test]
    fn certainty_stays_finite() {
        let mut cell = Bayes::default();
        for _ in 0..1000 {
            cell.fuse(Evidence { empty: 0.0, occupied: 1.0 });
        }
        assert!(cell.log_odds.is_finite());
        approx::assert_relative_eq!(cell.probability(), 0.993_307, epsilon = 1e-5); // 1 / (1 + e⁻⁵)
    }

    #[test]
    fn a_reading_is_believed_as_stated() {
        let mut cell = Bayes::default();
        cell.fuse(Evidence { empty: 0.0, occupied: 0.4 });
        approx::assert_relative_eq!(cell.probability(), 0.7, epsilon = 1e-6);
        approx::assert_relative_eq!(cell.known().occupied, 0.4, epsilon = 1e-6);
    }
}

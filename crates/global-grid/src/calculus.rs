use local_grid::{Bayes, DempsterShafer, Evidence};

use crate::Tally;
use crate::tally::{STRONGEST_EVIDENCE, nats, units_of_nats};

/// By which rule readings are joined in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Calculus {
    /// Fuzzy sets of empty and of occupied cells, united by the algebraic sum (Oriolo, Ulivi & Vendittelli 1997).
    #[default]
    Fuzzy,
    /// Log-odds of being occupied; one reading counts as its pignistic probability `(1 + occupied − empty)/2`.
    Bayes,
    /// Masses of belief joined by Dempster's rule (Hughes & Murphy 1992), conflict kept.
    DempsterShafer,
}

impl Calculus {
    /// What a reading's evidence adds to the sums of a cell.
    pub(crate) fn step(self, evidence: Evidence) -> Step {
        let cap = |degree: f32| f64::from(degree).clamp(0.0, STRONGEST_EVIDENCE);
        let (empty, occupied) = (cap(evidence.empty), cap(evidence.occupied));
        let (empty, occupied) = match self {
            Self::Fuzzy => (nats(empty), nats(occupied)),
            Self::Bayes => {
                let belief = occupied - empty; // logit((1 + b)/2) = ln((1 + b)/(1 − b))
                let log_odds = ((1.0 + belief) / (1.0 - belief)).ln();
                ((-log_odds).max(0.0), log_odds.max(0.0))
            }
            Self::DempsterShafer => {
                let total = ((empty + occupied) / STRONGEST_EVIDENCE).max(1.0);
                let (empty, occupied) = (empty / total, occupied / total);
                let unknown = 1.0 - empty - occupied;
                // A mass on two classes is the Dempster sum of a simple support for each, of weights q(Θ)/q(class).
                ((1.0 + empty / unknown).ln(), (1.0 + occupied / unknown).ln())
            }
        };
        Step { empty: units_of_nats(empty), occupied: units_of_nats(occupied) }
    }
}

/// What one reading adds to a cell, in units of `2⁻¹⁴` nat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Step {
    pub(crate) empty: u16,
    pub(crate) occupied: u16,
}

impl Tally {
    /// The cell by Bayes' rule: what speaks for "occupied" less what speaks against.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "log-odds are kept as f32")]
    pub fn bayes(self) -> Bayes {
        Bayes { log_odds: (self.occupied_nats() - self.empty_nats()) as f32 }
    }

    /// The cell by Dempster's rule, from the commonalities `q(O) = exp(−e)`, `q(E) = exp(−o)`, `q(Θ) = exp(−e−o)`.
    ///
    /// The masses are those of combining the readings one by one. The weight of conflict is, too, where each reading
    /// speaks for one side only; where one speaks for both (the ring of a sonar) its own contradiction counts as well.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "masses are kept as f32")]
    pub fn dempster_shafer(self) -> DempsterShafer {
        let (e, o) = (self.empty_nats(), self.occupied_nats());
        // Divided by the larger of exp(−e), exp(−o), so that nothing underflows: a = exp(−|e − o|).
        let lesser = (-(e - o).abs()).exp();
        let unknown = (-e.max(o)).exp();
        let (occupied, empty) = if o >= e { (1.0, lesser) } else { (lesser, 1.0) };
        let (occupied, empty) = (occupied - unknown, empty - unknown);
        let total = occupied + empty + unknown;
        DempsterShafer {
            occupied: (occupied / total) as f32,
            empty: (empty / total) as f32,
            conflict: (e.min(o) - total.ln()) as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GridOptions;
    use local_grid::{Cell, Fuzzy};

    /// Overlaps, one-sided evidence, strong and weak, in a mixed order.
    const READINGS: [(f32, f32); 7] =
        [(0.1, 0.0), (0.0, 0.25), (0.6, 0.0), (0.02, 0.17), (0.0, 0.4), (0.1, 0.0), (0.0, 0.3)];

    fn tally(calculus: Calculus, readings: &[(f32, f32)]) -> Tally {
        readings.iter().fold(Tally::default(), |sum, &(empty, occupied)| {
            let step = calculus.step(Evidence { empty, occupied });
            Tally { empty: sum.empty + u32::from(step.empty), occupied: sum.occupied + u32::from(step.occupied) }
        })
    }

    fn cell<C: Cell>(readings: &[(f32, f32)]) -> C {
        let mut cell = C::default();
        readings.iter().for_each(|&(empty, occupied)| cell.fuse(Evidence { empty, occupied }));
        cell
    }

    #[test]
    fn sums_read_as_the_cells_fused_one_by_one() {
        let exact: Fuzzy = cell(&READINGS);
        let fuzzy = tally(Calculus::Fuzzy, &READINGS).fuzzy(f64::INFINITY);
        approx::assert_abs_diff_eq!(fuzzy.empty, exact.empty, epsilon = 2e-4); // seven half units
        approx::assert_abs_diff_eq!(fuzzy.occupied, exact.occupied, epsilon = 2e-4);

        let exact: Bayes = cell(&READINGS);
        let bayes = tally(Calculus::Bayes, &READINGS).bayes();
        approx::assert_abs_diff_eq!(bayes.log_odds, exact.log_odds, epsilon = 3e-4);

        let exact: DempsterShafer = cell(&READINGS);
        let shafer = tally(Calculus::DempsterShafer, &READINGS).dempster_shafer();
        approx::assert_abs_diff_eq!(shafer.empty, exact.empty, epsilon = 2e-4);
        approx::assert_abs_diff_eq!(shafer.occupied, exact.occupied, epsilon = 2e-4);
        approx::assert_abs_diff_eq!(shafer.conflict, exact.conflict, epsilon = 5e-3); // one reading contradicts itself
    }

    #[test]
    fn contradiction_is_weighed_as_by_hand() {
        let cell = tally(Calculus::DempsterShafer, &[(0.0, 0.4), (0.6, 0.0)]).dempster_shafer(); // k = 0.24
        approx::assert_abs_diff_eq!(cell.occupied, 0.2105, epsilon = 2e-4);
        approx::assert_abs_diff_eq!(cell.empty, 0.4737, epsilon = 2e-4);
        approx::assert_abs_diff_eq!(cell.conflict, 0.2744, epsilon = 2e-4);
    }

    #[test]
    fn a_hundred_thousand_contradictions_stay_finite() {
        let tally = Tally { empty: u32::MAX, occupied: u32::MAX };
        let cell = tally.dempster_shafer();
        assert!(cell.occupied.is_finite() && cell.conflict.is_finite());
        approx::assert_abs_diff_eq!(cell.probability(), 0.5, epsilon = 1e-6);
        for calculus in [Calculus::Bayes, Calculus::Fuzzy, Calculus::DempsterShafer] {
            assert_eq!(GridOptions { calculus, ..GridOptions::default() }.probability(tally), 0.5);
        }
    }

    #[test]
    fn an_unknown_cell_is_unknown_in_every_calculus() {
        for calculus in [Calculus::Fuzzy, Calculus::Bayes, Calculus::DempsterShafer] {
            let options = GridOptions { calculus, ..GridOptions::default() };
            assert_eq!(options.degrees(Tally::default()), Fuzzy::default());
            assert_eq!(options.probability(Tally::default()), 0.5);
        }
    }
}

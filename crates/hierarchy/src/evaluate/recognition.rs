use std::collections::BTreeMap;

use serde::Serialize;

/// How often the robot answered `response` when it was at `location`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Contingency {
    counts: BTreeMap<(usize, usize), u64>,
}

impl Contingency {
    /// Counts one answer.
    pub fn push(&mut self, location: usize, response: usize) {
        *self.counts.entry((location, response)).or_default() += 1;
    }

    /// How much of the uncertainty about the location the response takes away (Duckett & Nehmzow 1998):
    /// `U(L|R) = (H(L) − H(L|R)) / H(L)`, from 0 (nothing) to 1 (all).
    ///
    /// `None` where there is no uncertainty to begin with: fewer than two locations. A consistent relabelling of the places
    /// scores 1, so [`Contingency::accuracy`] belongs beside it.
    #[must_use]
    pub fn uncertainty_coefficient(&self) -> Option<f64> {
        let total = self.total();
        let mut rows: BTreeMap<usize, u64> = BTreeMap::new();
        let mut columns: BTreeMap<usize, u64> = BTreeMap::new();
        for ((location, response), count) in &self.counts {
            *rows.entry(*location).or_default() += count;
            *columns.entry(*response).or_default() += count;
        }
        let before: f64 = rows.values().map(|count| -plogp(*count, total)).sum();
        let after: f64 = self
            .counts
            .iter()
            .map(|((_, response), count)| -share(*count, total) * share(*count, columns[response]).ln())
            .sum();
        (before > 0.0).then(|| ((before - after) / before).clamp(0.0, 1.0))
    }

    /// The share of the answers that name the location itself; `None` without answers.
    #[must_use]
    pub fn accuracy(&self) -> Option<f64> {
        let right: u64 =
            self.counts.iter().filter(|((location, response), _)| location == response).map(|(_, count)| count).sum();
        (self.total() > 0).then(|| share(right, self.total()))
    }

    fn total(&self) -> u64 {
        self.counts.values().sum()
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts below 2⁵³")]
fn share(part: u64, whole: u64) -> f64 {
    part as f64 / whole as f64
}

fn plogp(part: u64, whole: u64) -> f64 {
    let p = share(part, whole);
    if part == 0 { 0.0 } else { p * p.ln() }
}

/// How well places are recognised: what was claimed, what is true, and what is both.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Recognition {
    /// Claims that a place is one visited before.
    pub claimed: usize,
    /// Those of them that are right.
    pub right: usize,
    /// Visits to places visited before.
    pub revisits: usize,
    /// Those of them for which something right was claimed.
    pub recognized: usize,
}

impl Recognition {
    /// The share of the claims that are right; 1 where nothing is claimed.
    #[must_use]
    pub fn precision(&self) -> f64 {
        ratio(self.right, self.claimed)
    }

    /// The share of the revisits that are recognised; 1 where there are none.
    #[must_use]
    pub fn recall(&self) -> f64 {
        ratio(self.recognized, self.revisits)
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts below 2⁵³")]
fn ratio(part: usize, whole: usize) -> f64 {
    if whole == 0 { 1.0 } else { part as f64 / whole as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(counts: [[u64; 2]; 2]) -> Contingency {
        let mut table = Contingency::default();
        for (location, row) in counts.iter().enumerate() {
            for (response, count) in row.iter().enumerate() {
                (0..*count).for_each(|_| table.push(location, response));
            }
        }
        table
    }

    #[test]
    fn the_coefficient_of_cases_worked_by_hand() {
        let of = |counts| table(counts).uncertainty_coefficient().unwrap();
        approx::assert_relative_eq!(of([[10, 0], [0, 10]]), 1.0);
        approx::assert_relative_eq!(of([[5, 5], [5, 5]]), 0.0);
        approx::assert_relative_eq!(of([[8, 2], [2, 8]]), 0.27807, epsilon = 1e-5);
        approx::assert_relative_eq!(of([[0, 10], [10, 0]]), 1.0);
        assert_eq!(table([[0, 10], [10, 0]]).accuracy(), Some(0.0));
        assert_eq!(table([[4, 0], [0, 0]]).uncertainty_coefficient(), None);
        assert_eq!(Contingency::default().accuracy(), None);
    }

    #[test]
    fn silence_is_precise_and_useless() {
        let silent = Recognition { claimed: 0, right: 0, revisits: 5, recognized: 0 };
        assert_eq!((silent.precision(), silent.recall()), (1.0, 0.0));
        let bold = Recognition { claimed: 4, right: 3, revisits: 6, recognized: 3 };
        assert_eq!((bold.precision(), bold.recall()), (0.75, 0.5));
    }
}

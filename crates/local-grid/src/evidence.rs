mod bayes;
mod dempster_shafer;
mod union;

pub use bayes::Bayes;
pub use dempster_shafer::DempsterShafer;
pub use union::Union;

/// What one reading says of one cell: degrees in `[0, 1]` to which it is empty and to which it is occupied.
///
/// The two need not add up to one: what is missing is ignorance, what is too much is contradiction.
/// Read as masses of belief they are the input of Dempster's rule; read through their pignistic probability
/// `P(occupied) = (1 + occupied − empty) / 2` they are the input of Bayes' rule. So one sensor model feeds all three
/// calculi with the same statement, which is what a fair comparison of calculi needs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Evidence {
    /// Degree to which the cell is empty.
    pub empty: f32,
    /// Degree to which the cell is occupied.
    pub occupied: f32,
}

impl Evidence {
    /// Whether the reading says nothing of the cell.
    #[must_use]
    pub fn is_nothing(&self) -> bool {
        self.empty == 0.0 && self.occupied == 0.0
    }
}

/// How a cell holds and fuses evidence. `Default` is "nothing known".
pub trait Cell: Copy + Default {
    /// Takes one more piece of evidence into account.
    fn fuse(&mut self, evidence: Evidence);

    /// What is known of the cell: degrees to which it is empty and occupied, in `[0, 1]`.
    fn known(&self) -> Evidence;
}

/// A cell of the fuzzy gridmap: membership in the set of empty cells and in the set of occupied cells, kept apart.
///
/// Evidence is united with the algebraic sum `a ∪ b = a + b − ab` (Oriolo, Ulivi & Vendittelli 1997), which is
/// commutative and associative, so that a map does not depend on the order of its readings.
/// [`Fuzzy::unite`] takes another union.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Fuzzy {
    /// Membership in the empty set, in `[0, 1]`.
    pub empty: f32,
    /// Membership in the occupied set, in `[0, 1]`.
    pub occupied: f32,
}

impl Fuzzy {
    /// Takes one more piece of evidence into account with a union of choice.
    #[inline]
    pub fn unite(&mut self, evidence: Evidence, union: Union) {
        self.empty = union.of(self.empty, evidence.empty);
        self.occupied = union.of(self.occupied, evidence.occupied);
    }
}

impl Cell for Fuzzy {
    #[inline]
    fn fuse(&mut self, evidence: Evidence) {
        self.unite(evidence, Union::Algebraic);
    }

    #[inline]
    fn known(&self) -> Evidence {
        Evidence { empty: self.empty, occupied: self.occupied }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_readings_at_one_tenth_make_forty_one_percent() {
        let mut cell = Fuzzy::default();
        for _ in 0..5 {
            cell.fuse(Evidence { empty: 0.1, occupied: 0.25 });
        }
        approx::assert_relative_eq!(cell.empty, 0.40951, epsilon = 1e-5); // 1 − 0.9⁵
        approx::assert_relative_eq!(cell.occupied, 0.762_695, epsilon = 1e-5); // 1 − 0.75⁵
    }

    #[test]
    fn full_membership_stays() {
        let mut cell = Fuzzy { empty: 1.0, occupied: 0.0 };
        cell.fuse(Evidence { empty: 0.3, occupied: 0.0 });
        assert_eq!(cell, Fuzzy { empty: 1.0, occupied: 0.0 });
    }
}

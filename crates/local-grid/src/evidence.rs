/// What one reading says of one cell: degrees in `[0, 1]` to which it is empty and to which it is occupied.
///
/// The two need not add up to one: what is missing is ignorance, what is too much is contradiction.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Evidence {
    /// Degree to which the cell is empty.
    pub empty: f32,
    /// Degree to which the cell is occupied.
    pub occupied: f32,
}

/// How a cell holds and fuses evidence. `Default` is "nothing known".
pub trait Cell: Copy + Default {
    /// Takes one more piece of evidence into account.
    fn fuse(&mut self, evidence: Evidence);
}

/// A cell of the fuzzy gridmap: membership in the set of empty cells and in the set of occupied cells, kept apart.
///
/// Evidence is united with the algebraic sum `a ∪ b = a + b − ab` (Oriolo, Ulivi & Vendittelli 1997), which is
/// commutative and associative, so that a map does not depend on the order of its readings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Fuzzy {
    /// Membership in the empty set, in `[0, 1]`.
    pub empty: f32,
    /// Membership in the occupied set, in `[0, 1]`.
    pub occupied: f32,
}

impl Cell for Fuzzy {
    fn fuse(&mut self, evidence: Evidence) {
        self.empty = algebraic_sum(self.empty, evidence.empty);
        self.occupied = algebraic_sum(self.occupied, evidence.occupied);
    }
}

/// The algebraic sum `a + b − ab`, written so that the result never leaves `[0, 1]` by rounding.
fn algebraic_sum(a: f32, b: f32) -> f32 {
    1.0 - (1.0 - a) * (1.0 - b)
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

use local_grid::{Fuzzy, FuzzyGrid, Grid};

/// How two fuzzy sets are intersected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Norm {
    /// `a b`.
    #[default]
    Product,
    /// The smaller of `a` and `b`.
    Minimum,
    /// `max(0, a + b − 1)`.
    Bounded,
}

impl Norm {
    /// The intersection of two degrees in `[0, 1]`.
    #[must_use]
    pub fn of(self, a: f32, b: f32) -> f32 {
        match self {
            Self::Product => a * b,
            Self::Minimum => a.min(b),
            Self::Bounded => (a + b - 1.0).max(0.0),
        }
    }
}

/// The degrees to which a cell belongs to the sets derived from "empty" and "occupied" (Oriolo, Ulivi & Vendittelli 1997).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Derived {
    /// `A = E ∩ O`: readings contradict each other.
    pub ambiguous: f32,
    /// `I = ¬E ∩ ¬O`: hardly anything is known.
    pub indeterminate: f32,
    /// `S = E² ∩ ¬O ∩ ¬A ∩ ¬I`: very empty, and neither contradicted nor unknown.
    pub safe: f32,
    /// `M = ¬S`: what a planner should keep away from.
    pub unsafety: f32,
}

/// The sets derived from a cell's emptiness `E` and occupancy `O`; `¬x = 1 − x`.
///
/// Whatever the norm, `S ≤ E²` and `S ≤ 1 − O`. With the product the safe set is not monotone: a little occupied evidence
/// makes a cell less indeterminate, and so may make it safer.
#[must_use]
pub fn derive(cell: Fuzzy, norm: Norm) -> Derived {
    let (e, o) = (cell.empty.clamp(0.0, 1.0), cell.occupied.clamp(0.0, 1.0));
    let ambiguous = norm.of(e, o);
    let indeterminate = norm.of(1.0 - e, 1.0 - o);
    let safe = norm.of(norm.of(norm.of(e * e, 1.0 - o), 1.0 - ambiguous), 1.0 - indeterminate);
    Derived { ambiguous, indeterminate, safe, unsafety: 1.0 - safe }
}

/// The derived sets of every cell.
#[must_use]
pub fn derived(grid: &FuzzyGrid, norm: Norm) -> Grid<Derived> {
    grid.map(|&cell| derive(cell, norm))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn safe(empty: f32, occupied: f32, norm: Norm) -> f32 {
        derive(Fuzzy { empty, occupied }, norm).safe
    }

    #[test]
    fn safety_is_as_computed_by_hand() {
        let cells = [(1.0, 0.0), (0.9, 0.05), (0.65, 0.1), (0.5, 0.5), (0.9, 0.9), (0.0, 0.0), (0.0, 1.0)];
        let product = [1.0, 0.6651, 0.2435, 0.0703, 0.0152, 0.0, 0.0];
        let minimum = [1.0, 0.81, 0.4225, 0.25, 0.10, 0.0, 0.0];
        for ((cell, product), minimum) in cells.into_iter().zip(product).zip(minimum) {
            approx::assert_abs_diff_eq!(safe(cell.0, cell.1, Norm::Product), product, epsilon = 6e-5);
            approx::assert_abs_diff_eq!(safe(cell.0, cell.1, Norm::Minimum), minimum, epsilon = 6e-5);
        }
        // E = 0.9, O = 0.05: A = 0, I = 0.05, so S = max(0, 0.81 + 0.95 − 1) → 0.76 → 0.76 + 0.95 − 1 = 0.71.
        approx::assert_abs_diff_eq!(safe(0.9, 0.05, Norm::Bounded), 0.71, epsilon = 1e-5);
    }

    #[test]
    fn a_little_occupied_evidence_may_make_safer() {
        approx::assert_abs_diff_eq!(safe(0.3, 0.0, Norm::Product), 0.0270, epsilon = 6e-5);
        approx::assert_abs_diff_eq!(safe(0.3, 0.2, Norm::Product), 0.0298, epsilon = 6e-5);
    }

    proptest::proptest! {
        #[test]
        fn safety_is_bounded_by_both_sets(empty in 0.0f32..=1.0, occupied in 0.0f32..=1.0) {
            for norm in [Norm::Product, Norm::Minimum, Norm::Bounded] {
                let sets = derive(Fuzzy { empty, occupied }, norm);
                proptest::prop_assert!(sets.safe <= empty * empty + 1e-6 && sets.safe <= 1.0 - occupied + 1e-6);
                proptest::prop_assert!((0.0..=1.0).contains(&sets.safe) && (0.0..=1.0).contains(&sets.ambiguous));
                proptest::prop_assert!((sets.safe + sets.unsafety - 1.0).abs() < 1e-6);
            }
        }
    }
}

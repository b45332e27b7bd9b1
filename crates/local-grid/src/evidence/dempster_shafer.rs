use super::{Cell, Evidence};

/// A cell of an evidential grid: masses of belief in "occupied" and "empty", the rest on "do not know".
///
/// Evidence is joined by Dempster's rule, with `k = o₁e₂ + e₁o₂` the mass on contradiction:
///
/// ```text
/// o = (o₁o₂ + o₁d₂ + d₁o₂) / (1 − k),   e likewise,   d = d₁d₂ / (1 − k)
/// ```
///
/// The weight of conflict `ln(1 / (1 − k))` adds up over a sequence (Shafer 1976); its sum tells where readings
/// contradict each other. Masses are capped at [`DempsterShafer::MAX_MASS`], since certainty could never be revised.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DempsterShafer {
    /// Mass on "occupied", in `[0, 1]`.
    pub occupied: f32,
    /// Mass on "empty", in `[0, 1]`.
    pub empty: f32,
    /// Sum of the weights of conflict, in nats, from 0 up.
    pub conflict: f32,
}

impl DempsterShafer {
    /// The most that a single reading can commit to one side.
    pub const MAX_MASS: f32 = 0.98;

    /// Mass on "do not know".
    #[must_use]
    pub fn unknown(&self) -> f32 {
        1.0 - self.occupied - self.empty
    }

    /// The pignistic probability of being occupied: ignorance split in halves.
    #[must_use]
    pub fn probability(&self) -> f32 {
        self.occupied + 0.5 * self.unknown()
    }
}

/// Masses as Dempster's rule takes them: capped, and scaled down where a reading claims more than one in all.
fn masses(evidence: Evidence) -> (f32, f32) {
    let cap = |mass: f32| mass.clamp(0.0, DempsterShafer::MAX_MASS);
    let (occupied, empty) = (cap(evidence.occupied), cap(evidence.empty));
    let total = (occupied + empty).max(1.0);
    (occupied / total, empty / total)
}

impl Cell for DempsterShafer {
    fn fuse(&mut self, evidence: Evidence) {
        let (occupied, empty) = masses(evidence);
        let unknown = 1.0 - occupied - empty;
        let agreement = 1.0 - (self.occupied * empty + self.empty * occupied);
        if agreement <= f32::MIN_POSITIVE {
            return; // total contradiction of two certainties, which the cap keeps out
        }
        let (was_occupied, was_empty, was_unknown) = (self.occupied, self.empty, self.unknown());
        self.occupied = (was_occupied * (occupied + unknown) + was_unknown * occupied) / agreement;
        self.empty = (was_empty * (empty + unknown) + was_unknown * empty) / agreement;
        self.conflict -= agreement.ln();
    }

    fn known(&self) -> Evidence {
        Evidence { empty: self.empty, occupied: self.occupied }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(evidence: &[(f32, f32)]) -> DempsterShafer {
        let mut cell = DempsterShafer::default();
        for &(occupied, empty) in evidence {
            cell.fuse(Evidence { empty, occupied });
        }
        cell
    }

    #[test]
    fn agreeing_masses_reinforce() {
        let cell = after(&[(0.4, 0.0), (0.6, 0.0)]);
        approx::assert_relative_eq!(cell.occupied, 0.76, epsilon = 1e-6);
        approx::assert_relative_eq!(cell.unknown(), 0.24, epsilon = 1e-6);
        assert_eq!(cell.conflict, 0.0);
    }

    #[test]
    fn contradiction_is_weighed() {
        let cell = after(&[(0.4, 0.0), (0.0, 0.6)]); // k = 0.24
        approx::assert_relative_eq!(cell.occupied, 0.2105, epsilon = 1e-4);
        approx::assert_relative_eq!(cell.empty, 0.4737, epsilon = 1e-4);
        approx::assert_relative_eq!(cell.unknown(), 0.3158, epsilon = 1e-4);
        approx::assert_relative_eq!(cell.conflict, 0.2744, epsilon = 1e-4);
    }

    #[test]
    fn the_vacuous_mass_is_neutral() {
        let cell = after(&[(0.4, 0.1)]);
        let mut same = cell;
        same.fuse(Evidence::default());
        approx::assert_relative_eq!(cell.occupied, same.occupied, epsilon = 1e-6);
        approx::assert_relative_eq!(cell.empty, same.empty, epsilon = 1e-6);
    }

    #[test]
    fn certain_contradictions_stay_finite() {
        let cell = after(&[(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]);
        assert!(cell.occupied.is_finite() && cell.empty.is_finite() && cell.conflict.is_finite());
    }
}

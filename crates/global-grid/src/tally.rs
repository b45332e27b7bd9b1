use local_grid::Fuzzy;

/// Fixed-point units in one natural unit (nat) of evidence, `2¹⁴`.
///
/// One unit is a degree of evidence of `6·10⁻⁵`; a cell holds up to `2³² / 2¹⁴ = 262,144` nats of each kind,
/// which is half a million full scans of one cell.
pub const UNITS_PER_NAT: f64 = 16_384.0;

/// The largest degree of evidence that one reading can give a cell, 0.98.
///
/// The complement of full evidence is zero, whose logarithm is infinite: such a cell could never be told otherwise,
/// and the contribution could not be taken out again.
pub const STRONGEST_EVIDENCE: f64 = 0.98;

/// What all readings together say of one cell: two exact sums, of empty and of occupied evidence.
///
/// The algebraic union `1 − (1−a)(1−b)` of degrees of evidence is a *sum* of `−ln(1−e)`. Kept as integers, in units of
/// `2⁻¹⁴` nat, these sums do not depend on the order of the readings, and a reading can be taken out exactly.
/// All three calculi are readings of such sums:
///
/// * fuzzy: `E = 1 − exp(−e)`, `O = 1 − exp(−o)` (Oriolo, Ulivi & Vendittelli 1997);
/// * Dempster-Shafer, each reading a simple support function for empty or for occupied: the commonalities multiply, so
///   the unnormalised masses are `m(O) = exp(−e)(1 − exp(−o))`, `m(E) = exp(−o)(1 − exp(−e))`, `m(Θ) = exp(−e−o)`;
/// * Bayes: `e` and `o` are the log-odds gathered against and for "occupied"; their difference is the cell's log-odds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Tally {
    /// Empty evidence in units of `2⁻¹⁴` nat.
    pub empty: u32,
    /// Occupied evidence in units of `2⁻¹⁴` nat.
    pub occupied: u32,
}

impl Tally {
    /// Whether no reading has said anything of this cell.
    #[must_use]
    pub fn is_unknown(self) -> bool {
        self.empty == 0 && self.occupied == 0
    }

    /// Empty evidence in nats, `−ln(1 − E)`.
    #[must_use]
    pub fn empty_nats(self) -> f64 {
        f64::from(self.empty) / UNITS_PER_NAT
    }

    /// Occupied evidence in nats, `−ln(1 − O)`.
    #[must_use]
    pub fn occupied_nats(self) -> f64 {
        f64::from(self.occupied) / UNITS_PER_NAT
    }

    /// The fuzzy cell: memberships in the empty and in the occupied set, from at most `most_evidence` nats in all.
    ///
    /// See [`GridOptions::most_evidence`](crate::GridOptions::most_evidence); infinite gives the plain union.
    #[must_use]
    pub fn fuzzy(self, most_evidence: f64) -> Fuzzy {
        let (empty, occupied) = (self.empty_nats(), self.occupied_nats());
        let counted = 1.0 / (1.0 + (empty + occupied) / most_evidence);
        Fuzzy { empty: membership(empty * counted), occupied: membership(occupied * counted) }
    }
}

/// `1 − exp(−nats)`, exact near zero.
#[expect(clippy::cast_possible_truncation, reason = "memberships are kept as f32")]
fn membership(nats: f64) -> f32 {
    -(-nats).exp_m1() as f32
}

/// `−ln(1 − e)`: a degree of evidence as a quantity that adds up.
pub(crate) fn nats(evidence: f64) -> f64 {
    -(-evidence).ln_1p()
}

/// Evidence in nats as fixed point, at most 3.99 nats.
pub(crate) fn units_of_nats(nats: f64) -> u16 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating by the language's rule")]
    let units = (nats * UNITS_PER_NAT).round() as u16;
    units
}

#[cfg(test)]
mod tests {
    use super::*;
    use local_grid::{Cell, Evidence};

    #[test]
    fn sums_are_the_algebraic_union() {
        let (mut cell, mut tally) = (Fuzzy::default(), Tally::default());
        for (empty, occupied) in [(0.1, 0.25), (0.3, 0.0), (0.02, 0.5)] {
            #[expect(clippy::cast_possible_truncation, reason = "a test value")]
            cell.fuse(Evidence { empty: empty as f32, occupied: occupied as f32 });
            tally.empty += u32::from(units_of_nats(nats(empty)));
            tally.occupied += u32::from(units_of_nats(nats(occupied)));
        }
        approx::assert_abs_diff_eq!(tally.fuzzy(f64::INFINITY).empty, cell.empty, epsilon = 1e-4); // three half units
        approx::assert_abs_diff_eq!(tally.fuzzy(f64::INFINITY).occupied, cell.occupied, epsilon = 1e-4);
    }

    #[test]
    fn however_many_readings_the_ratio_stays() {
        let cell = Tally { empty: 300 << 14, occupied: 100 << 14 }.fuzzy(8.0); // 300 and 100 nats
        approx::assert_abs_diff_eq!(cell.empty, 0.997, epsilon = 1e-3); // 1 − exp(−5.88)
        approx::assert_abs_diff_eq!(cell.occupied, 0.859, epsilon = 1e-3); // 1 − exp(−1.96)
    }

    #[test]
    fn the_strongest_evidence_fits() {
        assert_eq!(units_of_nats(nats(STRONGEST_EVIDENCE)), 64_095);
    }
}

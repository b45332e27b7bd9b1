use local_grid::{Fuzzy, FuzzyGrid};

/// Evidence, in nats, with which a well-seen empty cell is to appear: 95 % empty.
const CLEAR: f32 = 3.0;
/// The most by which evidence is multiplied.
const LONGEST: f32 = 40.0;

/// Shares of occupied evidence up to which a cell is empty, at which it is contradictory, and from which it is occupied.
const SHARES: [f32; 3] = [0.3, 0.5, 0.65];

/// By how much a map's evidence is multiplied before thresholds or eyes judge it, as a photograph is exposed by its subject.
///
/// How far a union of readings gets depends on how many there were and on how much each was trusted, so that a map of few or
/// timid readings stays far below any fixed threshold. Multiplying all evidence, empty and occupied alike, by one factor
/// keeps what the map says: it is what the same readings would say if each had come that many times. Degrees `d` are
/// evidence of `−ln(1 − d)` nats, so exposed they are `1 − (1 − d)^factor`.
///
/// ```
/// use global_grid::{Exposure, local_grid::Fuzzy};
///
/// let cell = Exposure::by(2.0).of_cell(Fuzzy { empty: 0.5, occupied: 0.1 });
/// assert!((cell.empty - 0.75).abs() < 1e-6 && (cell.occupied - 0.19).abs() < 1e-6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct Exposure(f32);

impl Default for Exposure {
    fn default() -> Self {
        Self(1.0)
    }
}

impl Exposure {
    /// Multiplies evidence by `factor`; nothing below 1, and 1 for what is no number.
    #[must_use]
    pub fn by(factor: f32) -> Self {
        Self(factor.max(1.0))
    }

    /// The exposure at which, of the cells that are rather empty than occupied, the clearest tenth is at least 95 % empty.
    /// A map that has that much evidence is left as it is.
    #[must_use]
    pub fn of(grid: &FuzzyGrid) -> Self {
        Self::of_all([grid])
    }

    /// One exposure for several maps together.
    #[must_use]
    pub fn of_all<'a>(grids: impl IntoIterator<Item = &'a FuzzyGrid>) -> Self {
        let cells = grids.into_iter().flat_map(|grid| grid.cells());
        let mut clear: Vec<f32> =
            cells.filter(|cell| cell.empty > cell.occupied).map(|cell| nats(cell.empty)).collect();
        if clear.is_empty() {
            return Self::default();
        }
        let at = clear.len() - 1 - clear.len() / 10;
        let (_, clear, _) = clear.select_nth_unstable_by(at, f32::total_cmp);
        Self((CLEAR / *clear).clamp(1.0, LONGEST))
    }

    /// The factor.
    #[must_use]
    pub fn factor(self) -> f32 {
        self.0
    }

    /// A cell's evidence after exposure, empty and occupied, in nats.
    pub(crate) fn nats(self, cell: Fuzzy) -> (f32, f32) {
        (self.0 * nats(cell.empty), self.0 * nats(cell.occupied))
    }

    /// How much is known of a cell after exposure, and which share of it says "occupied".
    pub(crate) fn known_and_share(self, cell: Fuzzy) -> (f32, f32) {
        let (empty, occupied) = self.nats(cell);
        let all = empty + occupied;
        (-(-all).exp_m1(), if all > 0.0 { occupied / all } else { 0.0 })
    }

    /// The degree to which a cell's readings contradict each other, as where furniture or a door was moved: how much is known
    /// of it, times how near its evidence is to the balance.
    ///
    /// `E · O` would not do: with enough readings it is high in every wall that rays pass by, and with few nowhere.
    #[must_use]
    pub fn contradiction(self, cell: Fuzzy) -> f32 {
        let (known, share) = self.known_and_share(cell);
        known * balance(share)
    }

    /// A cell's degrees after exposure.
    #[must_use]
    pub fn of_cell(self, cell: Fuzzy) -> Fuzzy {
        if self.0 <= 1.0 {
            return cell;
        }
        let (empty, occupied) = self.nats(cell);
        Fuzzy { empty: -(-empty).exp_m1(), occupied: -(-occupied).exp_m1() }
    }
}

/// How near a share of occupied evidence is to the balance: 1 where both sides weigh the same.
pub(crate) fn balance(share: f32) -> f32 {
    let [empty, even, occupied] = SHARES;
    let near = if share < even { (share - empty) / (even - empty) } else { (occupied - share) / (occupied - even) };
    near.clamp(0.0, 1.0)
}

/// A degree as evidence, in nats.
fn nats(degree: f32) -> f32 {
    -(-degree.clamp(0.0, 1.0 - 1e-7)).ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;
    use local_grid::GridFrame;
    use nalgebra::Point2;

    #[test]
    fn timid_maps_are_exposed_longer_and_sure_ones_are_left() {
        let frame = GridFrame::new(Point2::origin(), 0.1, 1, 3).unwrap();
        let grid = |empty| {
            let cells = [(empty, 0.0), (0.1, 0.0), (0.0, 0.4)].map(|(empty, occupied)| Fuzzy { empty, occupied });
            FuzzyGrid::from_cells(frame, cells.to_vec()).unwrap()
        };
        approx::assert_relative_eq!(Exposure::of(&grid(0.4)).factor(), 3.0 / 0.510_826, epsilon = 1e-3);
        assert_eq!(Exposure::of(&grid(0.99)).factor(), 1.0);
        assert_eq!(Exposure::of(&FuzzyGrid::new(frame)).factor(), 1.0);
        assert_eq!(Exposure::by(f32::NAN).factor(), 1.0);
    }

    #[test]
    fn only_balanced_evidence_contradicts_itself() {
        let of = |empty, occupied| Exposure::by(5.0).contradiction(Fuzzy { empty, occupied });
        assert!(of(0.4, 0.4) > 0.9, "timid, but balanced");
        assert_eq!(of(0.95, 0.999), 0.0, "a wall that rays pass by");
        assert_eq!(of(0.3, 0.1), 0.0, "floor with a stray echo");
        assert!(of(0.01, 0.01) < 0.1 && of(0.0, 0.0) == 0.0, "hardly anything known");
    }

    #[test]
    fn exposure_keeps_what_outweighs_what() {
        for (empty, occupied) in [(0.1, 0.2), (0.5, 0.4), (0.0, 0.3), (0.999, 0.2)] {
            let exposed = Exposure::by(7.0).of_cell(Fuzzy { empty, occupied });
            assert_eq!(exposed.empty > exposed.occupied, empty > occupied);
            assert!(exposed.empty >= empty && exposed.occupied >= occupied && exposed.empty <= 1.0);
        }
    }
}

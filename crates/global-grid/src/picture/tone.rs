use local_grid::Fuzzy;

use super::Rgb;
use crate::exposure::{Exposure, balance};

pub(super) const EMPTY: Rgb = [255, 255, 255];
pub(super) const OCCUPIED: Rgb = [16, 24, 32];
pub(super) const CONTRADICTORY: Rgb = [236, 112, 20];
pub(super) const UNEXPLORED: Rgb = [158, 172, 188];

/// The colour of a cell: how much evidence there is tells it from unexplored ground, and the share of occupied evidence
/// makes it white, orange where both sides are balanced, or black.
pub(super) fn color_of(exposure: Exposure, cell: Fuzzy) -> Rgb {
    let (known, share) = exposure.known_and_share(cell);
    let side = if share < 0.5 { EMPTY } else { OCCUPIED };
    mix(UNEXPLORED, mix(side, CONTRADICTORY, balance(share)), known)
}

/// `from` at 0, `to` at 1.
pub(super) fn mix(from: Rgb, to: Rgb, share: f32) -> Rgb {
    [0, 1, 2].map(|channel| {
        let mixed = f32::from(from[channel]) + share * (f32::from(to[channel]) - f32::from(from[channel]));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two bytes lies a byte")]
        let byte = mixed.round() as u8;
        byte
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_four_kinds_of_cells_differ() {
        let color = |empty, occupied| color_of(Exposure::default(), Fuzzy { empty, occupied });
        let kinds = [color(0.0, 0.0), color(1.0, 0.0), color(0.0, 1.0), color(1.0, 1.0)];
        assert_eq!(kinds, [UNEXPLORED, EMPTY, OCCUPIED, CONTRADICTORY]);
        assert!(color(0.95, 0.999).iter().all(|&channel| channel < 40), "3 nats against 7 are a wall");
        assert_eq!(color(f32::NAN, 0.0), [0, 0, 0], "nonsense is drawn, not fatal");
    }
}

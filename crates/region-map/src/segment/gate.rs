//! A straight cut through free space.

use crate::plane::Plane;

/// A straight cut between two wall cells that face each other, in cells.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gate {
    /// The two wall cells, `(row, column)`.
    pub(crate) ends: [(i32, i32); 2],
    /// Free width between them in cells.
    pub(crate) width: f64,
    /// How far the walls go on behind the ends in line with the cut, from 0 to 1.
    pub(crate) embedding: f64,
    /// On which side (−1 or +1) a passage begins that is no wider than the gate.
    pub(crate) mouth_of: Option<f64>,
    /// The space on both sides (−1 and +1) while only stronger gates are closed.
    pub(crate) before: [Beside; 2],
}

impl Gate {
    pub(crate) fn center(&self) -> (f64, f64) {
        let [(r0, c0), (r1, c1)] = self.ends;
        (f64::from(r0 + r1) / 2.0, f64::from(c0 + c1) / 2.0)
    }

    /// Unit vector from the first end to the second, `(row, column)`.
    pub(crate) fn along(&self) -> (f64, f64) {
        let [(r0, c0), (r1, c1)] = self.ends;
        let (dr, dc) = (f64::from(r1 - r0), f64::from(c1 - c0));
        let length = dr.hypot(dc).max(1e-9);
        (dr / length, dc / length)
    }

    /// Unit vector across, towards a side (−1 or +1), `(row, column)`.
    pub(crate) fn across(&self, side: f64) -> (f64, f64) {
        let (row, column) = self.along();
        (-column * side, row * side)
    }

    /// The width, made greater where the ends are not walls in line with the cut: such a cut is less likely a gate.
    pub(crate) fn cost(&self) -> f64 {
        self.width * (1.3 - 0.3 * self.embedding)
    }

    /// The free cells on the straight line between the ends.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two cells of the plane")]
    pub(crate) fn line<'a>(&self, free: &'a Plane<bool>) -> impl Iterator<Item = usize> + use<'a> {
        let [(r0, c0), (r1, c1)] = self.ends;
        let steps = (r1 - r0).abs().max((c1 - c0).abs()).max(1);
        let at = move |from: i32, to: i32, k: i32| {
            (f64::from(from) + f64::from(to - from) * f64::from(k) / f64::from(steps)).round() as usize
        };
        (0..=steps).map(move |k| at(r0, r1, k) * free.columns + at(c0, c1, k)).filter(|&index| free.cells[index])
    }
}

/// The space on one side of a gate, measured by chords parallel to it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Beside {
    /// Median length of the chords, in cells.
    pub(crate) chord: f64,
    /// How far from the gate the chords have gained half of what they gain, in cells.
    pub(crate) neck: f64,
    /// How wide space opens to both sides alike: upper quartile of twice the shorter halves of the chords, in cells.
    pub(crate) opening: f64,
}

/// Lengths in cells that decide what a pinch is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    /// What is narrower is a crack.
    pub(crate) narrowest: f64,
    /// What is wider is no gate.
    pub(crate) widest: f64,
    /// One metre.
    pub(crate) meter: f64,
    /// How far the faces of walls may be off, both sides together.
    pub(crate) roughness: f64,
}

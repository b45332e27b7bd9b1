//! Where a passage opens into a hall: a gate that widens on one side only, but there by far.

use std::ops::Range;

use crate::{distance::DistanceField, plane::cell, segment::chords::reach, segment::gate::Gate, segment::kept::Kept};

/// The disc that fits into a hall, 1.5 widths before its mouth, is at least this many times as wide as the mouth. A corridor
/// that meets another of its kind does not count.
const HALL: f64 = 2.4;

/// Passages are this wide, in metres: what is narrower is a gap, what is wider a hall itself.
const PASSAGE: Range<f64> = 0.6..2.5;

/// Where one wall of the passage runs on as a wall of the hall, only a corridor counts, and not a niche beside a cupboard: it is
/// at least this wide, in metres...
const CORRIDOR: f64 = 1.0;
/// ...as wide for this many widths...
const LONG: f64 = 1.9;
/// ...and its other wall turns away so that half a width into the hall this many widths are free beside the middle.
const TURNS_AWAY: f64 = 0.85;
/// There the disc fits so many widths aside of the middle of the passage, and that many or one more ahead.
const ASIDE: f64 = 0.7;
const AHEAD: f64 = 1.5;

/// Adds the mouths of passages to the gates, those of the widest halls first, one for each end of a passage.
pub(crate) fn add_mouths(field: &DistanceField, candidates: &[Gate], kept: &mut Kept) {
    let mut found: Vec<(f64, Gate)> = candidates
        .iter()
        .filter(|gate| PASSAGE.contains(&(gate.width / kept.meter())))
        .filter_map(|gate| mouth(field, gate, kept.meter()))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.ends.cmp(&b.1.ends)));
    for (_, gate) in found {
        if !kept.overlaps(&gate) && !kept.around(&gate).any(|other| same_passage(&gate, other)) {
            kept.push(gate);
        }
    }
}

/// Whether a gate lies within two widths of another.
fn same_passage(a: &Gate, b: &Gate) -> bool {
    let (p, q) = (a.center(), b.center());
    (p.0 - q.0).hypot(p.1 - q.1) < 2.0 * a.width.min(b.width)
}

/// How much wider the hall is than the gate, and the gate as the mouth of a passage, if it is one.
fn mouth(field: &DistanceField, gate: &Gate, meter: f64) -> Option<(f64, Gate)> {
    [-1.0, 1.0].into_iter().find_map(|side| {
        let ahead = Ahead { field, gate, side };
        if !ahead.is_passage(&[0.3, 0.7, 1.1]) {
            return None;
        }
        let is_corridor = gate.width >= CORRIDOR * meter && ahead.is_passage(&[LONG]);
        let turning = [-1.0, 1.0].into_iter().filter(|turn| is_corridor && ahead.turns_away(*turn));
        let beside = turning.map(|turn| ahead.room(AHEAD, ASIDE * turn).max(ahead.room(AHEAD + 1.0, ASIDE * turn)));
        let hall = beside.fold(ahead.room(AHEAD, 0.0), f64::max);
        (hall >= HALL).then(|| (hall, Gate { mouth_of: Some(-side), ..*gate }))
    })
}

/// What lies on one side of a gate, measured in its widths from its middle.
struct Ahead<'a> {
    field: &'a DistanceField,
    gate: &'a Gate,
    side: f64,
}

impl Ahead<'_> {
    /// The point so many widths ahead and aside.
    fn spot(&self, ahead: f64, aside: f64) -> (f64, f64) {
        let (center, across, along) = (self.gate.center(), self.gate.across(self.side), self.gate.along());
        let at = |center: f64, across: f64, along: f64| center + (ahead * across + aside * along) * self.gate.width;
        (at(center.0, across.0, along.0), at(center.1, across.1, along.1))
    }

    /// The width of the greatest disc around that point, in widths of the gate.
    fn room(&self, ahead: f64, aside: f64) -> f64 {
        2.0 * f64::from(self.field.squared.at(cell(self.spot(ahead, aside))).unwrap_or(0)).sqrt() / self.gate.width
    }

    /// Whether space is as wide as the gate so many widths behind it.
    fn is_passage(&self, behind: &[f64]) -> bool {
        behind.iter().all(|&widths| (0.7..1.4).contains(&self.room(-widths, 0.0)))
    }

    /// Whether the wall at one end of the gate, towards −1 or +1, ends there.
    fn turns_away(&self, turn: f64) -> bool {
        let free = |cell| self.field.squared.at(cell).is_some_and(|squared| squared > 0);
        let (along, width) = (self.gate.along(), self.gate.width);
        reach(free, self.spot(0.5, 0.0), (turn * along.0, turn * along.1), width) >= TURNS_AWAY * width
    }
}

//! Where a passage opens into a hall: a gate that widens on one side only, but there by far.

use crate::{
    distance::DistanceField,
    plane::cell,
    segment::gates::{Gate, Kept},
};

/// The disc that fits into a hall, 1.5 widths before its mouth, is at least this many times as wide as the mouth. A corridor
/// that meets another of its kind does not count.
const HALL: f64 = 2.4;

/// Passages are this wide, in metres: what is narrower is a gap, what is wider a hall itself.
const PASSAGE: std::ops::Range<f64> = 0.6..2.5;

/// Adds the mouths of passages to the gates, those of the widest halls first, one for each end of a passage.
pub(crate) fn add_mouths(field: &DistanceField, candidates: &[Gate], kept: &mut Kept) {
    let mut found: Vec<(f64, Gate)> = candidates
        .iter()
        .filter(|gate| PASSAGE.contains(&(gate.width / kept.meter())))
        .filter_map(|gate| mouth(field, gate))
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
fn mouth(field: &DistanceField, gate: &Gate) -> Option<(f64, Gate)> {
    let (center, width) = (gate.center(), gate.width);
    [-1.0, 1.0].into_iter().find_map(|side| {
        let across = gate.across(side);
        // Width of the disc that fits some widths of the gate away, in widths of the gate.
        let room = |widths: f64| {
            let at = cell((center.0 + widths * width * across.0, center.1 + widths * width * across.1));
            2.0 * f64::from(field.squared.at(at).unwrap_or(0)).sqrt() / width
        };
        let passage = [-0.3, -0.7, -1.1].into_iter().all(|widths| (0.7..1.4).contains(&room(widths)));
        (passage && room(1.5) >= HALL).then(|| (room(1.5), Gate { mouth_of: Some(-side), ..*gate }))
    })
}

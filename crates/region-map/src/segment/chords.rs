//! How wide space is beside a gate.

use crate::{
    plane::cell,
    segment::gate::{Beside, Gate},
};

/// At most about this many chords are measured on a side.
const CHORDS: f64 = 24.0;

/// Measures the chords on one side of a gate, up to `depth` away and as far as `most` to each side of its middle.
pub(crate) fn beside(
    inside: impl Fn((i32, i32)) -> bool + Copy,
    gate: &Gate,
    side: f64,
    depth: f64,
    most: f64,
) -> Beside {
    let (center, along, across) = (gate.center(), gate.along(), gate.across(side));
    let stride = (depth / CHORDS).floor().max(1.0);
    let (mut chords, mut openings) = (Vec::new(), Vec::new());
    let mut step = 1.0;
    while step <= depth {
        let from = (center.0 + step * across.0, center.1 + step * across.1);
        if inside(cell(from)) {
            let (left, right) = (reach(inside, from, along, most), reach(inside, from, (-along.0, -along.1), most));
            chords.push(1.0 + left + right);
            openings.push(1.0 + 2.0 * left.min(right));
        } else if step > 2.0 {
            break; // the line of the gate itself is two cells thick where it is slanting
        }
        step += stride;
    }
    let mut sorted = chords.clone();
    sorted.sort_by(f64::total_cmp);
    let chord = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let half = (gate.width + chord) / 2.0;
    #[expect(clippy::cast_precision_loss, reason = "a few dozen")]
    let neck = chords.iter().position(|&length| length >= half).unwrap_or(chords.len()) as f64 * stride;
    openings.sort_by(f64::total_cmp);
    let opening = openings.get(3 * openings.len() / 4).copied().unwrap_or(0.0);
    Beside { chord, neck, opening }
}

/// How far one can go from a place in a direction, in steps of one cell, up to `most`.
pub(crate) fn reach(inside: impl Fn((i32, i32)) -> bool, from: (f64, f64), along: (f64, f64), most: f64) -> f64 {
    let mut step = 1.0;
    while step <= most {
        if !inside(cell((from.0 + step * along.0, from.1 + step * along.1))) {
            return step - 1.0;
        }
        step += 1.0;
    }
    most
}

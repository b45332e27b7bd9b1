//! Where free space is pinched between two walls.

use crate::{
    distance::DistanceField,
    plane::Plane,
    segment::chords::{beside, reach},
    segment::gate::{Beside, Gate, Scale},
    segment::kept::Kept,
    segment::mouths::add_mouths,
};

/// Gates, and free space with its cracks closed.
pub(crate) struct Pinches {
    pub(crate) gates: Vec<Gate>,
    pub(crate) uncracked: Plane<bool>,
}

/// Finds pairs of wall cells that face each other across free space with nothing else as near to the middle between them
/// (critical points of the distance function), where space is wider on both sides.
///
/// Gates in line with walls come first, narrow before wide. Each is closed before the next is looked at, so that the room
/// behind a door does not make a corridor look wide.
pub(crate) fn find_gates(free: &Plane<bool>, field: &DistanceField, scale: Scale) -> Pinches {
    let mut uncracked = free.clone();
    let mut found = candidates(free, field, scale, &mut uncracked);
    found.sort_by(|a, b| {
        let loose = |gate: &Gate| gate.embedding < 0.5;
        loose(a).cmp(&loose(b)).then(a.cost().total_cmp(&b.cost())).then(a.ends.cmp(&b.ends))
    });
    let mut open = uncracked.clone();
    let mut kept = Kept::new(free, scale);
    for &gate in &found {
        if !kept.overlaps(&gate) && widens(&open, &gate, scale) {
            let gate = Gate { before: spaces_beside(&open, &gate, scale), ..gate };
            gate.line(free).for_each(|cell| open.cells[cell] = false);
            kept.push(gate);
        }
    }
    add_mouths(field, &found, &mut kept);
    Pinches { gates: kept.gates, uncracked }
}

/// Neighbouring cells whose nearest walls lie on opposite sides; where that is nearer than a gate, the crack is closed.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating by the language's rule")]
fn candidates(free: &Plane<bool>, field: &DistanceField, scale: Scale, uncracked: &mut Plane<bool>) -> Vec<Gate> {
    let columns = free.columns;
    let limit = ((scale.widest + 1.0) / 2.0).powi(2) as u32;
    let mut found = Vec::new();
    for index in columns..free.cells.len() - columns {
        let squared = field.squared.cells[index];
        if squared == 0 || squared > limit {
            continue;
        }
        for other in [index + 1, index + columns] {
            let [a, b] = [index, other].map(|cell| field.nearest.cells[cell]);
            if a == b || !free.cells[other] {
                continue;
            }
            let ends = [a, b].map(|wall| free.position(wall as usize));
            let span = f64::from(ends[0].0 - ends[1].0).powi(2) + f64::from(ends[0].1 - ends[1].1).powi(2);
            // Facing each other: the pair is nearly as far apart as the disc around the cell allows.
            let mut gate =
                Gate { ends, width: span.sqrt() - 1.0, embedding: 0.0, mouth_of: None, before: [Beside::default(); 2] };
            if span < 3.6 * f64::from(squared) || gate.width > scale.widest {
                continue;
            }
            if gate.width < scale.narrowest {
                gate.line(free).for_each(|cell| uncracked.cells[cell] = false);
            } else {
                gate.embedding = embedding(free, &gate, 0.5 * scale.meter);
                found.push(gate);
            }
        }
    }
    found
}

/// How far the walls go on behind both ends of the cut, as a share of `depth`.
fn embedding(free: &Plane<bool>, gate: &Gate, depth: f64) -> f64 {
    let wall = |cell| free.at(cell) != Some(true);
    let (along, [a, b]) = (gate.along(), gate.ends.map(|(row, column)| (f64::from(row), f64::from(column))));
    (reach(wall, b, along, depth) + reach(wall, a, (-along.0, -along.1), depth)) / (2.0 * depth.floor().max(1.0))
}

/// Whether space is wider on both sides of a gate: a first look that only sorts out what is hopeless.
fn widens(open: &Plane<bool>, gate: &Gate, scale: Scale) -> bool {
    let inside = |cell| open.at(cell) == Some(true);
    let depth = scale.meter.max(0.5 * gate.width);
    [-1.0, 1.0].into_iter().all(|side| gate.width < 0.9 * beside(inside, gate, side, depth, gate.width + 2.0).chord)
}

/// The space on both sides of a gate.
fn spaces_beside(open: &Plane<bool>, gate: &Gate, scale: Scale) -> [Beside; 2] {
    let inside = |cell| open.at(cell) == Some(true);
    [-1.0, 1.0].map(|side| beside(inside, gate, side, (1.5 * scale.meter).max(gate.width), 3.0 * gate.width))
}

//! Where free space is pinched between two walls.

use crate::{distance::DistanceField, plane::Plane};

/// A straight cut between two wall cells that face each other, in cells.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gate {
    /// The two wall cells, `(row, column)`.
    pub(crate) ends: [(i32, i32); 2],
    /// Free width between them in cells.
    pub(crate) width: f64,
    /// Width over the width of the space on both sides, the worse one.
    pub(crate) ratio: f64,
    /// Width as if the jambs were walls in line with the cut: greater where they are not.
    pub(crate) cost: f64,
    /// How far the walls go on behind the ends, 0 to 1.
    pub(crate) embedding: f64,
    /// On which side (−1 or +1) a passage begins that is no wider than the gate.
    pub(crate) mouth_of: Option<f64>,
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
}

/// Lengths in cells that decide what a pinch is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    pub(crate) narrowest: f64,
    pub(crate) widest: f64,
    pub(crate) meter: f64,
}

/// Finds pairs of wall cells that face each other across free space with nothing else as near to the middle between them
/// (critical points of the distance function), where space is wider on both sides.
///
/// Gates in line with walls come first, narrow before wide. Each is closed before the next is looked at, so that the room
/// behind a door does not make a corridor look wide.
pub(crate) fn find_gates(free: &Plane<bool>, field: &DistanceField, scale: Scale) -> Vec<Gate> {
    let mut candidates = candidates(free, field, scale);
    candidates.sort_by(|a, b| {
        (a.embedding < 0.5).cmp(&(b.embedding < 0.5)).then(a.cost.total_cmp(&b.cost)).then(a.ends.cmp(&b.ends))
    });
    let mut open = free.clone();
    let mut kept: Vec<Gate> = Vec::new();
    for mut gate in candidates.iter().copied() {
        if kept.iter().any(|other| near(&gate, other) && (alike(&gate, other, scale) || cross(&gate, other))) {
            continue;
        }
        gate.ratio = quick_ratio(&open, &gate, scale);
        if gate.ratio < 0.9 {
            line(free, &gate).for_each(|cell| open.cells[cell] = false);
            kept.push(gate);
        }
    }
    mouths(free, field, &candidates, scale, &mut kept);
    kept
}

/// Adds the gates where a passage opens into a hall: widening on one side only, but there by far.
fn mouths(free: &Plane<bool>, field: &DistanceField, candidates: &[Gate], scale: Scale, kept: &mut Vec<Gate>) {
    let mut found: Vec<(f64, Gate)> = candidates
        .iter()
        .filter(|gate| (0.6 * scale.meter..2.5 * scale.meter).contains(&gate.width))
        .filter_map(|gate| mouth(field, gate))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.ends.cmp(&b.1.ends)));
    for (_, gate) in found {
        if !kept.iter().any(|other| alike(&gate, other, scale) || cross(&gate, other) || same_passage(&gate, other)) {
            kept.push(gate);
        }
    }
    let _ = free;
}

fn same_passage(a: &Gate, b: &Gate) -> bool {
    let (p, q) = (a.center(), b.center());
    (p.0 - q.0).hypot(p.1 - q.1) < 2.0 * a.width.min(b.width)
}

/// The gate as the mouth of a passage, and the clearance of the hall before it.
fn mouth(field: &DistanceField, gate: &Gate) -> Option<(f64, Gate)> {
    let (center, along, width) = (gate.center(), gate.along(), gate.width);
    [-1.0, 1.0].into_iter().find_map(|side| {
        let clearance = |widths: f64| {
            let step = side * widths * width;
            let (row, column) = (center.0 - step * along.1, center.1 + step * along.0);
            field.squared.at(row.round() as i32, column.round() as i32).map_or(0.0, |squared| f64::from(squared).sqrt())
        };
        let hall = clearance(1.5);
        let passage = [-0.3, -0.7, -1.1].into_iter().all(|w| (0.35 * width..0.7 * width).contains(&clearance(w)));
        (hall >= 1.2 * width && passage).then(|| (hall / width, Gate { mouth_of: Some(-side), ..*gate }))
    })
}

/// Neighbouring cells whose nearest walls lie on opposite sides.
fn candidates(free: &Plane<bool>, field: &DistanceField, scale: Scale) -> Vec<Gate> {
    let columns = free.columns;
    let limit = ((scale.widest + 1.0) / 2.0).powi(2) as u32;
    let mut found = Vec::new();
    for row in 1..free.rows - 1 {
        for column in 1..columns - 1 {
            let index = row * columns + column;
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
                let span = f64::from((ends[0].0 - ends[1].0).pow(2) + (ends[0].1 - ends[1].1).pow(2));
                // Facing each other: the pair is nearly as far apart as the disc around the cell allows.
                if span < 3.6 * f64::from(squared) {
                    continue;
                }
                let mut gate =
                    Gate { ends, width: span.sqrt() - 1.0, ratio: 1.0, cost: 0.0, embedding: 0.0, mouth_of: None };
                if gate.width > scale.widest {
                    continue;
                }
                gate.embedding = embedding(free, &gate, 0.5 * scale.meter);
                gate.cost = gate.width * (1.3 - 0.3 * gate.embedding);
                found.push(gate);
            }
        }
    }
    found
}

/// The free cells on the straight line between the ends of a gate.
pub(crate) fn line<'a>(free: &'a Plane<bool>, gate: &Gate) -> impl Iterator<Item = usize> + 'a {
    let [(r0, c0), (r1, c1)] = gate.ends;
    let steps = (r1 - r0).abs().max((c1 - c0).abs()).max(1);
    (0..=steps)
        .map(move |k| {
            let at = |from: i32, to: i32| {
                (f64::from(from) + f64::from(to - from) * f64::from(k) / f64::from(steps)).round() as usize
            };
            at(r0, r1) * free.columns + at(c0, c1)
        })
        .filter(|&index| free.cells[index])
}

/// Free length from a point along a direction, in steps of one cell, up to `most`.
pub(crate) fn reach(inside: impl Fn(i32, i32) -> bool, from: (f64, f64), along: (f64, f64), most: f64) -> f64 {
    let mut step = 1.0;
    while step <= most {
        let (row, column) = (from.0 + step * along.0, from.1 + step * along.1);
        if !inside(row.round() as i32, column.round() as i32) {
            return step - 1.0;
        }
        step += 1.0;
    }
    most
}

/// The space on one side of a gate, measured by chords parallel to it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Beside {
    /// Median length of the chords, in cells.
    pub(crate) chord: f64,
    /// How many cells it takes until the chords have gained half of what they gain.
    pub(crate) neck: f64,
}

/// Measures the chords on one side of a gate, up to `depth` away.
pub(crate) fn beside(
    inside: impl Fn(i32, i32) -> bool + Copy,
    gate: &Gate,
    side: f64,
    depth: f64,
    most: f64,
) -> Beside {
    let (center, along) = (gate.center(), gate.along());
    let normal = (-along.1 * side, along.0 * side);
    let mut chords = Vec::new();
    let stride = (depth / 24.0).floor().max(1.0);
    let mut step = 1.0;
    while step <= depth {
        let from = (center.0 + step * normal.0, center.1 + step * normal.1);
        if inside(from.0.round() as i32, from.1.round() as i32) {
            chords.push(1.0 + reach(inside, from, along, most) + reach(inside, from, (-along.0, -along.1), most));
        } else if step > 2.0 {
            break;
        }
        step += stride;
    }
    let mut sorted = chords.clone();
    sorted.sort_by(f64::total_cmp);
    let chord = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let half = (gate.width + chord) / 2.0;
    Beside { chord, neck: chords.iter().position(|&c| c >= half).unwrap_or(chords.len()) as f64 * stride }
}

/// How far the walls go on behind both ends of the cut, as a share of `depth`.
fn embedding(free: &Plane<bool>, gate: &Gate, depth: f64) -> f64 {
    let wall = |row, column| free.at(row, column) != Some(true);
    let (u, [a, b]) = (gate.along(), gate.ends.map(|(r, c)| (f64::from(r), f64::from(c))));
    (reach(wall, b, u, depth) + reach(wall, a, (-u.0, -u.1), depth)) / (2.0 * depth.floor().max(1.0))
}

fn quick_ratio(free: &Plane<bool>, gate: &Gate, scale: Scale) -> f64 {
    let inside = |row, column| free.at(row, column) == Some(true);
    let depth = scale.meter.max(0.5 * gate.width);
    let most = 1.0 * gate.width + 2.0;
    let mut worst = 0.0_f64;
    for side in [-1.0, 1.0] {
        worst = worst.max(gate.width / beside(inside, gate, side, depth, most).chord.max(1e-9));
        if worst > 0.9 {
            return worst;
        }
    }
    worst
}

/// Whether two cuts can touch at all.
fn near(a: &Gate, b: &Gate) -> bool {
    let twice = |gate: &Gate| (gate.ends[0].0 + gate.ends[1].0, gate.ends[0].1 + gate.ends[1].1);
    let (p, q) = (twice(a), twice(b));
    let (rows, columns) = (f64::from(p.0 - q.0), f64::from(p.1 - q.1));
    let reach = a.width + b.width + 4.0;
    rows * rows + columns * columns <= reach * reach
}

/// Whether two cuts go from the same wall to the same wall.
fn alike(a: &Gate, b: &Gate, scale: Scale) -> bool {
    let near = |p: (i32, i32), q: (i32, i32)| f64::from(p.0 - q.0).hypot(f64::from(p.1 - q.1)) < 0.3 * scale.meter;
    let same_ends = (near(a.ends[0], b.ends[0]) && near(a.ends[1], b.ends[1]))
        || (near(a.ends[0], b.ends[1]) && near(a.ends[1], b.ends[0]));
    let (p, q) = (a.center(), b.center());
    let apart = (p.0 - q.0).hypot(p.1 - q.1);
    let (u, v) = (a.along(), b.along());
    let parallel = (u.0 * v.0 + u.1 * v.1).abs() > 0.9;
    same_ends || (parallel && apart < (0.25 * a.width.min(b.width)).max(0.3 * scale.meter))
}

fn cross(a: &Gate, b: &Gate) -> bool {
    let turn = |p: (i32, i32), q: (i32, i32), r: (i32, i32)| {
        (i64::from(q.0 - p.0) * i64::from(r.1 - p.1) - i64::from(q.1 - p.1) * i64::from(r.0 - p.0)).signum()
    };
    turn(a.ends[0], a.ends[1], b.ends[0]) * turn(a.ends[0], a.ends[1], b.ends[1]) < 0
        && turn(b.ends[0], b.ends[1], a.ends[0]) * turn(b.ends[0], b.ends[1], a.ends[1]) < 0
}

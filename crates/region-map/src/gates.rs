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
    pub(crate) widest: f64,
    pub(crate) meter: f64,
}

/// Finds pairs of wall cells that face each other across free space with nothing else as near to the middle between them
/// (critical points of the distance function), where space is wider on both sides.
pub(crate) fn find_gates(free: &Plane<bool>, field: &DistanceField, scale: Scale) -> Vec<Gate> {
    let columns = free.columns;
    let limit = ((scale.widest + 1.0) / 2.0).powi(2);
    let mut found = Vec::new();
    for row in 1..free.rows - 1 {
        for column in 1..columns - 1 {
            let index = row * columns + column;
            let squared = f64::from(field.squared.cells[index]);
            if !free.cells[index] || squared > limit {
                continue;
            }
            let a = field.nearest.cells[index];
            for other in [index + 1, index + columns] {
                let b = field.nearest.cells[other];
                if a == b || !free.cells[other] {
                    continue;
                }
                let (ar, ac) = free.position(a as usize);
                let (br, bc) = free.position(b as usize);
                let span = f64::from((ar - br).pow(2) + (ac - bc).pow(2));
                // Facing each other: the pair is as far apart as the disc around the cell allows.
                if span < 3.6 * squared {
                    continue;
                }
                let mut gate = Gate {
                    ends: [(ar, ac), (br, bc)],
                    width: span.sqrt() - 1.0,
                    ratio: 1.0,
                    cost: 0.0,
                    embedding: 0.0,
                };
                if gate.width > scale.widest {
                    continue;
                }
                gate.ratio = quick_ratio(free, &gate, scale);
                if gate.ratio < 0.9 {
                    gate.embedding = embedding(free, &gate, 0.5 * scale.meter);
                    gate.cost = gate.width * (1.3 - 0.3 * gate.embedding);
                    found.push(gate);
                }
            }
        }
    }
    thin_out(found, scale)
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

/// Median length of the chords parallel to the gate on one side of it, up to `depth` away.
pub(crate) fn median_chord(
    inside: impl Fn(i32, i32) -> bool + Copy,
    gate: &Gate,
    side: f64,
    depth: f64,
    most: f64,
) -> f64 {
    let (center, along) = (gate.center(), gate.along());
    let normal = (-along.1 * side, along.0 * side);
    let mut chords = Vec::new();
    let mut step = 1.0;
    while step <= depth {
        let from = (center.0 + step * normal.0, center.1 + step * normal.1);
        if inside(from.0.round() as i32, from.1.round() as i32) {
            chords.push(1.0 + reach(inside, from, along, most) + reach(inside, from, (-along.0, -along.1), most));
        } else if step > 2.0 {
            break;
        }
        step += 1.0;
    }
    chords.sort_by(f64::total_cmp);
    chords.get(chords.len() / 2).copied().unwrap_or(0.0)
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
    let most = gate.width * 1.5 + 0.5 * scale.meter;
    let mut worst = 0.0_f64;
    for side in [-1.0, 1.0] {
        worst = worst.max(gate.width / median_chord(inside, gate, side, depth, most).max(1e-9));
        if worst > 0.9 {
            return worst;
        }
    }
    worst
}

/// Keeps the narrowest of gates that lie over each other.
fn thin_out(mut found: Vec<Gate>, scale: Scale) -> Vec<Gate> {
    found.sort_by(|a, b| (a.cost + 2.0 * a.ratio).total_cmp(&(b.cost + 2.0 * b.ratio)));
    let mut kept: Vec<Gate> = Vec::new();
    for gate in found {
        let clear = kept.iter().all(|other| !alike(&gate, other, scale) && !cross(&gate, other));
        if clear {
            kept.push(gate);
        }
    }
    kept
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

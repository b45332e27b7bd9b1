//! Cuts free space at its gates and takes back the cuts that separate nothing worth a name.

use std::collections::BinaryHeap;

use crate::{
    components::components,
    gates::{Beside, Gate, Scale, beside, line},
    plane::Plane,
};

/// Cuts, labels and merges. Returns labels (0 = none) and the gates that stay.
pub(crate) fn carve(
    free: &Plane<bool>,
    gates: &[Gate],
    scale: Scale,
    least: f64,
) -> (Plane<u32>, Vec<(Gate, [u32; 2])>) {
    let mut open = free.clone();
    for gate in gates {
        line(free, gate).for_each(|cell| open.cells[cell] = false);
    }
    let parts = components(&open, 0);
    let labels = parts.labels(free.rows, free.columns);
    let sides: Vec<[u32; 2]> = gates.iter().map(|g| [-1.0, 1.0].map(|side| label_beside(&labels, g, side))).collect();
    let mut pieces = Pieces::new(labels, &parts.sizes(), gates.len(), least, scale);
    for (gate, floors) in gates.iter().zip(&mut pieces.floors) {
        if let Some(side) = gate.mouth_of {
            floors[usize::from(side > 0.0)] = f64::INFINITY;
        }
    }
    let mut queue: BinaryHeap<Weak> =
        (0..gates.len()).filter_map(|k| pieces.weakness(&gates[k], sides[k], k)).collect();
    while let Some(weakest) = queue.pop() {
        // Pieces only grow, so a gate only gains: what was measured before a merger is an upper bound.
        let Some(now) = pieces.weakness(&gates[weakest.gate], sides[weakest.gate], weakest.gate) else { continue };
        if now.excess < weakest.excess && queue.peek().is_some_and(|next| now < *next) {
            queue.push(now);
        } else if now.excess > 0.0 {
            pieces.join(gates, &sides, now.gate);
        } else {
            break;
        }
    }
    let kept: Vec<usize> =
        (0..gates.len()).filter(|&k| gates[k].width >= scale.narrowest && pieces.parted(sides[k])).collect();
    for (gate, sides) in gates.iter().zip(&sides) {
        let label = sides[0].max(sides[1]);
        line(free, gate).for_each(|cell| pieces.labels.cells[cell] = label);
    }
    let Pieces { mut labels, roots, .. } = pieces;
    let kept = kept.into_iter().map(|k| (gates[k], sides[k].map(|label| roots[label as usize]))).collect();
    labels.cells.iter_mut().for_each(|label| *label = roots[*label as usize]);
    (labels, kept)
}

/// How much too wide a gate is for what lies beside it; the weakest gate is the greatest.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Weak {
    excess: f64,
    gate: usize,
}

impl Eq for Weak {}

impl Ord for Weak {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.excess.total_cmp(&other.excess).then(other.gate.cmp(&self.gate))
    }
}

impl PartialOrd for Weak {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// Pieces of free space that grow together.
struct Pieces {
    labels: Plane<u32>,
    /// The piece that each first label belongs to now.
    roots: Vec<u32>,
    sizes: Vec<usize>,
    /// Least width beside each gate, known from pieces that were swallowed.
    floors: Vec<[f64; 2]>,
    least: f64,
    scale: Scale,
}

impl Pieces {
    fn new(labels: Plane<u32>, sizes: &[usize], n_gates: usize, least: f64, scale: Scale) -> Self {
        let roots = (0..=sizes.len() as u32).collect();
        Self { labels, roots, sizes: [&[0], sizes].concat(), floors: vec![[0.0; 2]; n_gates], least, scale }
    }

    fn parted(&self, sides: [u32; 2]) -> bool {
        let [a, b] = sides.map(|label| self.roots[label as usize]);
        a != 0 && b != 0 && a != b
    }

    fn join(&mut self, gates: &[Gate], sides: &[[u32; 2]], index: usize) {
        let [a, b] = sides[index].map(|label| self.roots[label as usize]);
        // What lies behind the gate of a passage is also what the gate at its other end leads to.
        for (tiny, other, side) in [(a, b, 1.0), (b, a, -1.0)] {
            if (self.sizes[tiny as usize] as f64) < self.least {
                let chord =
                    self.chord(&gates[index], side, other, 3.0).chord.max(self.floors[index][usize::from(side > 0.0)]);
                for (floors, sides) in self.floors.iter_mut().zip(sides) {
                    for (floor, &label) in floors.iter_mut().zip(sides) {
                        if self.roots[label as usize] == tiny {
                            *floor = floor.max(chord);
                        }
                    }
                }
            }
        }
        self.roots.iter_mut().filter(|root| **root == b).for_each(|root| *root = a);
        self.sizes[a as usize] += self.sizes[b as usize];
    }

    /// The excess of a gate, or `None` if it parts nothing.
    fn weakness(&self, gate: &Gate, sides: [u32; 2], index: usize) -> Option<Weak> {
        if !self.parted(sides) {
            return None;
        }
        let sides = sides.map(|label| self.roots[label as usize]);
        if sides.iter().any(|&side| (self.sizes[side as usize] as f64) < self.least) {
            return Some(Weak { excess: 10.0 + gate.cost, gate: index });
        }
        if gate.width < self.scale.narrowest {
            return None;
        }
        let limit = threshold(gate.width / self.scale.meter);
        let (mut least, mut neck) = (f64::INFINITY, 1.0);
        for ((side, root), floor) in [-1.0, 1.0].into_iter().zip(sides).zip(self.floors[index]) {
            let space = self.chord(gate, side, root, 1.1 / limit);
            least = least.min(space.chord.max(floor).max(1e-9));
            neck += space.neck;
        }
        let ratio = gate.width / least;
        let stout = (neck / (least - gate.width).max(1e-9) - 0.5).clamp(0.0, 1.0)
            * ((gate.width / self.scale.meter - 1.3) / 0.5).clamp(0.0, 1.0);
        Some(Weak { excess: ratio + 0.2 * (0.55 - gate.embedding).max(0.0) + 0.15 * stout - limit, gate: index })
    }

    /// The width of a piece beside a gate, as far as `most` times the width of the gate.
    fn chord(&self, gate: &Gate, side: f64, root: u32, most: f64) -> Beside {
        let inside = |row, column| self.labels.at(row, column).is_some_and(|label| self.roots[label as usize] == root);
        beside(inside, gate, side, (1.5 * self.scale.meter).max(gate.width), most * gate.width)
    }
}

/// The largest share of the width beside it that a gate of `width` metres may have.
fn threshold(width: f64) -> f64 {
    let ratio = if width < 2.2 {
        0.87
    } else if width < 3.0 {
        0.87 - 0.32 * (width - 2.2) / 0.8
    } else {
        0.55 - 0.15 * (width - 3.0)
    };
    let gain = 0.15 + 0.35 * ((width - 1.0) / 0.6).clamp(0.0, 1.0);
    ratio.min(width / (width + gain))
}

/// The label on one side of a gate.
fn label_beside(labels: &Plane<u32>, gate: &Gate, side: f64) -> u32 {
    let (center, along) = (gate.center(), gate.along());
    let normal = (-along.1 * side, along.0 * side);
    for step in 1..6 {
        let (r, c) = (center.0 + f64::from(step) * normal.0, center.1 + f64::from(step) * normal.1);
        match labels.at(r.round() as i32, c.round() as i32) {
            Some(label) if label > 0 => return label,
            _ => (),
        }
    }
    0
}

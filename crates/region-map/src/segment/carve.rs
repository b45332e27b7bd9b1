//! Cuts free space at its gates and takes back the cuts that separate nothing worth a name.

use std::collections::BinaryHeap;
use std::ops::Range;

use crate::{
    components::{Components, components},
    plane::{Plane, cell},
    segment::chords::beside,
    segment::gate::{Beside, Gate, Scale},
    segment::gates::Pinches,
};

/// A piece of fewer cells than a region has is merged before anything else.
const CRUMB: f64 = 10.0;

/// Labels of free space (0 = none), and the gates that stay with the labels on their sides (−1 and +1).
pub(crate) struct Carved {
    pub(crate) labels: Plane<u32>,
    pub(crate) gates: Vec<(Gate, [u32; 2])>,
}

/// Cuts at all gates and merges across those that are no bottleneck, the weakest first; `least` cells make a region.
pub(crate) fn carve(free: &Plane<bool>, pinches: &Pinches, scale: Scale, least: f64) -> Carved {
    let gates = &pinches.gates;
    let mut open = pinches.uncracked.clone();
    for gate in gates {
        gate.line(free).for_each(|cell| open.cells[cell] = false);
    }
    let parts = components(&open, 0);
    let mut pieces = Pieces::new(free, &parts, gates, least, scale);
    pieces.merge(gates);
    let stays = |k: &usize| pieces.parted(*k);
    let kept = (0..gates.len()).filter(stays).map(|k| (gates[k], pieces.roots_beside(k))).collect();
    let Pieces { mut labels, roots, sides, .. } = pieces;
    for (gate, sides) in gates.iter().zip(&sides) {
        gate.line(free).for_each(|cell| labels.cells[cell] = sides[0].max(sides[1]));
    }
    labels.cells.iter_mut().for_each(|label| *label = roots[*label as usize]);
    Carved { labels, gates: kept }
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
    /// The piece that each cell belonged to at first, 0 for none.
    labels: Plane<u32>,
    /// The piece that each first piece belongs to now.
    roots: Vec<u32>,
    /// Cells of each piece, by its root.
    sizes: Vec<usize>,
    /// The first pieces on both sides of each gate.
    sides: Vec<[u32; 2]>,
    /// Least width beside each gate, known from pieces that were swallowed.
    floors: Vec<[f64; 2]>,
    least: f64,
    scale: Scale,
}

impl Pieces {
    fn new(free: &Plane<bool>, parts: &Components, gates: &[Gate], least: f64, scale: Scale) -> Self {
        let (labels, sizes) = (parts.labels(free.rows, free.columns), [&[0], &parts.sizes()[..]].concat());
        let roots = (0..).take(sizes.len()).collect();
        let sides = gates.iter().map(|gate| [-1.0, 1.0].map(|side| label_beside(free, &labels, gate, side))).collect();
        // A passage is as wide as its mouth and need not be wider.
        let floor = |gate: &Gate, side: f64| if gate.mouth_of == Some(side) { f64::INFINITY } else { 0.0 };
        let floors = gates.iter().map(|gate| [-1.0, 1.0].map(|side| floor(gate, side))).collect();
        Self { labels, roots, sizes, sides, floors, least, scale }
    }

    /// Merges until every gate that is left is narrow for what lies beside it.
    fn merge(&mut self, gates: &[Gate]) {
        let mut queue: BinaryHeap<Weak> = (0..gates.len()).filter_map(|k| self.weakness(gates, k)).collect();
        while let Some(weakest) = queue.pop() {
            // Pieces only grow, so a gate only gains: what was measured before a merger is an upper bound.
            let Some(now) = self.weakness(gates, weakest.gate) else { continue };
            if now.excess < weakest.excess && queue.peek().is_some_and(|next| now < *next) {
                queue.push(now);
            } else if now.excess > 0.0 {
                self.join(gates, now.gate);
            } else {
                break;
            }
        }
    }

    /// The pieces beside a gate as they are now.
    fn roots_beside(&self, gate: usize) -> [u32; 2] {
        self.sides[gate].map(|label| self.roots[label as usize])
    }

    fn parted(&self, gate: usize) -> bool {
        let [a, b] = self.roots_beside(gate);
        a != 0 && b != 0 && a != b
    }

    #[expect(clippy::cast_precision_loss, reason = "grids have fewer than 2^52 cells")]
    fn is_crumb(&self, root: u32) -> bool {
        (self.sizes[root as usize] as f64) < self.least
    }

    fn join(&mut self, gates: &[Gate], index: usize) {
        let [a, b] = self.roots_beside(index);
        for (crumb, other, side) in [(a, b, 1), (b, a, 0)] {
            if self.is_crumb(crumb) {
                // What lies behind the gate of a short passage is also what the gate at its other end leads to.
                let toward = [-1.0, 1.0][side];
                let chord = self.space(&gates[index], toward, other, 3.0).chord.max(self.floors[index][side]);
                self.raise_floors(crumb, chord);
            }
        }
        self.roots.iter_mut().filter(|root| **root == b).for_each(|root| *root = a);
        self.sizes[a as usize] += self.sizes[b as usize];
    }

    /// Lets all gates of a piece know that it leads to something `chord` wide.
    fn raise_floors(&mut self, root: u32, chord: f64) {
        for (floors, sides) in self.floors.iter_mut().zip(&self.sides) {
            for (floor, &label) in floors.iter_mut().zip(sides) {
                if self.roots[label as usize] == root {
                    *floor = floor.max(chord);
                }
            }
        }
    }

    /// The excess of a gate, or `None` if it parts nothing.
    fn weakness(&self, gates: &[Gate], index: usize) -> Option<Weak> {
        if !self.parted(index) {
            return None;
        }
        let (gate, sides) = (&gates[index], self.roots_beside(index));
        if sides.into_iter().any(|side| self.is_crumb(side)) {
            return Some(Weak { excess: CRUMB + gate.cost(), gate: index });
        }
        let (meter, roughness) = (self.scale.meter, self.scale.roughness / self.scale.meter);
        let most = (1.1 / widest_share(gate.width / meter, roughness)).max(OPENS.end);
        let (mut chord, mut widest, mut neck) = (f64::INFINITY, 0.0_f64, 1.0);
        for (k, side) in [-1.0, 1.0].into_iter().enumerate() {
            let space = self.space(gate, side, sides[k], most);
            // A piece that weaker gates still cut short is no narrower than it was before they were closed.
            let before = gate.before[k];
            chord = chord.min(space.chord.max(before.chord).max(self.floors[index][k]).max(1e-9));
            widest = widest.max(space.opening).max(before.opening);
            neck += space.neck;
        }
        // Rough walls feign a narrow spot in a corridor, but no space that opens behind it.
        let opens = ((widest / gate.width - OPENS.start) / (OPENS.end - OPENS.start)).clamp(0.0, 1.0);
        let limit = widest_share(gate.width / meter, roughness * (1.0 - opens));
        let loose = 0.2 * (0.55 - gate.embedding).max(0.0);
        let excess = gate.width / chord + loose + self.stoutness(gate, chord, neck) - limit;
        Some(Weak { excess, gate: index })
    }

    /// A wall is thin for its length. What narrows a wide gate and is about as thick as it stands out is a plant or a
    /// cupboard.
    fn stoutness(&self, gate: &Gate, chord: f64, neck: f64) -> f64 {
        let stout = (neck / (chord - gate.width).max(1e-9) - 0.5).clamp(0.0, 1.0);
        let wide = ((gate.width / self.scale.meter - 1.3) / 0.5).clamp(0.0, 1.0);
        0.15 * stout * wide
    }

    /// The space of a piece beside a gate, as far as `most` times the width of the gate.
    fn space(&self, gate: &Gate, side: f64, root: u32, most: f64) -> Beside {
        let inside = |cell| self.labels.at(cell).is_some_and(|label| self.roots[label as usize] == root);
        beside(inside, gate, side, (1.5 * self.scale.meter).max(gate.width), most * gate.width)
    }
}

/// Space that is this many times as wide as a gate opens behind it: not at all at the start, surely at the end.
const OPENS: Range<f64> = 2.2..3.0;

/// The largest share of the width beside it that a gate of `width` metres may have.
///
/// Up to 2.2 m, the width of a double door, 0.87: hardly narrower than the space is no gate. A wider opening must be a
/// bottleneck more and more. And the jambs together must stand out by 0.15 m at a narrow door and 0.5 m at a wide one: frames
/// of doors in a corridor do not. Where walls are `roughness` metres rough, the jambs must stand out by that much more.
fn widest_share(width: f64, roughness: f64) -> f64 {
    let share = match width {
        _ if width < 2.2 => 0.87,
        _ if width < 3.0 => 0.87 - 0.4 * (width - 2.2),
        _ => (0.55 - 0.15 * (width - 3.0)).max(0.25),
    };
    let jambs = 0.15 + 0.35 * ((width - 1.0) / 0.6).clamp(0.0, 1.0) + roughness;
    share.min(width / (width + jambs))
}

/// The label on one side of a gate: that of the first labelled cell straight ahead, with no wall before it.
fn label_beside(free: &Plane<bool>, labels: &Plane<u32>, gate: &Gate, side: f64) -> u32 {
    let (center, across) = (gate.center(), gate.across(side));
    let at = |step: i32| cell((center.0 + f64::from(step) * across.0, center.1 + f64::from(step) * across.1));
    let ahead = (1..6).map(at).take_while(|&cell| free.at(cell) == Some(true));
    ahead.filter_map(|cell| labels.at(cell)).find(|&label| label > 0).unwrap_or(0)
}

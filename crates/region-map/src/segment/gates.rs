//! Where free space is pinched between two walls.

use crate::{
    distance::DistanceField,
    plane::Plane,
    segment::chords::{Beside, beside, reach},
    segment::mouths::add_mouths,
};

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

/// Gates that do not lie over each other, found again by where they are.
pub(crate) struct Kept {
    pub(crate) gates: Vec<Gate>,
    /// Indices of the gates whose middle lies in each square.
    squares: Plane<Vec<usize>>,
    side: i32,
    scale: Scale,
}

impl Kept {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few cells, at least one")]
    fn new(free: &Plane<bool>, scale: Scale) -> Self {
        let side = (scale.widest + 3.0).clamp(8.0, 1e6) as usize;
        let (rows, columns) = (free.rows / side + 1, free.columns / side + 1);
        let squares = Plane { rows, columns, cells: vec![Vec::new(); rows * columns] };
        Self { gates: Vec::new(), squares, side: i32::try_from(side).unwrap_or(i32::MAX), scale }
    }

    /// One metre in cells.
    pub(crate) fn meter(&self) -> f64 {
        self.scale.meter
    }

    fn square(&self, gate: &Gate) -> (i32, i32) {
        let [(r0, c0), (r1, c1)] = gate.ends;
        ((r0 + r1) / 2 / self.side, (c0 + c1) / 2 / self.side)
    }

    #[expect(clippy::cast_sign_loss, reason = "rows and columns of the plane")]
    pub(crate) fn push(&mut self, gate: Gate) {
        let (row, column) = self.square(&gate);
        self.squares.cells[row as usize * self.squares.columns + column as usize].push(self.gates.len());
        self.gates.push(gate);
    }

    /// The gates whose middles are within the widest width of the middle of a gate.
    pub(crate) fn around(&self, gate: &Gate) -> impl Iterator<Item = &Gate> {
        let (row, column) = self.square(gate);
        let squares = (-1..=1).flat_map(move |down| (-1..=1).map(move |right| (row + down, column + right)));
        let indices = squares.filter_map(|square| self.squares.get(square)).flatten();
        indices.map(|&index| &self.gates[index])
    }

    /// Whether the gate crosses another or goes from the same wall to the same wall.
    pub(crate) fn overlaps(&self, gate: &Gate) -> bool {
        self.around(gate).any(|other| near(gate, other) && (alike(gate, other, self.scale) || cross(gate, other)))
    }
}

/// Whether two cuts can touch at all.
fn near(a: &Gate, b: &Gate) -> bool {
    let (p, q) = (a.center(), b.center());
    let reach = (a.width + b.width) / 2.0 + 2.0;
    (p.0 - q.0).powi(2) + (p.1 - q.1).powi(2) <= reach * reach
}

/// Whether two cuts go from the same wall to the same wall.
fn alike(a: &Gate, b: &Gate, scale: Scale) -> bool {
    let close = |p: (i32, i32), q: (i32, i32)| f64::from(p.0 - q.0).hypot(f64::from(p.1 - q.1)) < 0.3 * scale.meter;
    let [a0, a1] = a.ends;
    let [b0, b1] = b.ends;
    let same_ends = (close(a0, b0) && close(a1, b1)) || (close(a0, b1) && close(a1, b0));
    let (p, q) = (a.center(), b.center());
    let apart = (p.0 - q.0).hypot(p.1 - q.1);
    let (u, v) = (a.along(), b.along());
    let parallel = (u.0 * v.0 + u.1 * v.1).abs() > 0.9;
    same_ends || (parallel && apart < (0.25 * a.width.min(b.width)).max(0.3 * scale.meter))
}

fn cross(a: &Gate, b: &Gate) -> bool {
    let turn = |p: (i32, i32), q: (i32, i32), r: (i32, i32)| {
        let wide = |to: i32, from: i32| i64::from(to) - i64::from(from);
        (wide(q.0, p.0) * wide(r.1, p.1) - wide(q.1, p.1) * wide(r.0, p.0)).signum()
    };
    let parts = |one: &Gate, two: &Gate| {
        let [from, to] = one.ends;
        turn(from, to, two.ends[0]) * turn(from, to, two.ends[1]) < 0
    };
    parts(a, b) && parts(b, a)
}

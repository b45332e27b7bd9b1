//! Gates that exclude each other.

use crate::{
    plane::Plane,
    segment::gate::{Gate, Scale},
};

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
    pub(crate) fn new(free: &Plane<bool>, scale: Scale) -> Self {
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

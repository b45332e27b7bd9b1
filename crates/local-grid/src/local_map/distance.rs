use super::patch::{Patches, Walls};

/// The cells around a wall to which it may be the nearest, with what they would know of it.
#[derive(Debug, Clone)]
pub(super) struct Disc {
    radius: i32,
    /// The square, in cells, of the distance of no wall near: one more than any in the disc.
    far: i32,
    /// Of the rows from −radius to radius: how far the disc extends to either side.
    extents: Vec<i32>,
    /// What the cells of the square around the disc would know, row by row.
    nearest: Vec<Nearest>,
}

/// What a cell knows of the nearest wall: in the upper half the square of its distance in cells, in the lower half which of the
/// cells around the wall this one is. The lesser is the nearer.
pub(super) type Nearest = i32;

/// The square of the distance in cells.
#[expect(clippy::cast_sign_loss, reason = "squares are not negative")]
pub(super) fn square(nearest: Nearest) -> usize {
    (nearest >> 16) as usize
}

/// Whether the cell is a wall itself.
pub(super) fn is_wall(nearest: Nearest) -> bool {
    nearest < 1 << 16
}

impl Disc {
    #[expect(clippy::cast_possible_truncation, reason = "at most 100 cells")]
    pub(super) fn new(resolution: f64, max_distance: f64) -> Self {
        let radius = (max_distance / resolution).floor().min(100.0) as i32;
        let rows = -radius..=radius;
        let distance = |x: i32, y: i32| resolution * f64::from(x).hypot(f64::from(y));
        // −1 where not even the row's middle is near enough.
        let extent = |y| (0..=radius).rev().find(|x| distance(*x, y) < max_distance).unwrap_or(-1);
        let square = rows.clone().flat_map(|y| rows.clone().map(move |x| x * x + y * y));
        Self {
            radius,
            far: (max_distance / resolution).powi(2).min(2e4) as i32 + 1,
            extents: rows.clone().map(extent).collect(),
            nearest: square.zip(0..).map(|(square, cell)| square << 16 | cell).collect(),
        }
    }

    /// What a cell knows that has no wall near.
    pub(super) fn none(&self) -> Nearest {
        self.far << 16
    }

    /// The distances in metres by their squares in cells; the last is that of no wall near.
    #[expect(clippy::cast_possible_truncation, reason = "distances are single")]
    pub(super) fn metres(&self, resolution: f64, max_distance: f64) -> Vec<f32> {
        let metres = (0..self.far).map(|square| (resolution * f64::from(square).sqrt()) as f32);
        metres.chain([max_distance as f32]).collect()
    }

    /// Takes a new wall into account: all cells to which it is nearer than what they knew.
    pub(super) fn lower(&self, patches: &mut Patches, wall: (i32, i32)) {
        self.visit(patches, wall, |cells, new, _| {
            for (known, new) in cells.iter_mut().zip(new) {
                *known = (*known).min(*new);
            }
        });
    }

    /// Forgets a wall: the cells to which it was the nearest look for another one.
    pub(super) fn raise(&self, patches: &mut Patches, (x, y): (i32, i32)) {
        let mut orphans = Vec::new();
        self.visit(patches, (x, y), |cells, old, (first, row)| {
            for ((known, old), column) in cells.iter_mut().zip(old).zip(first..) {
                if known == old {
                    *known = self.none();
                    orphans.push((column, row));
                }
            }
        });
        if orphans.is_empty() {
            return;
        }
        // All walls that can be nearest to a cell for which this one was.
        let walls = patches.walls_around((x, y), 2 * self.radius);
        for cell in orphans {
            self.adopt(patches, cell, &walls);
        }
    }

    /// Visits the cells of the disc around a wall as runs of one row and patch: what they know, what the wall would tell them, and
    /// where the first of them lies.
    fn visit(
        &self,
        patches: &mut Patches,
        (x, y): (i32, i32),
        mut of: impl FnMut(&mut [Nearest], &[Nearest], (i32, i32)),
    ) {
        let radius = self.radius;
        patches.visit_square((x - radius, y - radius), (x + radius, y + radius), |Walls { cells, low, high }| {
            for row in low.1.max(y - radius)..=high.1.min(y + radius) {
                let extent = self.extents[index(row - y + radius)];
                let (first, last) = (low.0.max(x - extent), high.0.min(x + extent));
                if first <= last {
                    let count = index(last - first + 1);
                    let known = index((row - low.1) * (high.0 - low.0 + 1) + first - low.0);
                    let told = index((row - y + radius) * (2 * radius + 1) + first - x + radius);
                    of(&mut cells[known..known + count], &self.nearest[told..told + count], (first, row));
                }
            }
        });
    }

    fn adopt(&self, patches: &mut Patches, (x, y): (i32, i32), walls: &[(i32, i32)]) {
        let square = |&&(wx, wy): &&(i32, i32)| (wx - x).pow(2) + (wy - y).pow(2);
        let Some(&(wx, wy)) = walls.iter().min_by_key(square) else { return };
        let (dx, dy, radius) = (x - wx, y - wy, self.radius);
        if dx.abs() > radius || dy.abs() > radius || dx.abs() > self.extents[index(dy + radius)] {
            return;
        }
        if let Some((cells, at)) = patches.at_mut((x, y)) {
            cells.nearest[at] = self.nearest[index((dy + radius) * (2 * radius + 1) + dx + radius)];
        }
    }
}

#[expect(clippy::cast_sign_loss, reason = "counted from the corner of a square that holds it")]
fn index(from_corner: i32) -> usize {
    from_corner as usize
}

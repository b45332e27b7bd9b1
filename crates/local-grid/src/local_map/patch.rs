use nalgebra::Vector2;

use crate::Evidence;

/// Cells along the edge of a patch, a power of two.
const EDGE: i32 = 32;
const AREA: usize = (EDGE * EDGE) as usize;
/// The most patches that the index may span: a square of 4096 patches, 6.5 km at cells of 0.05 m.
const MOST_PATCHES: i64 = 1 << 24;
const NO_PATCH: u32 = u32::MAX;

/// A square of cells, each property by itself.
#[derive(Debug, Clone)]
pub(super) struct Cells {
    /// Metres to the nearest wall.
    pub(super) distance: [f32; AREA],
    /// Steps to the nearest wall, in cells.
    pub(super) toward: [(i8, i8); AREA],
    pub(super) hits: [u16; AREA],
    pub(super) misses: [u16; AREA],
}

impl Cells {
    pub(super) fn is_known(&self, at: usize) -> bool {
        self.hits[at] > 0 || self.misses[at] > 0
    }

    pub(super) fn is_wall(&self, at: usize, share: f64) -> bool {
        let (hits, misses) = (f64::from(self.hits[at]), f64::from(self.misses[at]));
        hits > 0.0 && hits >= share * (hits + misses)
    }

    pub(super) fn evidence(&self, at: usize) -> Evidence {
        let (hits, all) = (f32::from(self.hits[at]), f32::from(self.hits[at]) + f32::from(self.misses[at]));
        if all == 0.0 { Evidence::default() } else { Evidence { empty: 1.0 - hits / all, occupied: hits / all } }
    }
}

/// All patches, and a dense index of the rectangle they span.
#[derive(Debug, Clone)]
pub(super) struct Patches {
    far: f32,
    low: (i32, i32),
    columns: i32,
    rows: i32,
    index: Vec<u32>,
    corners: Vec<(i32, i32)>,
    patches: Vec<Box<Cells>>,
}

/// The cell of a point given in cells, if it is one.
#[expect(clippy::cast_possible_truncation, reason = "checked")]
pub(super) fn cell_of(point: Vector2<f64>) -> Option<(i32, i32)> {
    let fits = |at: f64| at.abs() < 1e9; // false for NaN
    (fits(point.x) && fits(point.y)).then(|| (point.x.floor() as i32, point.y.floor() as i32))
}

/// The cell's place within its patch.
#[expect(clippy::cast_sign_loss, reason = "a remainder is not negative")]
fn within((x, y): (i32, i32)) -> usize {
    (y.rem_euclid(EDGE) * EDGE + x.rem_euclid(EDGE)) as usize
}

/// The index of a cell counted from the corner of a patch, if it lies in it.
#[expect(clippy::cast_sign_loss, reason = "checked")]
fn within_patch(x: i32, y: i32) -> Option<usize> {
    ((x | y) & !(EDGE - 1) == 0).then_some((y * EDGE + x) as usize)
}

/// The indices of the cells from `first` to the column `end` of the same patch.
#[expect(clippy::cast_sign_loss, reason = "the first is no farther than the end")]
fn run(first: (i32, i32), end: i32) -> std::ops::Range<usize> {
    let start = within(first);
    start..start + (end - first.0 + 1) as usize
}

impl Patches {
    pub(super) fn new(far: f32) -> Self {
        Self { far, low: (0, 0), columns: 0, rows: 0, index: Vec::new(), corners: Vec::new(), patches: Vec::new() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.patches.is_empty()
    }

    /// Makes the index span the cells from `low` to `high` as well; false if it would grow too large.
    pub(super) fn cover(&mut self, low: Option<(i32, i32)>, high: Option<(i32, i32)>) -> bool {
        let (Some(low), Some(high)) = (low, high) else { return false };
        // One patch more all round: distances spread a little beyond what rays reach.
        let (mut x0, mut y0) = (low.0.div_euclid(EDGE) - 4, low.1.div_euclid(EDGE) - 4);
        let (mut x1, mut y1) = (high.0.div_euclid(EDGE) + 5, high.1.div_euclid(EDGE) + 5);
        if !self.index.is_empty() {
            (x0, y0) = (x0.min(self.low.0), y0.min(self.low.1));
            (x1, y1) = (x1.max(self.low.0 + self.columns), y1.max(self.low.1 + self.rows));
        }
        let (columns, rows) = (x1 - x0, y1 - y0);
        if (x0, y0) == self.low && columns == self.columns && rows == self.rows {
            return true;
        }
        if i64::from(columns) * i64::from(rows) > MOST_PATCHES {
            return false;
        }
        self.low = (x0, y0);
        (self.columns, self.rows) = (columns, rows);
        self.index = vec![NO_PATCH; slot_count(columns, rows)];
        for number in 0..self.corners.len() {
            if let Some(slot) = self.slot(self.corners[number]) {
                self.index[slot] = u32::try_from(number).unwrap_or(NO_PATCH);
            }
        }
        true
    }

    /// Where the index keeps a patch.
    #[expect(clippy::cast_sign_loss, reason = "checked")]
    fn slot(&self, (x, y): (i32, i32)) -> Option<usize> {
        let (column, row) = (x - self.low.0, y - self.low.1);
        let inside = column >= 0 && row >= 0 && column < self.columns && row < self.rows;
        inside.then(|| row as usize * self.columns as usize + column as usize)
    }

    fn number(&self, (x, y): (i32, i32)) -> Option<usize> {
        let slot = self.slot((x.div_euclid(EDGE), y.div_euclid(EDGE)))?;
        let number = self.index[slot];
        (number != NO_PATCH).then_some(number as usize)
    }

    pub(super) fn at(&self, cell: (i32, i32)) -> Option<(&Cells, usize)> {
        Some((&self.patches[self.number(cell)?], within(cell)))
    }

    /// The cell's patch, made if need be; `None` outside of what is covered.
    pub(super) fn at_mut(&mut self, cell: (i32, i32)) -> Option<(&mut Cells, usize)> {
        let number = self.number_or_new(cell)?;
        Some((&mut self.patches[number], within(cell)))
    }

    fn number_or_new(&mut self, (x, y): (i32, i32)) -> Option<usize> {
        let corner = (x.div_euclid(EDGE), y.div_euclid(EDGE));
        let slot = self.slot(corner)?;
        if self.index[slot] == NO_PATCH {
            self.index[slot] = u32::try_from(self.patches.len()).ok()?;
            self.corners.push(corner);
            self.patches.push(Box::new(Cells {
                distance: [self.far; AREA],
                toward: [(0, 0); AREA],
                hits: [0; AREA],
                misses: [0; AREA],
            }));
        }
        Some(self.index[slot] as usize)
    }

    /// Visits the cells from `from` to `to` (in cells), patch by patch; the last one is that of `to`, and `visit` is told so.
    pub(super) fn walk(
        &mut self,
        from: Vector2<f64>,
        to: Vector2<f64>,
        mut visit: impl FnMut(&mut Cells, usize, (i32, i32), bool),
    ) {
        let (Some((mut x, mut y)), Some(last)) = (cell_of(from), cell_of(to)) else { return };
        let direction = to - from;
        let (step_x, mut next_x, per_x) = steps(from.x, direction.x);
        let (step_y, mut next_y, per_y) = steps(from.y, direction.y);
        let mut left = (last.0 - x).unsigned_abs() + (last.1 - y).unsigned_abs();
        loop {
            let Some(number) = self.number_or_new((x, y)) else { return };
            let (cells, corner) = (&mut *self.patches[number], (x & !(EDGE - 1), y & !(EDGE - 1)));
            while let Some(at) = within_patch(x - corner.0, y - corner.1) {
                visit(cells, at, (x, y), left == 0);
                if left == 0 {
                    return;
                }
                left -= 1;
                // Rounding may not lead past the last column or row.
                if (next_x < next_y && x != last.0) || y == last.1 {
                    x += step_x;
                    next_x += per_x;
                } else {
                    y += step_y;
                    next_y += per_y;
                }
            }
        }
    }

    /// Visits the cells of one row from column `from` to `to`, both included, as runs of neighbours in one patch: the patch, the
    /// index of the run's first cell, its column, and how many there are. Patches are made if need be.
    pub(super) fn row_mut(
        &mut self,
        y: i32,
        from: i32,
        to: i32,
        mut visit: impl FnMut(&mut Cells, std::ops::Range<usize>, i32),
    ) {
        let mut x = from;
        while x <= to {
            let end = (x | (EDGE - 1)).min(to);
            if let Some(number) = self.number_or_new((x, y)) {
                visit(&mut self.patches[number], run((x, y), end), x);
            }
            x = end + 1;
        }
    }

    /// The walls, cells at no distance from one, whose row and column lie up to `reach` from those of `(x, y)`, row by row.
    pub(super) fn walls_around(&self, (x, y): (i32, i32), reach: i32) -> Vec<(i32, i32)> {
        let mut walls = Vec::new();
        for row in y - reach..=y + reach {
            let mut column = x - reach;
            while column <= x + reach {
                let end = (column | (EDGE - 1)).min(x + reach);
                if let Some(number) = self.number((column, row)) {
                    let distances = &self.patches[number].distance[run((column, row), end)];
                    let found = (column..).zip(distances).filter(|(_, distance)| **distance == 0.0);
                    walls.extend(found.map(|(column, _)| (column, row)));
                }
                column = end + 1;
            }
        }
        walls
    }

    /// Distance at a point given in cells, and its gradient per cell, bilinear between the centres of cells.
    pub(super) fn interpolate(&self, point: Vector2<f64>) -> (f64, Vector2<f64>) {
        let at = point - Vector2::repeat(0.5);
        let Some((x, y)) = cell_of(at) else { return (f64::from(self.far), Vector2::zeros()) };
        let (fx, fy) = (at.x - f64::from(x), at.y - f64::from(y));
        let [d00, d10, d01, d11] = self.square(x, y);
        let (low, high) = (d00 + (d10 - d00) * fx, d01 + (d11 - d01) * fx);
        let gradient = Vector2::new((d10 - d00) * (1.0 - fy) + (d11 - d01) * fy, high - low);
        (low + (high - low) * fy, gradient)
    }

    /// The distances at four cells: at `(x, y)`, right of it, above it, and diagonally.
    fn square(&self, x: i32, y: i32) -> [f64; 4] {
        let edge = usize::try_from(EDGE).unwrap_or(0);
        if x.rem_euclid(EDGE) < EDGE - 1 && y.rem_euclid(EDGE) < EDGE - 1 {
            let Some((cells, at)) = self.at((x, y)) else { return [f64::from(self.far); 4] };
            let d = &cells.distance;
            return [d[at], d[at + 1], d[at + edge], d[at + edge + 1]].map(f64::from);
        }
        let d = |cell| self.at(cell).map_or(self.far, |(cells, at)| cells.distance[at]);
        [d((x, y)), d((x + 1, y)), d((x, y + 1)), d((x + 1, y + 1))].map(f64::from)
    }

    /// Every cell of every patch, in the order in which patches were made.
    pub(super) fn cells(&self) -> impl Iterator<Item = (&Cells, usize, (i32, i32))> + '_ {
        self.patches.iter().zip(&self.corners).flat_map(|(cells, &(x, y))| {
            (0..EDGE).flat_map(move |row| {
                (0..EDGE).map(move |column| {
                    let cell = (x * EDGE + column, y * EDGE + row);
                    (&**cells, within(cell), cell)
                })
            })
        })
    }
}

#[expect(clippy::cast_sign_loss, reason = "both are counts")]
fn slot_count(columns: i32, rows: i32) -> usize {
    columns as usize * rows as usize
}

/// Along one axis: the step to the next cell, how far along the ray (as share of it) its border is, and borders lie apart.
fn steps(start: f64, direction: f64) -> (i32, f64, f64) {
    if direction == 0.0 {
        return (0, f64::INFINITY, f64::INFINITY);
    }
    let fraction = start - start.floor();
    let to_border = if direction > 0.0 { 1.0 - fraction } else { fraction };
    (if direction > 0.0 { 1 } else { -1 }, to_border / direction.abs(), 1.0 / direction.abs())
}

use nalgebra::Vector2;

use super::distance::{Nearest, is_wall, square};
use super::line::Line;
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
    /// The nearest wall.
    pub(super) nearest: [Nearest; AREA],
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
    /// Distances in metres by their squares in cells; the last is that of no wall near.
    metres: Vec<f32>,
    /// What a cell knows that has no wall near.
    none: Nearest,
    low: (i32, i32),
    columns: i32,
    rows: i32,
    index: Vec<u32>,
    corners: Vec<(i32, i32)>,
    patches: Vec<Box<Cells>>,
}

/// What the cells of a patch know of the nearest walls, row by row, and which cells the patch spans.
pub(super) struct Walls<'a> {
    pub(super) cells: &'a mut [Nearest; AREA],
    pub(super) low: (i32, i32),
    pub(super) high: (i32, i32),
}

/// The cell of a point given in cells, if it is one.
pub(super) fn cell_of(point: Vector2<f64>) -> Option<(i32, i32)> {
    let fits = |at: f64| at.abs() < 1e9; // false for NaN
    (fits(point.x) && fits(point.y)).then(|| (floor(point.x), floor(point.y)))
}

/// The integer below, of a number that has one: without a call where the processor has no instruction for it.
#[expect(clippy::cast_possible_truncation, reason = "checked by the caller")]
fn floor(x: f64) -> i32 {
    let toward_zero = x as i32;
    toward_zero - i32::from(f64::from(toward_zero) > x)
}

/// The cell's place within its patch.
#[expect(clippy::cast_sign_loss, reason = "a remainder is not negative")]
fn within((x, y): (i32, i32)) -> usize {
    (y.rem_euclid(EDGE) * EDGE + x.rem_euclid(EDGE)) as usize
}

/// An index that lies in the patch.
#[expect(clippy::cast_sign_loss, reason = "counted from the corner")]
fn index(at: i32) -> usize {
    at as usize & (AREA - 1)
}

/// The cell at an index of the patch whose first cell is `corner`.
#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "cells of a patch are few")]
pub(super) fn cell_within(corner: (i32, i32), index: usize) -> (i32, i32) {
    (corner.0 + index as i32 % EDGE, corner.1 + index as i32 / EDGE)
}

/// The indices of the cells from `first` to the column `end` of the same patch.
#[expect(clippy::cast_sign_loss, reason = "the first is no farther than the end")]
fn run(first: (i32, i32), end: i32) -> std::ops::Range<usize> {
    let start = within(first);
    start..start + (end - first.0 + 1) as usize
}

impl Patches {
    pub(super) fn new(none: Nearest, metres: Vec<f32>) -> Self {
        let (index, corners, patches) = (Vec::new(), Vec::new(), Vec::new());
        Self { metres, none, low: (0, 0), columns: 0, rows: 0, index, corners, patches }
    }

    /// A distance to the nearest wall in metres.
    pub(super) fn metres(&self, nearest: Nearest) -> f64 {
        f64::from(self.metres[square(nearest)])
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
        let (column, row) = ((x - self.low.0) as u32, (y - self.low.1) as u32); // huge where negative
        let inside = column < self.columns as u32 && row < self.rows as u32;
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
            self.patches.push(Box::new(Cells { nearest: [self.none; AREA], hits: [0; AREA], misses: [0; AREA] }));
        }
        Some(self.index[slot] as usize)
    }

    /// Visits the cells from `from` to `to` (in cells) but for the last one, that of `to`: the patch, the index in it, the patch's
    /// first cell, and how often the cell is to be counted, once or not at all.
    pub(super) fn walk(
        &mut self,
        from: Vector2<f64>,
        to: Vector2<f64>,
        mut visit: impl FnMut(&mut Cells, usize, (i32, i32), u16),
    ) {
        let Some(mut line) = Line::between(from, to) else { return };
        let (along, across) = if line.is_steep() { (EDGE, 1) } else { (1, EDGE) };
        while !line.ends_here() {
            let (column, row, then) = line.here();
            let Some(number) = self.number_or_new(line.cell(column, row)) else { return };
            let cells = &mut *self.patches[number];
            let low = (column & !(EDGE - 1), row & !(EDGE - 1));
            let corner = line.cell(low.0, low.1);
            if (row ^ then) & !(EDGE - 1) != 0 {
                visit(cells, within(line.cell(column, row)), corner, 1);
                let Some((cells, at)) = self.at_mut(line.cell(column, then)) else { return };
                visit(cells, at, line.cell(low.0, then & !(EDGE - 1)), 1);
                line.advance();
                continue;
            }
            while !line.ends_here() {
                let (column, row, then) = line.here();
                let [first, second] = [row, then].map(|row| (column - low.0, row - low.1));
                if (first.0 | first.1 | second.1) & !(EDGE - 1) != 0 {
                    break; // some of it lies in another patch
                }
                let [first, second] = [first, second].map(|(column, row)| index(column * along + row * across));
                visit(cells, first, corner, 1);
                visit(cells, second, corner, u16::from(first != second));
                line.advance();
            }
        }
        let (column, row, _) = line.here();
        if row != line.last_row()
            && let Some((cells, at)) = self.at_mut(line.cell(column, row))
        {
            visit(cells, at, line.cell(column & !(EDGE - 1), row & !(EDGE - 1)), 1);
        }
    }

    /// Visits the patches that share cells with the square from `low` to `high`; they are made if need be.
    pub(super) fn visit_square(&mut self, low: (i32, i32), high: (i32, i32), mut visit: impl FnMut(Walls<'_>)) {
        for y in low.1.div_euclid(EDGE)..=high.1.div_euclid(EDGE) {
            for x in low.0.div_euclid(EDGE)..=high.0.div_euclid(EDGE) {
                let low = (x * EDGE, y * EDGE);
                if let Some(number) = self.number_or_new(low) {
                    let (cells, high) = (&mut self.patches[number].nearest, (low.0 + EDGE - 1, low.1 + EDGE - 1));
                    visit(Walls { cells, low, high });
                }
            }
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
                    let nearest = &self.patches[number].nearest[run((column, row), end)];
                    let found = (column..).zip(nearest).filter(|(_, nearest)| is_wall(**nearest));
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
        let Some((x, y)) = cell_of(at) else { return (self.metres(self.none), Vector2::zeros()) };
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
            let Some((cells, at)) = self.at((x, y)) else { return [self.metres(self.none); 4] };
            return [at, at + 1, at + edge, at + edge + 1].map(|at| self.metres(cells.nearest[at]));
        }
        let nearest = |cell| self.at(cell).map_or(self.none, |(cells, at)| cells.nearest[at]);
        [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|cell| self.metres(nearest(cell)))
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

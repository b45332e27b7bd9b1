use std::fmt::Debug;

use crate::draw::Direction;
use crate::plane::{Plane, SHIFT, TILE, Tile, TileKey, place, within};

/// Tiles on a side up to which a window grows.
const NEAR: i64 = 64;
/// Marks a tile of a [`Window`] that has not been looked up.
const UNKNOWN_SLOT: u32 = u32::MAX;

/// A rectangle of tiles of a plane, so that tiles near each other are looked up once.
#[derive(Debug, Clone, Default)]
pub(crate) struct Window {
    low: TileKey,
    columns: usize,
    slots: Vec<u32>,
}

impl Window {
    /// Starts over with the tiles that hold the cells from `low` to `high`, both `(row, column)`.
    pub(crate) fn open(&mut self, low: (i32, i32), high: (i32, i32)) {
        self.low = (low.0 >> SHIFT, low.1 >> SHIFT);
        self.columns = extent(self.low.1, high.1 >> SHIFT);
        self.slots.clear();
        self.slots.resize(extent(self.low.0, high.0 >> SHIFT) * self.columns, UNKNOWN_SLOT);
    }

    /// As [`Window::open`], but keeps what was looked up where the new tiles lie near the old ones.
    ///
    /// Only for a window of one plane, whose tiles were not released meanwhile.
    pub(crate) fn open_near(&mut self, low: (i32, i32), high: (i32, i32)) {
        let (from, to) = ((low.0 >> SHIFT, low.1 >> SHIFT), (high.0 >> SHIFT, high.1 >> SHIFT));
        let rows = self.slots.len().checked_div(self.columns).unwrap_or(0);
        let end = (self.low.0.saturating_add(whole(rows)), self.low.1.saturating_add(whole(self.columns)));
        if from.0 >= self.low.0 && from.1 >= self.low.1 && to.0 < end.0 && to.1 < end.1 {
            return;
        }
        let from = (from.0.min(self.low.0), from.1.min(self.low.1));
        let to = (to.0.max(end.0 - 1), to.1.max(end.1 - 1));
        let near = self.columns > 0
            && i64::from(to.0) - i64::from(from.0) < NEAR
            && i64::from(to.1) - i64::from(from.1) < NEAR;
        if near {
            self.open((from.0 << SHIFT, from.1 << SHIFT), (to.0 << SHIFT, to.1 << SHIFT));
        } else {
            self.open(low, high);
        }
    }

    /// The column of tiles, from the window's left, that holds a column of cells.
    pub(crate) fn tile_column(&self, column: i32) -> usize {
        extent(self.low.1, column >> SHIFT) - 1
    }

    /// The slot of the tile that holds `row`, in a column of tiles counted from the window's left.
    #[inline]
    pub(crate) fn slot<T: Copy + Default + Debug>(
        &mut self,
        plane: &mut Plane<T>,
        row: i32,
        tile_column: usize,
    ) -> u32 {
        let at = (extent(self.low.0, row >> SHIFT) - 1) * self.columns + tile_column;
        if self.slots[at] == UNKNOWN_SLOT {
            self.look_up(plane, row, tile_column, at);
        }
        self.slots[at]
    }

    /// The cells of the tile that holds `row`, in a column of tiles counted from the window's left.
    #[inline]
    pub(crate) fn tile<'p, T: Copy + Default + Debug>(
        &mut self,
        plane: &'p mut Plane<T>,
        row: i32,
        tile_column: usize,
    ) -> &'p mut Tile<T> {
        let slot = self.slot(plane, row, tile_column);
        plane.tile_mut(slot)
    }

    #[cold]
    fn look_up<T: Copy + Default + Debug>(&mut self, plane: &mut Plane<T>, row: i32, tile_column: usize, at: usize) {
        let column = i32::try_from(tile_column).expect("a window is a few hundred tiles wide");
        self.slots[at] = plane.slot((row >> SHIFT, self.low.1 + column));
    }

    /// The first column of a column of tiles, and where in the plane (slot, then place) the line of `row` in it starts.
    #[inline]
    pub(crate) fn line(&mut self, plane: &mut Plane, row: i32, tile_column: usize) -> (i32, u32) {
        let left = (self.low.1 + whole(tile_column)) << SHIFT;
        (left, self.slot(plane, row, tile_column) << (2 * SHIFT) | (row & ((1 << SHIFT) - 1)).unsigned_abs() << SHIFT)
    }

    /// The tile of a cell and the cell's place in it.
    pub(crate) fn cell<T: Copy + Default + Debug>(
        &mut self,
        plane: &mut Plane<T>,
        row: i32,
        column: i32,
    ) -> (u32, usize) {
        (self.slot(plane, row, self.tile_column(column)), place(row, column))
    }

    /// Adds `units` to the cells `[first, last)` of a row of a plane that holds differences along rows; not empty.
    #[inline]
    pub(crate) fn add_span(&mut self, plane: &mut Plane, row: i32, (first, last): (i32, i32), units: u32) {
        let (left, right) = (self.tile_column(first), self.tile_column(last - 1));
        let (start, end) = (place(row, first), within(last));
        let tile = self.tile(plane, row, left);
        tile[start] = tile[start].wrapping_add(units);
        if left < right {
            self.go_on(plane, row, (left + 1, right), units);
        }
        if end > 0 {
            let tile = self.tile(plane, row, right);
            let end = place(row, 0) + end;
            tile[end] = tile[end].wrapping_sub(units);
        }
    }

    /// Adds a value of its own to each cell of a row of a plane that holds differences along rows, from `(row, column)` on.
    pub(crate) fn add_values(
        &mut self,
        plane: &mut Plane,
        (row, column): (i32, i32),
        mut values: &[u32],
        out: Direction,
    ) {
        let mut column = column;
        while !values.is_empty() {
            let start = within(column);
            let (now, later) = values.split_at(values.len().min(TILE - start));
            let (slot, place) = self.cell(plane, row, column);
            let line = &mut plane.tile_mut(slot)[place..place + TILE - start];
            let mut before = 0u32;
            for (difference, &value) in line.iter_mut().zip(now) {
                *difference = difference.wrapping_add(out.signed(value.wrapping_sub(before)));
                before = value;
            }
            if let Some(difference) = line.get_mut(now.len()) {
                *difference = difference.wrapping_sub(out.signed(before));
            }
            column += whole(now.len());
            values = later;
        }
    }

    /// Goes on with a span from the left edges of more tiles.
    #[cold]
    fn go_on(&mut self, plane: &mut Plane, row: i32, (left, right): (usize, usize), units: u32) {
        for tile_column in left..=right {
            let tile = self.tile(plane, row, tile_column);
            tile[place(row, 0)] = tile[place(row, 0)].wrapping_add(units);
        }
    }
}

fn whole(count: usize) -> i32 {
    i32::try_from(count).expect("a window is a few hundred tiles wide")
}

/// The number of steps from `low` to `high`, both counted.
#[expect(clippy::cast_sign_loss, reason = "high is not below low")]
fn extent(low: i32, high: i32) -> usize {
    debug_assert!(high >= low);
    (high - low + 1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::{TILE_CELLS, first_cell, undo_differences};

    #[test]
    fn spans_across_tiles_add_up_and_cancel() {
        let (mut plane, mut window) = (Plane::default(), Window::default());
        for (first, last) in [(-70, 130), (-1, 0), (63, 64), (5, 5), (0, 63)] {
            window.open((-3, first), (-3, last));
            window.add_span(&mut plane, -3, (first, last + 1), 7);
            let mut known = Vec::new();
            for (slot, key) in plane.keys().to_vec().into_iter().enumerate() {
                let mut sums = [0; TILE_CELLS];
                undo_differences(plane.tile_mut(u32::try_from(slot).unwrap()), &mut sums);
                for at in (0..TILE_CELLS).filter(|&at| sums[at] != 0) {
                    assert_eq!((sums[at], i64::try_from(at / TILE).unwrap()), (7, 61));
                    known.push(first_cell(key.1) + i64::try_from(at % TILE).unwrap());
                }
            }
            known.sort_unstable();
            assert_eq!(known, (i64::from(first)..=i64::from(last)).collect::<Vec<_>>());
            window.add_span(&mut plane, -3, (first, last + 1), 7u32.wrapping_neg());
            plane.release_blank();
            assert_eq!(plane.len(), 0);
        }
    }
}

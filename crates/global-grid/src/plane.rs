use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::draw::Direction;

/// The edge of a tile in cells.
pub(crate) const TILE: usize = 64;
/// `log2` of the edge of a tile.
pub(crate) const SHIFT: u32 = TILE.trailing_zeros();
/// Cells of a tile.
pub(crate) const TILE_CELLS: usize = TILE * TILE;
/// Tiles on a side up to which a window grows.
const NEAR: i64 = 12;
/// Marks a tile of a [`Window`] that has not been looked up.
const UNKNOWN_SLOT: u32 = u32::MAX;

/// The sums of a tile, row by row.
pub(crate) type TileSums = [u32; TILE_CELLS];
/// The place of a tile: row and column of its first cell divided by [`TILE`].
pub(crate) type TileKey = (i32, i32);

/// An unbounded plane of integers, of which only the squares that were touched exist.
///
/// Cells are numbered from the map's origin, rows along `+y`, columns along `+x`, both also negative.
/// Sums wrap, so that adding and taking out cancel exactly whatever comes between.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plane {
    slots: HashMap<TileKey, u32, BuildHasherDefault<TileHasher>>,
    keys: Vec<TileKey>,
    tiles: Vec<Box<TileSums>>,
}

impl Plane {
    /// The number of tiles.
    pub(crate) fn len(&self) -> usize {
        self.tiles.len()
    }

    /// Keys of all tiles, in order of slot.
    pub(crate) fn keys(&self) -> &[TileKey] {
        &self.keys
    }

    /// The cells of the tile at `key`, if there is one.
    pub(crate) fn get(&self, key: TileKey) -> Option<&TileSums> {
        self.slots.get(&key).map(|&slot| &*self.tiles[slot as usize])
    }

    /// The slot of the tile at `key`, made now if there is none.
    pub(crate) fn slot(&mut self, key: TileKey) -> u32 {
        if let Some(&slot) = self.slots.get(&key) {
            return slot;
        }
        let blank = vec![0; TILE_CELLS].into_boxed_slice(); // zeroed by the allocator, not copied from the stack
        self.take_in(key, blank.try_into().expect("as many cells as a tile has"))
    }

    /// The cells of the tile in a slot that [`Plane::slot`] gave.
    #[inline]
    pub(crate) fn tile_mut(&mut self, slot: u32) -> &mut TileSums {
        &mut self.tiles[slot as usize]
    }

    /// Adds another plane, cell by cell; its tiles that have no counterpart are taken over as they are.
    pub(crate) fn add(&mut self, other: Plane) {
        for (key, more) in other.keys.into_iter().zip(other.tiles) {
            if let Some(&slot) = self.slots.get(&key) {
                self.tile_mut(slot).iter_mut().zip(more.iter()).for_each(|(sum, more)| *sum = sum.wrapping_add(*more));
            } else {
                self.take_in(key, more);
            }
        }
    }

    fn take_in(&mut self, key: TileKey, tile: Box<TileSums>) -> u32 {
        let slot = u32::try_from(self.tiles.len()).expect("2³² tiles of 16 KiB fit into no memory");
        self.tiles.push(tile);
        self.keys.push(key);
        self.slots.insert(key, slot);
        slot
    }

    /// Forgets the tiles that hold nothing but zeros.
    pub(crate) fn release_blank(&mut self) {
        let tiles = std::mem::take(&mut self.tiles);
        let keys = std::mem::take(&mut self.keys);
        self.slots.clear();
        for (key, tile) in keys.into_iter().zip(tiles).filter(|(_, tile)| tile.iter().any(|&sum| sum != 0)) {
            self.take_in(key, tile);
        }
    }
}

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

    /// How many tiles stand side by side.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    /// The column of tiles, from the window's left, that holds a column of cells.
    pub(crate) fn tile_column(&self, column: i32) -> usize {
        extent(self.low.1, column >> SHIFT) - 1
    }

    /// The slot of the tile that holds `row`, in a column of tiles counted from the window's left.
    #[inline]
    pub(crate) fn slot(&mut self, plane: &mut Plane, row: i32, tile_column: usize) -> u32 {
        let at = (extent(self.low.0, row >> SHIFT) - 1) * self.columns + tile_column;
        if self.slots[at] == UNKNOWN_SLOT {
            self.look_up(plane, row, tile_column, at);
        }
        self.slots[at]
    }

    /// The cells of the tile that holds `row`, in a column of tiles counted from the window's left.
    #[inline]
    pub(crate) fn tile<'p>(&mut self, plane: &'p mut Plane, row: i32, tile_column: usize) -> &'p mut TileSums {
        let slot = self.slot(plane, row, tile_column);
        plane.tile_mut(slot)
    }

    #[cold]
    fn look_up(&mut self, plane: &mut Plane, row: i32, tile_column: usize, at: usize) {
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
    pub(crate) fn cell(&mut self, plane: &mut Plane, row: i32, column: i32) -> (u32, usize) {
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

    /// As [`Window::add_span`] for spans of rows one above the other, from `row` on: what of them lies in one column of
    /// tiles. An empty span ends where it starts, or before.
    pub(crate) fn add_spans(
        &mut self,
        plane: &mut Plane,
        mut row: i32,
        tile_column: usize,
        mut spans: &[(i32, i32)],
        units: u32,
    ) {
        let (left, edge) = ((self.low.1 + whole(tile_column)) << SHIFT, 1 << SHIFT);
        while !spans.is_empty() {
            let (now, later) = spans.split_at(spans.len().min(TILE - within(row)));
            let (lines, _) = self.tile(plane, row, tile_column)[place(row, 0)..].as_chunks_mut::<TILE>();
            for (line, &(first, last)) in lines.iter_mut().zip(now) {
                let (first, last) = ((first - left).max(0), (last - left).min(edge));
                if first < last {
                    let (start, end) = (within(first), within(last));
                    line[start] = line[start].wrapping_add(units);
                    if last < edge {
                        line[end] = line[end].wrapping_sub(units);
                    }
                }
            }
            row += whole(now.len());
            spans = later;
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

/// The place of a row (or column) within its tile.
#[expect(clippy::cast_sign_loss, reason = "the mask leaves 0..63")]
pub(crate) fn within(cell: i32) -> usize {
    (cell & ((1 << SHIFT) - 1)) as usize
}

/// How many rows (or columns) from this one on lie in its tile.
pub(crate) fn left_in_tile(cell: i32) -> i32 {
    (1 << SHIFT) - (cell & ((1 << SHIFT) - 1))
}

/// The place of a cell within its tile.
pub(crate) fn place(row: i32, column: i32) -> usize {
    within(row) << SHIFT | within(column)
}

/// The first row (or column) of a tile row (or column).
pub(crate) fn first_cell(tile: i32) -> i64 {
    i64::from(tile) << SHIFT
}

/// The sums of a tile that holds differences along rows.
pub(crate) fn undo_differences(tile: &[u32], sums: &mut [u32]) {
    for (line, sums) in tile.chunks_exact(TILE).zip(sums.chunks_exact_mut(TILE)) {
        let mut sum = 0u32;
        for (difference, out) in line.iter().zip(sums) {
            sum = sum.wrapping_add(*difference);
            *out = sum;
        }
    }
}

/// Multiplies by an odd constant: as quick and as spread out as a table of a few thousand tiles needs.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TileHasher(u64);

impl Hasher for TileHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    #[expect(clippy::cast_sign_loss, reason = "only the bits count")]
    fn write_i32(&mut self, value: i32) {
        self.write_u64(u64::from(value as u32));
    }

    fn write_u64(&mut self, value: u64) {
        self.0 = (self.0.rotate_left(26) ^ value).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

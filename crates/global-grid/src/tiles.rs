use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::Tally;

/// The edge of a tile in cells.
pub(crate) const TILE: usize = 64;
/// `log2` of the edge of a tile.
const SHIFT: u32 = TILE.trailing_zeros();
/// Cells of a tile.
pub(crate) const TILE_CELLS: usize = TILE * TILE;

/// The place of a tile: `(row, column)` of its first cell divided by [`TILE`].
pub(crate) type TileKey = (i32, i32);

/// One square of cells: a plane of empty sums, then a plane of occupied sums, so that a span of one kind is contiguous.
#[derive(Debug, Clone)]
pub(crate) struct Tile {
    key: TileKey,
    sums: Box<[u32]>,
}

impl Tile {
    fn new(key: TileKey) -> Self {
        Self { key, sums: vec![0; 2 * TILE_CELLS].into_boxed_slice() }
    }

    /// Where the tile lies.
    pub(crate) fn key(&self) -> TileKey {
        self.key
    }

    /// The empty sums and the occupied sums, row by row.
    pub(crate) fn planes(&self) -> (&[u32], &[u32]) {
        self.sums.split_at(TILE_CELLS)
    }

    /// The empty sums and the occupied sums, row by row.
    pub(crate) fn planes_mut(&mut self) -> (&mut [u32], &mut [u32]) {
        self.sums.split_at_mut(TILE_CELLS)
    }

    /// What is known of the cell at `(row, column)` within the tile.
    pub(crate) fn tally(&self, row: usize, column: usize) -> Tally {
        let at = row * TILE + column;
        Tally { empty: self.sums[at], occupied: self.sums[TILE_CELLS + at] }
    }

    fn is_blank(&self) -> bool {
        self.sums.iter().all(|&sum| sum == 0)
    }
}

/// An unbounded plane of cells, of which only the squares that were touched exist.
///
/// Cells are numbered from the map's origin, rows along `+y`, columns along `+x`, both also negative.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tiles {
    slots: HashMap<TileKey, u32, BuildHasherDefault<TileHasher>>,
    tiles: Vec<Tile>,
}

impl Tiles {
    /// The tiles in order of row, then column.
    pub(crate) fn sorted(&self) -> Vec<&Tile> {
        let mut tiles: Vec<&Tile> = self.tiles.iter().collect();
        tiles.sort_unstable_by_key(|tile| tile.key);
        tiles
    }

    /// The number of tiles.
    pub(crate) fn len(&self) -> usize {
        self.tiles.len()
    }

    /// The slot of the tile at `key`, made now if there is none.
    pub(crate) fn slot(&mut self, key: TileKey) -> u32 {
        if let Some(&slot) = self.slots.get(&key) {
            return slot;
        }
        let slot = u32::try_from(self.tiles.len()).expect("2³² tiles of 32 KiB fit into no memory");
        self.tiles.push(Tile::new(key));
        self.slots.insert(key, slot);
        slot
    }

    /// The tile in a slot that [`Tiles::slot`] gave.
    pub(crate) fn tile_mut(&mut self, slot: u32) -> &mut Tile {
        &mut self.tiles[slot as usize]
    }

    /// Forgets the tiles in which nothing is known any more.
    pub(crate) fn release_blank(&mut self) {
        self.tiles.retain(|tile| !tile.is_blank());
        self.slots.clear();
        for (slot, tile) in self.tiles.iter().enumerate() {
            self.slots.insert(tile.key, u32::try_from(slot).expect("fewer tiles than before"));
        }
    }

    /// The lowest and the highest `(row, column)` of the cells of which anything is known.
    pub(crate) fn known_box(&self) -> Option<((i64, i64), (i64, i64))> {
        let mut known: Option<((i64, i64), (i64, i64))> = None;
        for tile in &self.tiles {
            let Some((low, high)) = tile_box(tile) else { continue };
            known = Some(match known {
                None => (low, high),
                Some((a, b)) => ((a.0.min(low.0), a.1.min(low.1)), (b.0.max(high.0), b.1.max(high.1))),
            });
        }
        known
    }
}

/// The box of the known cells of one tile, in cells of the whole plane.
fn tile_box(tile: &Tile) -> Option<((i64, i64), (i64, i64))> {
    let (empty, occupied) = tile.planes();
    let mut found: Option<((usize, usize), (usize, usize))> = None;
    for at in (0..TILE_CELLS).filter(|&at| empty[at] | occupied[at] != 0) {
        let (row, column) = (at / TILE, at % TILE);
        let (low, high) = found.unwrap_or(((row, column), (row, column)));
        found = Some(((low.0.min(row), low.1.min(column)), (high.0.max(row), high.1.max(column))));
    }
    let (low, high) = found?;
    let corner = (first_cell(tile.key.0), first_cell(tile.key.1));
    let shift = |cell: (usize, usize)| (corner.0 + within(cell.0), corner.1 + within(cell.1));
    Some((shift(low), shift(high)))
}

/// The first row (or column) of a tile row (or column).
pub(crate) fn first_cell(tile: i32) -> i64 {
    i64::from(tile) << SHIFT
}

/// The tile row (or column) that holds a row (or column).
pub(crate) fn tile_of(cell: i32) -> i32 {
    cell >> SHIFT
}

/// The place of a row (or column) within its tile.
#[expect(clippy::cast_sign_loss, reason = "the mask leaves 0..63")]
pub(crate) fn within_tile(cell: i32) -> usize {
    (cell & ((1 << SHIFT) - 1)) as usize
}

#[expect(clippy::cast_possible_wrap, reason = "below 64")]
fn within(cell: usize) -> i64 {
    cell as i64
}

/// Multiplies by an odd constant, as quick and as spread out as a table of a few hundred tiles needs.
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

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// The edge of a tile in cells.
pub(crate) const TILE: usize = 64;
/// `log2` of the edge of a tile.
pub(crate) const SHIFT: u32 = TILE.trailing_zeros();
/// Cells of a tile.
pub(crate) const TILE_CELLS: usize = TILE * TILE;

/// The cells of a tile, row by row.
pub(crate) type Tile<T> = [T; TILE_CELLS];
/// The place of a tile: row and column of its first cell divided by [`TILE`].
pub(crate) type TileKey = (i32, i32);

/// An unbounded plane of integers, of which only the squares that were touched exist.
///
/// Cells are numbered from the map's origin, rows along `+y`, columns along `+x`, both also negative.
/// Sums wrap, so that adding and taking out cancel exactly whatever comes between.
#[derive(Debug, Clone)]
pub(crate) struct Plane<T = u32> {
    slots: HashMap<TileKey, u32, BuildHasherDefault<TileHasher>>,
    keys: Vec<TileKey>,
    tiles: Vec<Box<Tile<T>>>,
}

impl<T> Default for Plane<T> {
    fn default() -> Self {
        Self { slots: HashMap::default(), keys: Vec::new(), tiles: Vec::new() }
    }
}

impl<T: Copy + Default + std::fmt::Debug> Plane<T> {
    /// The number of tiles.
    pub(crate) fn len(&self) -> usize {
        self.tiles.len()
    }

    /// Keys of all tiles, in order of slot.
    pub(crate) fn keys(&self) -> &[TileKey] {
        &self.keys
    }

    /// The cells of the tile at `key`, if there is one.
    pub(crate) fn get(&self, key: TileKey) -> Option<&Tile<T>> {
        self.slots.get(&key).map(|&slot| &*self.tiles[slot as usize])
    }

    /// The slot of the tile at `key`, if there is one.
    pub(crate) fn find(&self, key: TileKey) -> Option<u32> {
        self.slots.get(&key).copied()
    }

    /// The slot of the tile at `key`, made now if there is none.
    pub(crate) fn slot(&mut self, key: TileKey) -> u32 {
        if let Some(&slot) = self.slots.get(&key) {
            return slot;
        }
        let blank = vec![T::default(); TILE_CELLS].into_boxed_slice(); // zeroed by the allocator, not copied from the stack
        self.take_in(key, blank.try_into().expect("as many cells as a tile has"))
    }

    /// The cells of the tile in a slot that [`Plane::slot`] gave.
    #[inline]
    pub(crate) fn tile_mut(&mut self, slot: u32) -> &mut Tile<T> {
        &mut self.tiles[slot as usize]
    }

    /// Takes over another plane: its tiles that have no counterpart as they are, the cells of the others as `join` says.
    pub(crate) fn merge(&mut self, other: Self, mut join: impl FnMut(TileKey, &mut Tile<T>, &Tile<T>)) {
        for (key, more) in other.keys.into_iter().zip(other.tiles) {
            match self.slots.get(&key) {
                Some(&slot) => join(key, self.tile_mut(slot), &more),
                None => {
                    self.take_in(key, more);
                }
            }
        }
    }

    /// Forgets the tiles that `keep` does not want.
    pub(crate) fn retain(&mut self, mut keep: impl FnMut(TileKey, &Tile<T>) -> bool) {
        let tiles = std::mem::take(&mut self.tiles);
        let keys = std::mem::take(&mut self.keys);
        self.slots.clear();
        for (key, tile) in keys.into_iter().zip(tiles) {
            if keep(key, &tile) {
                self.take_in(key, tile);
            }
        }
    }

    fn take_in(&mut self, key: TileKey, tile: Box<Tile<T>>) -> u32 {
        let slot = u32::try_from(self.tiles.len()).expect("2³² tiles of 4 KiB fit into no memory");
        self.tiles.push(tile);
        self.keys.push(key);
        self.slots.insert(key, slot);
        slot
    }
}

impl Plane {
    /// Adds another plane, cell by cell.
    pub(crate) fn add(&mut self, other: Self) {
        self.merge(other, |_, tile, more| {
            tile.iter_mut().zip(more).for_each(|(sum, more)| *sum = sum.wrapping_add(*more));
        });
    }

    /// Forgets the tiles that hold nothing but zeros.
    pub(crate) fn release_blank(&mut self) {
        self.retain(|_, tile| tile.iter().any(|&sum| sum != 0));
    }
}

/// The place of a row (or column) within its tile.
#[expect(clippy::cast_sign_loss, reason = "the mask leaves 0..63")]
pub(crate) fn within(cell: i32) -> usize {
    (cell & ((1 << SHIFT) - 1)) as usize
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

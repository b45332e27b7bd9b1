use crate::Tally;
use crate::plane::{Plane, TILE, TILE_CELLS, TileKey, first_cell, undo_differences};

/// All that the readings say, cell by cell, as integers.
///
/// Empty evidence comes in spans: its plane holds differences along the rows of each tile, so that a span costs two
/// writes whatever its length. Occupied evidence comes in points and is held as it is.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sums {
    pub(crate) empty: Plane,
    pub(crate) occupied: Plane,
}

/// A box of cells: the lowest and the highest `(row, column)`.
pub(crate) type CellBox = ((i64, i64), (i64, i64));

impl Sums {
    /// Adds what other readings say.
    #[cfg_attr(not(feature = "parallel"), expect(dead_code, reason = "only threads draw apart and add up"))]
    pub(crate) fn add(&mut self, other: Sums) {
        self.empty.add(other.empty);
        self.occupied.add(other.occupied);
    }

    /// Forgets the tiles in which nothing is known any more.
    pub(crate) fn release_blank(&mut self) {
        self.empty.release_blank();
        self.occupied.release_blank();
    }

    /// The largest sums of any cell, empty and occupied.
    pub(crate) fn largest(&self) -> (u32, u32) {
        let mut largest = (0, 0);
        let mut cells = TileCells::default();
        for key in self.keys(None) {
            cells.load(self, None, key);
            largest.0 = cells.empty.iter().copied().fold(largest.0, u32::max);
            largest.1 = cells.occupied.iter().copied().fold(largest.1, u32::max);
        }
        largest
    }

    /// The places of all tiles, in order of row, then column, with those of `echoes`.
    pub(crate) fn keys(&self, echoes: Option<&Plane>) -> Vec<TileKey> {
        let planes = [Some(&self.empty), Some(&self.occupied), echoes];
        let mut keys: Vec<TileKey> = planes.into_iter().flatten().flat_map(|plane| plane.keys()).copied().collect();
        keys.sort_unstable();
        keys.dedup();
        keys
    }

    /// The box around all cells of which anything is known.
    pub(crate) fn known_box(&self, echoes: Option<&Plane>) -> Option<CellBox> {
        let mut known: Option<CellBox> = None;
        let mut cells = TileCells::default();
        for key in self.keys(echoes) {
            cells.load(self, echoes, key);
            let Some((low, high)) = cells.known_box(key) else { continue };
            let (a, b) = known.unwrap_or((low, high));
            known = Some(((a.0.min(low.0), a.1.min(low.1)), (b.0.max(high.0), b.1.max(high.1))));
        }
        known
    }
}

/// The sums of one tile, spelled out.
#[derive(Debug, Clone)]
pub(crate) struct TileCells {
    empty: Vec<u32>,
    occupied: Vec<u32>,
}

impl Default for TileCells {
    fn default() -> Self {
        Self { empty: vec![0; TILE_CELLS], occupied: vec![0; TILE_CELLS] }
    }
}

impl TileCells {
    /// Reads the tile at `key`, with what `echoes` adds to the occupied evidence.
    pub(crate) fn load(&mut self, sums: &Sums, echoes: Option<&Plane>, key: TileKey) {
        match sums.empty.get(key) {
            Some(tile) => undo_differences(tile, &mut self.empty),
            None => self.empty.fill(0),
        }
        match sums.occupied.get(key) {
            Some(tile) => self.occupied.copy_from_slice(tile),
            None => self.occupied.fill(0),
        }
        if let Some(tile) = echoes.and_then(|echoes| echoes.get(key)) {
            for (sum, more) in self.occupied.iter_mut().zip(tile) {
                *sum = sum.saturating_add(*more);
            }
        }
    }

    /// What is known of a cell.
    pub(crate) fn tally(&self, at: usize) -> Tally {
        Tally { empty: self.empty[at], occupied: self.occupied[at] }
    }

    /// The box of the known cells, in cells of the whole plane.
    fn known_box(&self, key: TileKey) -> Option<CellBox> {
        let mut found: Option<CellBox> = None;
        let corner = (first_cell(key.0), first_cell(key.1));
        for at in (0..TILE_CELLS).filter(|&at| !self.tally(at).is_unknown()) {
            let cell = (corner.0 + small(at / TILE), corner.1 + small(at % TILE));
            let (low, high) = found.unwrap_or((cell, cell));
            found = Some(((low.0.min(cell.0), low.1.min(cell.1)), (high.0.max(cell.0), high.1.max(cell.1))));
        }
        found
    }
}

#[expect(clippy::cast_possible_wrap, reason = "below 64")]
fn small(index: usize) -> i64 {
    index as i64
}

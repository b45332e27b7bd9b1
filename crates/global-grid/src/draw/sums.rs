use std::ops::RangeInclusive;

use crate::Tally;
use crate::draw::counts::Counts;
use crate::plane::{Plane, SHIFT, TILE, TILE_CELLS, Tile, TileKey, first_cell, undo_differences};

/// All that the readings say, cell by cell, as integers.
///
/// Empty evidence comes in spans, so it is held as differences along rows: a span costs two writes whatever its length,
/// and ground between two outlines costs neither time nor memory until it is read. Occupied evidence comes in points.
/// What says the same of every cell is counted; evidence of other amounts is summed up.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sums {
    /// Sums of empty evidence, as differences that start anew in each tile.
    pub(crate) empty: Plane,
    pub(crate) occupied: Plane,
    /// How many sonar cones sweep a cell, as differences along the whole row.
    pub(crate) swept: Counts,
    /// How many laser scans see through a cell, as differences along the whole row.
    pub(crate) cleared: Counts,
    /// How many laser scans hit a cell.
    pub(crate) hit: Counts,
    pub(crate) worth: Worth,
}

/// What is counted is worth so much evidence, in units.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Worth {
    pub(crate) swept: u32,
    pub(crate) cleared: u32,
    pub(crate) hit: u32,
}

/// A box of cells: the lowest and the highest `(row, column)`.
pub(crate) type CellBox = ((i64, i64), (i64, i64));

impl Sums {
    /// No evidence of anything.
    pub(crate) fn new(worth: Worth) -> Self {
        Self { worth, ..Self::default() }
    }

    /// Adds what other readings say.
    #[cfg_attr(not(feature = "parallel"), expect(dead_code, reason = "only threads draw apart and add up"))]
    pub(crate) fn add(&mut self, other: Sums) {
        self.empty.add(other.empty);
        self.occupied.add(other.occupied);
        self.swept.add_all(other.swept);
        self.cleared.add_all(other.cleared);
        self.hit.add_all(other.hit);
    }

    /// Forgets the tiles in which nothing is known any more.
    pub(crate) fn release_blank(&mut self) {
        self.empty.release_blank();
        self.occupied.release_blank();
        self.swept.release_blank();
        self.cleared.release_blank();
        self.hit.release_blank();
    }

    /// Bytes that the cells take.
    pub(crate) fn bytes(&self) -> usize {
        let sums = (self.empty.len() + self.occupied.len()) * size_of::<Tile<u32>>();
        sums + self.swept.bytes() + self.cleared.bytes() + self.hit.bytes()
    }

    /// The largest sums of any cell, empty and occupied.
    pub(crate) fn largest(&self) -> (u32, u32) {
        let mut largest = (0, 0);
        self.each_tile(None, ALL_ROWS, |_, cells| {
            largest.0 = cells.empty.iter().copied().fold(largest.0, u32::max);
            largest.1 = cells.occupied.iter().copied().fold(largest.1, u32::max);
        });
        largest
    }

    /// The box around all cells of which anything is known.
    pub(crate) fn known_box(&self, echoes: Option<&Plane>) -> Option<CellBox> {
        let mut known: Option<CellBox> = None;
        self.each_tile(echoes, ALL_ROWS, |key, cells| {
            let Some((low, high)) = cells.known_box(key) else { return };
            let (a, b) = known.unwrap_or((low, high));
            known = Some(((a.0.min(low.0), a.1.min(low.1)), (b.0.max(high.0), b.1.max(high.1))));
        });
        known
    }

    /// Shows every tile in some rows of tiles, in order of row, then column, with what `echoes` adds to the occupied evidence.
    pub(crate) fn each_tile(
        &self,
        echoes: Option<&Plane>,
        rows: RangeInclusive<i32>,
        mut look: impl FnMut(TileKey, &TileCells),
    ) {
        let mut cells = TileCells::default();
        let mut counts = Box::new([0; TILE_CELLS]);
        let more = self.occupied.keys().iter().chain(self.hit.keys()).chain(echoes.into_iter().flat_map(Plane::keys));
        self.each_empty(more, rows, |key, empty| {
            cells.empty.copy_from_slice(empty);
            match self.occupied.get(key) {
                Some(tile) => cells.occupied.copy_from_slice(tile),
                None => cells.occupied.fill(0),
            }
            if self.hit.load(key, &mut counts) {
                add_counts(&mut cells.occupied, counts.as_slice(), self.worth.hit);
            }
            if let Some(tile) = echoes.and_then(|echoes| echoes.get(key)) {
                cells.occupied.iter_mut().zip(tile).for_each(|(sum, more)| *sum = sum.saturating_add(*more));
            }
            look(key, &cells);
        });
    }

    /// Shows the empty evidence of every tile that holds some, and of those at `more`, in order of row, then column.
    pub(crate) fn each_empty<'k>(
        &self,
        more: impl IntoIterator<Item = &'k TileKey>,
        rows: RangeInclusive<i32>,
        mut look: impl FnMut(TileKey, &Tile<u32>),
    ) {
        let own = self.empty.keys().iter().chain(self.swept.keys()).chain(self.cleared.keys());
        let mut keys: Vec<TileKey> = own.copied().chain(more.into_iter().copied()).collect();
        keys.retain(|key| rows.contains(&key.0));
        keys.sort_unstable();
        keys.dedup();
        let mut sums = Box::new([0; TILE_CELLS]);
        let mut counts = [(&self.swept, self.worth.swept), (&self.cleared, self.worth.cleared)].map(Running::new);
        for (at, &key) in keys.iter().enumerate() {
            self.load_empty(key, &mut counts, &mut sums);
            look(key, &sums);
            let next = keys.get(at + 1).filter(|next| next.0 == key.0).map_or(key.1, |next| next.1);
            let mut column = key.1 + 1;
            while column < next && counts.iter().any(Running::goes_on) {
                self.load_empty((key.0, column), &mut counts, &mut sums);
                look((key.0, column), &sums);
                column += 1;
            }
        }
    }

    /// Reads a tile's empty evidence; the tile to its left must have been the last one read, unless nothing goes on from it.
    fn load_empty(&self, key: TileKey, counts: &mut [Running<'_>], sums: &mut Tile<u32>) {
        match self.empty.get(key) {
            Some(tile) => undo_differences(tile, sums),
            None => sums.fill(0),
        }
        counts.iter_mut().for_each(|counts| counts.add(key, sums));
    }
}

/// All rows of tiles.
pub(crate) const ALL_ROWS: RangeInclusive<i32> = i32::MIN..=i32::MAX;

/// The row of tiles that holds a row of cells.
pub(crate) fn tile_row(row: i64) -> i32 {
    i32::try_from(row >> SHIFT).unwrap_or(if row < 0 { i32::MIN } else { i32::MAX })
}

/// Counts held as differences along rows, read tile by tile from left to right.
struct Running<'c> {
    counts: &'c Counts,
    worth: u32,
    /// Row by row, the count in the last cell of the tile read last.
    left: [i32; TILE],
    differences: Box<Tile<i32>>,
}

impl<'c> Running<'c> {
    fn new((counts, worth): (&'c Counts, u32)) -> Self {
        Self { counts, worth, left: [0; TILE], differences: Box::new([0; TILE_CELLS]) }
    }

    /// Whether any row goes on beyond the tile read last.
    fn goes_on(&self) -> bool {
        self.left.iter().any(|&count| count != 0)
    }

    /// Adds what the counts of the tile at `key` are worth.
    fn add(&mut self, key: TileKey, sums: &mut Tile<u32>) {
        if !self.counts.load(key, &mut self.differences) && !self.goes_on() {
            return;
        }
        let lines = self.differences.as_chunks_mut::<TILE>().0.iter_mut().zip(sums.as_chunks_mut::<TILE>().0);
        for (left, (line, sums)) in self.left.iter_mut().zip(lines) {
            let mut count = *left;
            for difference in line.iter_mut() {
                count += *difference;
                *difference = count;
            }
            *left = count;
            add_counts(sums, line, self.worth);
        }
    }
}

/// Adds what counts are worth. Rounding of an outline could leave a count below zero, which says nothing.
fn add_counts(sums: &mut [u32], counts: &[i32], worth: u32) {
    for (sum, &count) in sums.iter_mut().zip(counts) {
        *sum = sum.wrapping_add(count.max(0).cast_unsigned().wrapping_mul(worth));
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

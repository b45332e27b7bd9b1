use crate::draw::window::Window;
use crate::plane::{Plane, SHIFT, TILE, Tile, TileKey, place, within};

/// What a cell of one byte cannot hold goes over in amounts of this.
const CARRY: i32 = 1 << 8;

/// A plane of whole numbers most of which are small: a byte a cell, so that a tile is a page of memory, and what does not
/// fit into a byte beside it.
///
/// A number is the sum of both. It is exact whatever is added and taken away, in whatever order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Counts {
    small: Plane<i8>,
    carried: Plane<i32>,
}

impl Counts {
    /// Keys of all tiles.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &TileKey> {
        self.small.keys().iter().chain(self.carried.keys())
    }

    /// Bytes that the numbers take.
    pub(crate) fn bytes(&self) -> usize {
        self.small.len() * size_of::<Tile<i8>>() + self.carried.len() * size_of::<Tile<i32>>()
    }

    /// Adds `by` to one cell of each row from `row` upward: those at `columns`.
    #[inline]
    pub(crate) fn add_upward(&mut self, window: &mut Window, row: i32, columns: impl IntoIterator<Item = i32>, by: i8) {
        let mut cells = (row..).zip(columns);
        let mut next = cells.next();
        while let Some((row, column)) = next {
            let tile = window.tile(&mut self.small, row, window.tile_column(column));
            let here = |cell: (i32, i32)| ((cell.0 ^ row) | (cell.1 ^ column)) >> SHIFT == 0;
            while let Some(cell) = next.filter(|&cell| here(cell)) {
                let (sum, over) = tile[place(cell.0, cell.1)].overflowing_add(by);
                tile[place(cell.0, cell.1)] = sum;
                if over {
                    carry(&mut self.carried, cell, by);
                }
                next = cells.next();
            }
        }
    }

    /// As [`Counts::add_upward`] for the cells of `count` rows that follow a straight line.
    pub(crate) fn add_line(&mut self, window: &mut Window, (mut row, count): (i32, usize), mut line: Line, by: i8) {
        let mut left = count;
        while left > 0 {
            let now = left.min(TILE - within(row));
            let (first, last) = (line.column(0), line.column(now - 1));
            if (first ^ last) >> SHIFT == 0 {
                let tile = window.tile(&mut self.small, row, window.tile_column(first));
                let (rows, _) = tile[place(row, 0)..].as_chunks_mut::<TILE>();
                for (cells, row) in rows.iter_mut().take(now).zip(row..) {
                    let column = line.column(0);
                    let over;
                    (cells[within(column)], over) = cells[within(column)].overflowing_add(by);
                    if over {
                        carry(&mut self.carried, (row, column), by);
                    }
                    line.step();
                }
            } else {
                let columns = (0..now).map(|_| {
                    let column = line.column(0);
                    line.step();
                    column
                });
                self.add_upward(window, row, columns, by);
            }
            row += i32::try_from(now).expect("at most the rows of a tile");
            left -= now;
        }
    }

    /// Adds `by` to one cell.
    #[inline]
    pub(crate) fn add(&mut self, window: &mut Window, (row, column): (i32, i32), by: i8) {
        self.add_upward(window, row, [column], by);
    }

    /// Reads the tile at `key`; `false` if there is none.
    pub(crate) fn load(&self, key: TileKey, numbers: &mut Tile<i32>) -> bool {
        let (small, carried) = (self.small.get(key), self.carried.get(key));
        match small {
            Some(small) => numbers.iter_mut().zip(small).for_each(|(number, small)| *number = i32::from(*small)),
            None => numbers.fill(0),
        }
        if let Some(carried) = carried {
            numbers.iter_mut().zip(carried).for_each(|(number, carried)| *number += carried);
        }
        small.is_some() || carried.is_some()
    }

    /// Adds the numbers of another plane, cell by cell.
    pub(crate) fn add_all(&mut self, other: Self) {
        let carried = &mut self.carried;
        self.small.merge(other.small, |key, tile, more| {
            for (at, (sum, more)) in tile.iter_mut().zip(more).enumerate() {
                let over;
                (*sum, over) = sum.overflowing_add(*more);
                if over {
                    let slot = carried.slot(key);
                    carried.tile_mut(slot)[at] += CARRY * i32::from(more.signum());
                }
            }
        });
        self.carried.merge(other.carried, |_, tile, more| {
            tile.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        });
    }

    /// Forgets the tiles that hold nothing but zeros.
    pub(crate) fn release_blank(&mut self) {
        let carried = &self.carried;
        let mut blank = Vec::new();
        self.small.retain(|key, tile| {
            let zero = match carried.get(key) {
                Some(carried) => tile.iter().zip(carried).all(|(&small, &carried)| i32::from(small) + carried == 0),
                None => tile.iter().all(|&small| small == 0),
            };
            if zero {
                blank.push(key);
            }
            !zero
        });
        blank.sort_unstable();
        self.carried.retain(|key, tile| blank.binary_search(&key).is_err() && tile.iter().any(|&carried| carried != 0));
    }
}

/// A straight line over the columns of rows, from row to row upward: numbers with 32 binary places.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line {
    column: i64,
    slope: i64,
}

impl Line {
    /// The line that starts `offset` columns (a fraction) to the right of `column` and moves by `slope` from row to row.
    pub(crate) fn new(column: i32, offset: f32, slope: f32) -> Self {
        Self { column: (i64::from(column) << 32) + fixed(offset), slope: fixed(slope) }
    }

    /// The column some rows on.
    #[inline]
    fn column(&self, rows: usize) -> i32 {
        let rows = i64::try_from(rows).expect("few rows");
        (self.column.wrapping_add(rows.wrapping_mul(self.slope)) >> 32) as i32
    }

    #[inline]
    fn step(&mut self) {
        self.column = self.column.wrapping_add(self.slope);
    }
}

/// A number with 32 binary places.
#[expect(clippy::cast_possible_truncation, reason = "saturates; a line of more than one row is no flatter than a beam")]
fn fixed(x: f32) -> i64 {
    (x * 4_294_967_296.0) as i64
}

/// Notes what a cell that took in one more than it can hold lacks now.
#[cold]
fn carry(carried: &mut Plane<i32>, (row, column): (i32, i32), by: i8) {
    let slot = carried.slot((row >> SHIFT, column >> SHIFT));
    carried.tile_mut(slot)[place(row, column)] += CARRY * i32::from(by.signum());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::TILE_CELLS;

    fn number(counts: &Counts, row: i32, column: i32) -> i32 {
        let mut tile = [0; TILE_CELLS];
        counts.load((row >> SHIFT, column >> SHIFT), &mut tile);
        tile[place(row, column)]
    }

    #[test]
    fn numbers_of_any_size_are_exact_and_leave_nothing_behind() {
        let (mut counts, mut window) = (Counts::default(), Window::default());
        window.open((-70, -70), (70, 70));
        for _ in 0..1000 {
            counts.add_upward(&mut window, -66, [-65, -64, -1, 0, 5], 1);
            counts.add(&mut window, (3, 64), -1);
        }
        for (row, column, expected) in
            [(-66, -65, 1000), (-65, -64, 1000), (-64, -1, 1000), (-62, 5, 1000), (3, 64, -1000)]
        {
            assert_eq!(number(&counts, row, column), expected);
        }
        let mut twice = counts.clone();
        twice.add_all(counts.clone());
        assert_eq!((number(&twice, 3, 64), number(&twice, -62, 5)), (-2000, 2000));
        for _ in 0..2000 {
            twice.add_upward(&mut window, -66, [-65, -64, -1, 0, 5], -1);
            twice.add(&mut window, (3, 64), 1);
        }
        twice.release_blank();
        assert_eq!((twice.keys().count(), twice.bytes()), (0, 0));
    }
}

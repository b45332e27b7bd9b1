use local_grid::{FrameError, Grid, GridFrame};
use nalgebra::Point2;

use crate::Tally;
use crate::draw::sums::{Sums, tile_row};
use crate::plane::{Plane, TILE, first_cell};

/// The frame of the cells from `low` to `high`, both `(row, column)` in the unbounded plane.
#[expect(clippy::cast_precision_loss, reason = "cell numbers stay below 2^32")]
pub(crate) fn frame_of(low: (i64, i64), high: (i64, i64), resolution: f64) -> Result<GridFrame, FrameError> {
    let origin = Point2::new(low.1 as f64 * resolution, low.0 as f64 * resolution);
    GridFrame::new(origin, resolution, index(high.0 - low.0) + 1, index(high.1 - low.1) + 1)
}

/// The cells of `frame`, whose first cell is `low`, each as `read` sees its sums; what lies beside the frame is left out.
pub(crate) fn dense<T: Copy + Default>(
    sums: &Sums,
    echoes: Option<&Plane>,
    (frame, low): (GridFrame, (i64, i64)),
    mut read: impl FnMut(Tally) -> T,
) -> Grid<T> {
    let mut grid = Grid::new(frame);
    grid.cells_mut().fill(read(Tally::default()));
    let rows = tile_row(low.0)..=tile_row(low.0 + count(frame.rows()));
    sums.each_tile(echoes, rows, |key, cells| {
        let corner = (first_cell(key.0) - low.0, first_cell(key.1) - low.1);
        let (rows, columns) = (overlap(corner.0, frame.rows()), overlap(corner.1, frame.columns()));
        for (row, column) in rows.flat_map(|row| columns.clone().map(move |column| (row, column))) {
            let tally = cells.tally(row * TILE + column);
            if !tally.is_unknown() {
                let (row, column) = (index(corner.0 + count(row)), index(corner.1 + count(column)));
                grid.cells_mut()[row * frame.columns() + column] = read(tally);
            }
        }
    });
    grid
}

/// The rows (or columns) of a tile that lie in a frame of `count`, in which the tile's first lies at `first`.
fn overlap(first: i64, count: usize) -> std::ops::Range<usize> {
    let end = i64::try_from(count).unwrap_or(i64::MAX) - first;
    index((-first).max(0)).min(TILE)..index(end.max(0)).min(TILE)
}

#[expect(clippy::cast_sign_loss, clippy::cast_possible_truncation, reason = "cells within the frame, or clamped")]
fn index(cell: i64) -> usize {
    cell as usize
}

#[expect(clippy::cast_possible_wrap, reason = "a grid has fewer cells than 2⁶³")]
fn count(cells: usize) -> i64 {
    cells as i64
}

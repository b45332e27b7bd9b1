use local_grid::{FrameError, Grid, GridFrame};
use nalgebra::Point2;

use crate::Tally;
use crate::plane::{Plane, TILE, TILE_CELLS, first_cell};
use crate::sums::{Sums, TileCells};

/// The frame of the cells from `low` to `high`, both `(row, column)` in the unbounded plane.
#[expect(clippy::cast_precision_loss, reason = "cell numbers stay below 2^32")]
pub(crate) fn frame_of(low: (i64, i64), high: (i64, i64), resolution: f64) -> Result<GridFrame, FrameError> {
    let origin = Point2::new(low.1 as f64 * resolution, low.0 as f64 * resolution);
    GridFrame::new(origin, resolution, index(high.0 - low.0) + 1, index(high.1 - low.1) + 1)
}

/// The cells of `frame`, whose first cell is `low`, each as `read` sees its sums.
pub(crate) fn dense<T: Copy + Default>(
    sums: &Sums,
    echoes: Option<&Plane>,
    (frame, low): (GridFrame, (i64, i64)),
    mut read: impl FnMut(Tally) -> T,
) -> Grid<T> {
    let mut grid = Grid::new(frame);
    grid.cells_mut().fill(read(Tally::default()));
    let mut cells = TileCells::default();
    for key in sums.keys(echoes) {
        cells.load(sums, echoes, key);
        let corner = (first_cell(key.0) - low.0, first_cell(key.1) - low.1);
        for at in 0..TILE_CELLS {
            let tally = cells.tally(at);
            if !tally.is_unknown() {
                let (row, column) = (index(corner.0 + cell(at / TILE)), index(corner.1 + cell(at % TILE)));
                grid.cells_mut()[row * frame.columns() + column] = read(tally);
            }
        }
    }
    grid
}

#[expect(clippy::cast_sign_loss, clippy::cast_possible_truncation, reason = "known cells lie in the box around them")]
fn index(cell: i64) -> usize {
    cell as usize
}

#[expect(clippy::cast_possible_wrap, reason = "below 64")]
fn cell(index: usize) -> i64 {
    index as i64
}

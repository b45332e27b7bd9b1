use local_grid::{FuzzyGrid, Grid, GridFrame};

use super::{PlanOptions, Reason, unexplored_unsafety};
use crate::derived::derive;

/// The largest value within `radius` metres of each cell, centre to centre; beyond the grid lies `outside`.
pub(super) fn dilate(grid: &Grid<f32>, radius: f64, outside: f32) -> Grid<f32> {
    let frame = *grid.frame();
    let (rows, columns) = (frame.rows(), frame.columns());
    let mut grown = Grid::new(frame);
    let mut line = vec![0.0; columns];
    let mut widest: Vec<f32> = Vec::new();
    for (dy, half) in disc(&frame, radius) {
        for row in 0..rows {
            let from = row.checked_add_signed(dy).filter(|&from| from < rows);
            match from {
                Some(from) => widest_of(
                    &grid.cells()[from * columns..(from + 1) * columns],
                    half,
                    outside,
                    &mut line,
                    &mut widest,
                ),
                None => line.fill(outside),
            }
            for (cell, &value) in grown.cells_mut()[row * columns..(row + 1) * columns].iter_mut().zip(&line) {
                *cell = f32::max(*cell, value);
            }
        }
    }
    grown
}

/// The rows of a disc: how many cells up or down, and how many cells to either side.
pub(super) fn disc(frame: &GridFrame, radius: f64) -> Vec<(isize, usize)> {
    let cells = radius / frame.resolution() + 1e-9;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating; grids are smaller")]
    let whole = |length: f64| (length.floor() as usize).min(frame.rows().max(frame.columns()));
    let reach = isize::try_from(whole(cells)).unwrap_or(isize::MAX);
    #[expect(clippy::cast_precision_loss, reason = "a few cells")]
    let half = |dy: isize| whole((cells * cells - (dy * dy) as f64).max(0.0).sqrt());
    (-reach..=reach).map(|dy| (dy, half(dy))).collect()
}

/// The largest value within `half` cells to either side, by doubling windows: `log₂` of the width passes over the row.
fn widest_of(row: &[f32], half: usize, outside: f32, out: &mut [f32], padded: &mut Vec<f32>) {
    padded.clear();
    padded.resize(half, outside);
    padded.extend_from_slice(row);
    padded.resize(row.len() + 2 * half, outside);
    let (width, mut have) = (2 * half + 1, 1);
    while have < width {
        let step = have.min(width - have);
        for at in 0..padded.len() - step {
            padded[at] = padded[at].max(padded[at + step]);
        }
        have += step;
    }
    out.copy_from_slice(&padded[..row.len()]);
}

/// What the worst cell under the robot at `(row, column)` is.
pub(super) fn worst(grid: &FuzzyGrid, (row, column): (usize, usize), options: &PlanOptions) -> Reason {
    let frame = grid.frame();
    let mut worst = (f32::NEG_INFINITY, Reason::Unexplored);
    for (dy, half) in disc(frame, options.radius + options.margin) {
        let half = isize::try_from(half).unwrap_or(isize::MAX);
        for dx in -half..=half {
            let cell = row.checked_add_signed(dy).zip(column.checked_add_signed(dx));
            let found = match cell.and_then(|(row, column)| grid.get(row, column)) {
                None => (unexplored_unsafety(options), Reason::Unexplored),
                Some(&measured) => {
                    let cell = options.exposure.of_cell(measured);
                    let sets = derive(cell, options.norm);
                    let reason = if sets.indeterminate > 0.5 {
                        Reason::Unexplored
                    } else if options.exposure.contradiction(measured) > 0.5 {
                        Reason::Contradictory
                    } else if cell.occupied > cell.empty {
                        Reason::Occupied
                    } else {
                        Reason::Unexplored
                    };
                    (sets.unsafety, reason)
                }
            };
            if found.0 > worst.0 || (found.0 >= worst.0 && found.1 == Reason::Occupied) {
                worst = found;
            }
        }
    }
    worst.1
}

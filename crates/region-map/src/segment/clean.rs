//! What a person would not call a wall: specks, legs of chairs and tables, plants, free-standing furniture.

use crate::{
    components::{Components, components},
    plane::Plane,
};

/// Fills every obstacle that stands free and is at most `extent` cells across, or `block` cells if it is at least half as
/// thick as `extent`: no wall is.
///
/// A leg of a table makes a room look narrow where it is not. Walls of scans, on the other hand, are often dotted. So
/// obstacles with gaps of up to `gap` cells between them count as one; then a single small obstacle beside a wall is filled,
/// too, unless it parts the space around it once such gaps are closed.
pub(crate) fn fill_furniture(free: &mut Plane<bool>, extent: f64, block: f64, gap: usize) {
    let mut walls = free.clone();
    walls.cells.iter_mut().for_each(|cell| *cell = !*cell);
    let singles = components(&walls, 1);
    let boxes = windows(&singles);
    // What is no thicker than the gaps in a wall may be a piece of one.
    #[expect(clippy::cast_precision_loss, reason = "a few cells")]
    let thinnest = (0.25 * extent).max(2.0 * gap as f64);
    let is_thick = |(window, cells): (&Window, usize)| {
        (window.stands_free(extent) && window.shorter() >= thinnest) || window.is_block(block, 0.5 * extent, cells)
    };
    let thick: Vec<bool> = boxes.iter().zip(singles.sizes()).map(is_thick).collect();
    fill(free, &singles, &thick);
    walls.cells.iter_mut().zip(&free.cells).for_each(|(wall, free)| *wall = !*free);
    let groups = components(&walls, gap + 1);
    let small: Vec<bool> = windows(&groups).iter().map(|window| window.stands_free(extent)).collect();
    fill(free, &groups, &small);
    let beside: Vec<bool> =
        boxes.iter().map(|window| window.stands_free(extent) && !window.parts_space(free, gap)).collect();
    fill(free, &singles, &beside);
}

/// The windows around all components.
fn windows(parts: &Components) -> Vec<Window> {
    let mut windows = vec![Window::EMPTY; parts.count];
    for (run, &part) in parts.runs.iter().zip(&parts.of_run) {
        windows[part as usize].add(run.row, run.columns.start);
        windows[part as usize].add(run.row, run.columns.end - 1);
    }
    windows
}

/// Makes the chosen components free.
fn fill(free: &mut Plane<bool>, parts: &Components, chosen: &[bool]) {
    for (run, &part) in parts.runs.iter().zip(&parts.of_run) {
        if chosen[part as usize] {
            let start = run.row * free.columns;
            free.cells[start + run.columns.start..start + run.columns.end].fill(true);
        }
    }
}

/// What a component measures from north to south, from west to east and along both diagonals: first and last cells.
#[derive(Debug, Clone, Copy)]
struct Window {
    rows: [usize; 2],
    columns: [usize; 2],
    rising: [usize; 2],
    falling: [usize; 2],
}

impl Window {
    const EMPTY: Self = {
        let nothing = [usize::MAX, 0];
        Self { rows: nothing, columns: nothing, rising: nothing, falling: nothing }
    };

    fn add(&mut self, row: usize, column: usize) {
        // The falling diagonal is shifted so that it never is negative: no grid has 2³³ columns.
        let places = [row, column, row + column, row + (1 << 33) - column];
        for (range, place) in
            [&mut self.rows, &mut self.columns, &mut self.rising, &mut self.falling].into_iter().zip(places)
        {
            *range = [range[0].min(place), range[1].max(place)];
        }
    }

    /// Whether it is no larger than `extent` and not the rim of the map, which begins in its corner.
    fn stands_free(&self, extent: f64) -> bool {
        self.rows[0] > 0 && self.across() <= extent
    }

    /// Whether it stands free, is no longer than `longest`, and with its `cells` as thick on average as `thick`.
    #[expect(clippy::cast_precision_loss, reason = "far below 2^52 cells")]
    fn is_block(&self, longest: f64, thick: f64, cells: usize) -> bool {
        self.stands_free(longest) && cells as f64 >= thick * self.across()
    }

    /// The greatest of its four widths: at most 8 % less than the greatest of all.
    fn across(&self) -> f64 {
        let straight = length(self.rows).max(length(self.columns));
        straight.max(length(self.rising).max(length(self.falling)) / std::f64::consts::SQRT_2)
    }

    fn shorter(&self) -> f64 {
        length(self.rows).min(length(self.columns))
    }

    /// Whether the free cells in the box and a few cells around it fall apart once gaps of `gap` cells are closed.
    fn parts_space(&self, free: &Plane<bool>, gap: usize) -> bool {
        let grow = gap.div_ceil(2);
        let beside = (2 * grow + 1).max(3);
        let first = |cell: usize| cell.saturating_sub(beside).max(1);
        let (top, left) = (first(self.rows[0]), first(self.columns[0]));
        let last = |cell: usize, cells: usize| (cell + beside + 1).min(cells - 1);
        let (bottom, right) = (last(self.rows[1], free.rows), last(self.columns[1], free.columns));
        let mut open = Plane::filled(bottom - top, right - left, false);
        for row in top..bottom {
            for column in left..right {
                let columns = column.saturating_sub(grow)..(column + grow + 1).min(free.columns);
                let clear = |r: usize| free.row(r)[columns.clone()].iter().all(|&cell| cell);
                let mut rows = row.saturating_sub(grow)..(row + grow + 1).min(free.rows);
                open.cells[(row - top) * (right - left) + column - left] = rows.all(clear);
            }
        }
        components(&open, 0).count > 1
    }
}

/// The number of cells from the first to the last.
#[expect(clippy::cast_precision_loss, reason = "sides of windows are far below 2^52")]
fn length([first, last]: [usize; 2]) -> f64 {
    (last + 1).saturating_sub(first) as f64
}

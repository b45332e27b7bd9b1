//! What a person would not call a wall: specks, legs of chairs and tables, plants, free-standing furniture.

use crate::{
    components::{Components, components},
    plane::Plane,
};

/// Fills every obstacle that stands free and is at most `extent` cells across (the diagonal of its box).
///
/// A leg of a table makes a room look narrow where it is not. Walls of scans, on the other hand, are often dotted. So
/// obstacles with gaps of up to `gap` cells between them count as one; then a single small obstacle beside a wall is filled,
/// too, unless it parts the space around it once such gaps are closed.
pub(crate) fn fill_furniture(free: &mut Plane<bool>, extent: f64, gap: usize) {
    let mut walls = free.clone();
    walls.cells.iter_mut().for_each(|cell| *cell = !*cell);
    let singles = components(&walls, 1);
    let boxes = windows(&singles);
    let thick: Vec<bool> =
        boxes.iter().map(|window| window.stands_free(extent) && window.shorter() >= 0.25 * extent).collect();
    fill(free, &singles, &thick);
    walls.cells.iter_mut().zip(&free.cells).for_each(|(wall, free)| *wall = !*free);
    let groups = components(&walls, gap + 1);
    let small: Vec<bool> = windows(&groups).iter().map(|window| window.stands_free(extent)).collect();
    fill(free, &groups, &small);
    let beside: Vec<bool> =
        boxes.iter().map(|window| window.stands_free(extent) && !window.parts_space(free, gap)).collect();
    fill(free, &singles, &beside);
}

/// The boxes of all components.
fn windows(parts: &Components) -> Vec<Window> {
    let mut boxes = vec![Window { top: usize::MAX, bottom: 0, left: usize::MAX, right: 0 }; parts.count];
    for (run, &part) in parts.runs.iter().zip(&parts.of_run) {
        let window = &mut boxes[part as usize];
        window.top = run.row.min(window.top);
        window.bottom = (run.row + 1).max(window.bottom);
        window.left = run.columns.start.min(window.left);
        window.right = run.columns.end.max(window.right);
    }
    boxes
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

/// A box of cells, ends exclusive.
#[derive(Debug, Clone, Copy)]
struct Window {
    top: usize,
    bottom: usize,
    left: usize,
    right: usize,
}

impl Window {
    /// Whether it is no larger than `extent` and not the rim of the map, which begins in its corner.
    fn stands_free(&self, extent: f64) -> bool {
        self.top > 0 && self.diagonal() <= extent
    }

    #[expect(clippy::cast_precision_loss, reason = "sides of boxes are far below 2^52")]
    fn diagonal(&self) -> f64 {
        ((self.bottom - self.top) as f64).hypot((self.right - self.left) as f64)
    }

    #[expect(clippy::cast_precision_loss, reason = "sides of boxes are far below 2^52")]
    fn shorter(&self) -> f64 {
        (self.bottom - self.top).min(self.right - self.left) as f64
    }

    /// Whether the free cells in the box and up to three cells around it fall apart once gaps of `gap` cells are closed.
    fn parts_space(&self, free: &Plane<bool>, gap: usize) -> bool {
        let (top, left) = (self.top.saturating_sub(3).max(1), self.left.saturating_sub(3).max(1));
        let (bottom, right) = ((self.bottom + 3).min(free.rows - 1), (self.right + 3).min(free.columns - 1));
        let grow = gap / 2;
        let mut open = Plane::filled(bottom - top, right - left, false);
        for row in top..bottom {
            for column in left..right {
                let clear = |r: usize| free.row(r)[column - grow..=column + grow].iter().all(|&cell| cell);
                open.cells[(row - top) * (right - left) + column - left] = (row - grow..=row + grow).all(clear);
            }
        }
        components(&open, 0).count > 1
    }
}

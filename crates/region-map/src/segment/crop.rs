//! The part of a grid that holds free space, cut out and put back.

use local_grid::Grid;

use crate::plane::Plane;

/// Free cells inside the smallest box that holds them, with a rim of walls.
pub(crate) struct Cropped {
    pub(crate) plane: Plane<bool>,
    /// Row and column of the grid at which the box begins.
    pub(crate) origin: (usize, usize),
}

pub(crate) fn crop(free: &Grid<f32>, threshold: f32) -> Option<Cropped> {
    let (rows, columns) = (free.frame().rows(), free.frame().columns());
    let (mut top, mut bottom, mut left, mut right) = (rows, 0, columns, 0);
    for row in 0..rows {
        let cells = &free.cells()[row * columns..(row + 1) * columns];
        if let Some(first) = cells.iter().position(|&cell| cell > threshold) {
            let last = cells.iter().rposition(|&cell| cell > threshold).unwrap_or(first);
            (top, bottom) = (top.min(row), row + 1);
            (left, right) = (left.min(first), right.max(last + 1));
        }
    }
    if bottom == 0 {
        return None;
    }
    let mut plane = Plane::filled(bottom - top + 2, right - left + 2, false);
    for row in top..bottom {
        let from = &free.cells()[row * columns + left..row * columns + right];
        let start = (row - top + 1) * plane.columns + 1;
        let to = &mut plane.cells[start..start + from.len()];
        to.iter_mut().zip(from).for_each(|(to, &from)| *to = from > threshold);
    }
    Some(Cropped { plane, origin: (top, left) })
}

/// Puts labels back to where they were cut out.
pub(crate) fn write_back(labels: &Plane<u16>, origin: (usize, usize), out: &mut Grid<u16>) {
    let columns = out.frame().columns();
    for row in 1..labels.rows - 1 {
        let from = &labels.row(row)[1..labels.columns - 1];
        let start = (origin.0 + row - 1) * columns + origin.1;
        out.cells_mut()[start..start + from.len()].copy_from_slice(from);
    }
}

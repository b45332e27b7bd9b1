use global_grid::Occupancy;
use local_grid::{Grid, GridFrame};
use nalgebra::Point2;

/// The distance from every cell's centre to the nearest wall cell's centre, in metres.
#[derive(Debug)]
pub(super) struct DistanceField {
    squared: Grid<f64>,
}

impl DistanceField {
    /// Exact distances by two passes of lower envelopes of parabolas (Felzenszwalb & Huttenlocher 2012).
    pub(super) fn of_walls(map: &Grid<Occupancy>) -> Self {
        let mut squared = padded(map);
        let (rows, columns) = (squared.frame().rows(), squared.frame().columns());
        let mut line = vec![0.0; rows.max(columns)];
        for row in 0..rows {
            let cells = &mut squared.cells_mut()[row * columns..(row + 1) * columns];
            line[..columns].copy_from_slice(cells);
            envelope(&line[..columns], |column, value| cells[column] = value);
        }
        for column in 0..columns {
            for (row, value) in line[..rows].iter_mut().enumerate() {
                *value = squared.cells()[row * columns + column];
            }
            let cells = squared.cells_mut();
            envelope(&line[..rows], |row, value| cells[row * columns + column] = value);
        }
        Self { squared }
    }

    /// The distance from `point` to the nearest wall, to about half a cell; infinite where there is no wall, and farther than [`MARGIN`]
    /// from the map.
    pub(super) fn at(&self, point: Point2<f64>) -> f64 {
        let resolution = self.squared.frame().resolution();
        self.squared.at(point).map_or(f64::INFINITY, |squared| squared.sqrt() * resolution)
    }
}

/// So many metres around a map are covered, too: a wall at its edge may lie a little outside of another map.
pub(super) const MARGIN: f64 = 1.0;

/// 0 at walls, infinite elsewhere, with the margin around the map.
fn padded(map: &Grid<Occupancy>) -> Grid<f64> {
    let frame = map.frame();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most MARGIN over a resolution; saturates"
    )]
    let margin = (MARGIN / frame.resolution()).ceil() as usize;
    #[expect(clippy::cast_precision_loss, reason = "cells of a grid")]
    let origin = frame.origin() - nalgebra::Vector2::repeat(margin as f64 * frame.resolution());
    // A map at the limit of what a grid can hold has no room for a margin.
    let (wide, margin) =
        GridFrame::new(origin, frame.resolution(), frame.rows() + 2 * margin, frame.columns() + 2 * margin)
            .map_or((*frame, 0), |wide| (wide, margin));
    let mut squared = Grid::from_cells(wide, vec![f64::INFINITY; wide.n_cells()]).unwrap_or_else(|_| Grid::new(wide));
    for (index, _) in map.cells().iter().enumerate().filter(|(_, cell)| **cell == Occupancy::Occupied) {
        let (row, column) = (index / frame.columns(), index % frame.columns());
        if let Some(cell) = squared.get_mut(row + margin, column + margin) {
            *cell = 0.0;
        }
    }
    squared
}

/// For every `q` the least of `(q − p)² + values[p]` over all `p`.
fn envelope(values: &[f64], mut give: impl FnMut(usize, f64)) {
    #[expect(clippy::cast_precision_loss, reason = "grid indices")]
    let number = |index: usize| index as f64;
    let mut peaks: Vec<(usize, f64)> = Vec::new(); // a parabola's place, and from where on it is the lowest
    for (q, value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let mut from = f64::NEG_INFINITY;
        while let Some((p, since)) = peaks.last().copied() {
            from = ((value + number(q).powi(2)) - (values[p] + number(p).powi(2))) / (2.0 * (number(q) - number(p)));
            if from > since {
                break;
            }
            peaks.pop();
            from = f64::NEG_INFINITY;
        }
        peaks.push((q, from));
    }
    let mut at = 0;
    for q in 0..values.len() {
        while peaks.get(at + 1).is_some_and(|(_, since)| *since < number(q)) {
            at += 1;
        }
        give(q, peaks.get(at).map_or(f64::INFINITY, |(p, _)| (number(q) - number(*p)).powi(2) + values[*p]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_that_a_search_finds() {
        let (rows, columns) = (13, 17);
        let frame = GridFrame::new(Point2::origin(), 0.5, rows, columns).unwrap();
        let walls = [(2, 3), (9, 14), (9, 2), (12, 16)];
        let mut map: Grid<Occupancy> = Grid::new(frame);
        for (row, column) in walls {
            *map.get_mut(row, column).unwrap() = Occupancy::Occupied;
        }
        let field = DistanceField::of_walls(&map);
        for row in 0..rows {
            for column in 0..columns {
                let apart =
                    |(r, c): &(usize, usize)| (map.frame().center(*r, *c) - map.frame().center(row, column)).norm();
                let nearest = walls.iter().map(apart).fold(f64::MAX, f64::min);
                approx::assert_relative_eq!(field.at(map.frame().center(row, column)), nearest, epsilon = 1e-12);
            }
        }
        let empty: Grid<Occupancy> = Grid::new(*map.frame());
        assert_eq!(DistanceField::of_walls(&empty).at(Point2::new(1.0, 1.0)), f64::INFINITY);
    }
}

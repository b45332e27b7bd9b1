use global_grid::Occupancy;
use local_grid::{FuzzyGrid, Grid};
use serde::Serialize;

/// What a map tells of its own quality, without any truth: doubled or smeared walls are thick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sharpness {
    /// Mean thickness of the walls in metres, see [`wall_thickness`]; `None` without walls.
    pub wall_thickness_m: Option<f64>,
    /// Area of the occupied cells in square metres.
    pub occupied_m2: f64,
    /// Area of the free cells in square metres.
    pub free_m2: f64,
}

/// The sharpness of `map`.
#[must_use]
pub fn sharpness(map: &Grid<Occupancy>) -> Sharpness {
    #[expect(clippy::cast_precision_loss, reason = "cells of a grid")]
    let area = |kind: Occupancy| {
        map.cells().iter().filter(|cell| **cell == kind).count() as f64 * map.frame().resolution().powi(2)
    };
    Sharpness {
        wall_thickness_m: wall_thickness(map),
        occupied_m2: area(Occupancy::Occupied),
        free_m2: area(Occupancy::Free),
    }
}

/// The mean thickness of the walls in metres: of every occupied cell the shortest way through the wall along a row, a column or a diagonal.
///
/// `None` where nothing is occupied. A wall one cell thick has the thickness of a cell.
#[must_use]
pub fn wall_thickness(map: &Grid<Occupancy>) -> Option<f64> {
    let (rows, columns) = (map.frame().rows(), map.frame().columns());
    let (mut sum, mut count) = (0.0, 0.0);
    for row in 0..rows {
        for column in 0..columns {
            if is_wall(map, row, column) {
                sum += thickness_at(map, row, column);
                count += 1.0;
            }
        }
    }
    (count > 0.0).then(|| sum / count * map.frame().resolution())
}

/// The shortest way through the wall at a cell, in cells.
fn thickness_at(map: &Grid<Occupancy>, row: usize, column: usize) -> f64 {
    let ways = [((0, 1), 1.0), ((1, 0), 1.0), ((1, 1), std::f64::consts::SQRT_2), ((1, -1), std::f64::consts::SQRT_2)];
    let through = |((down, right), step): ((isize, isize), f64)| {
        let cells = 1 + run(map, (row, column), (down, right)) + run(map, (row, column), (-down, -right));
        #[expect(clippy::cast_precision_loss, reason = "cells of a grid")]
        let way = step * cells as f64;
        way
    };
    ways.into_iter().map(through).fold(f64::INFINITY, f64::min)
}

/// How many occupied cells follow in one direction; a wall thicker than this is a block.
fn run(map: &Grid<Occupancy>, from: (usize, usize), (down, right): (isize, isize)) -> usize {
    const THICKEST: usize = 50;
    let follow = |k: &usize| {
        let k = k.cast_signed();
        let cell = from.0.checked_add_signed(k * down).zip(from.1.checked_add_signed(k * right));
        cell.is_some_and(|(row, column)| is_wall(map, row, column))
    };
    (1..=THICKEST).take_while(follow).count()
}

fn is_wall(map: &Grid<Occupancy>, row: usize, column: usize) -> bool {
    row < map.frame().rows() && map.get(row, column) == Some(&Occupancy::Occupied)
}

/// The mean entropy of cells in bits, from their probabilities of being occupied: 0 where all is certain, 1 where nothing is.
#[must_use]
pub fn mean_entropy(probabilities: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for p in probabilities {
        let part = |p: f64| if p > 0.0 { -p * p.log2() } else { 0.0 };
        let p = p.clamp(0.0, 1.0);
        sum += part(p) + part(1.0 - p);
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}

/// The mean entropy in bits of the cells of which a map fused by Bayes' rule knows something: doubled walls are seen
/// through from one of their places and not from the other, so that their cells stay undecided.
///
/// `None` where nothing is known.
#[must_use]
pub fn known_entropy(map: &FuzzyGrid) -> Option<f64> {
    let known = map.cells().iter().filter(|cell| cell.empty > 0.0 || cell.occupied > 0.0);
    mean_entropy(known.map(|cell| 0.5 * (1.0 + f64::from(cell.occupied) - f64::from(cell.empty))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use local_grid::GridFrame;
    use nalgebra::Point2;

    fn wall(thick: usize, slanted: bool) -> Grid<Occupancy> {
        let mut map = Grid::new(GridFrame::new(Point2::origin(), 0.05, 60, 60).unwrap());
        for k in 0..40 {
            for depth in 0..thick {
                let row = 10 + depth + if slanted { k } else { 0 };
                if let Some(cell) = map.get_mut(row, k + 5) {
                    *cell = Occupancy::Occupied;
                }
            }
        }
        map
    }

    #[test]
    fn a_doubled_wall_is_thicker() {
        approx::assert_relative_eq!(wall_thickness(&wall(1, false)).unwrap(), 0.05, epsilon = 1e-9);
        approx::assert_relative_eq!(wall_thickness(&wall(3, false)).unwrap(), 0.15, epsilon = 0.01);
        assert!(wall_thickness(&wall(3, true)).unwrap() < 0.16);
        assert_eq!(wall_thickness(&wall(0, false)), None);
    }

    #[test]
    fn entropy_is_nothing_where_all_is_certain() {
        assert_eq!(mean_entropy([0.0, 1.0]), Some(0.0));
        assert_eq!(mean_entropy([0.5, 0.5]), Some(1.0));
        assert_eq!(mean_entropy([]), None);

        let mut map = FuzzyGrid::new(GridFrame::new(Point2::origin(), 0.1, 2, 2).unwrap());
        assert_eq!(known_entropy(&map), None);
        map.cells_mut()[0].occupied = 1.0;
        (map.cells_mut()[1].occupied, map.cells_mut()[1].empty) = (0.5, 0.5);
        assert_eq!(known_entropy(&map), Some(0.5));
    }
}

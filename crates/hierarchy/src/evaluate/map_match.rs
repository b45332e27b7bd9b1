use global_grid::Occupancy;
use local_grid::Grid;
use nalgebra::{Isometry2, Point2};
use serde::Serialize;

use super::distance_field::DistanceField;

/// How well one map matches another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapMatch {
    /// Walls within 0.1, 0.2 and 0.3 m.
    pub walls: Vec<WallMatch>,
    /// Mean distance in metres from a mapped wall cell to the nearest true one; distances above 1 m count as 1 m. `None` without walls.
    pub mapped_to_true_m: Option<f64>,
    /// Mean distance in metres from a true wall cell to the nearest mapped one; distances above 1 m count as 1 m. `None` without walls.
    pub true_to_mapped_m: Option<f64>,
    /// Common area of the free spaces divided by the area of their union; `None` where neither map has any.
    pub free_iou: Option<f64>,
    /// The share of the cells known in the reference that the map does not know.
    pub unknown_share: f64,
    /// Mean score per cell known in the reference, see [`map_score`]: 1 perfect, 0 unknown, below it wrong.
    pub score_per_cell: f64,
}

/// Walls found again within a tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WallMatch {
    /// Metres.
    pub tolerance_m: f64,
    /// The share of the mapped wall cells that have a true one within the tolerance; 1 where no wall is mapped.
    pub precision: f64,
    /// The share of the true wall cells that have a mapped one within the tolerance; 1 where there is no wall.
    pub recall: f64,
}

/// Compares `map` with `reference`, given where the reference has the map's frame.
#[must_use]
pub fn compare_maps(
    map: &Grid<Occupancy>,
    reference: &Grid<Occupancy>,
    reference_from_map: &Isometry2<f64>,
) -> MapMatch {
    let mapped = distances(map, reference, reference_from_map);
    let found = distances(reference, map, &reference_from_map.inverse());
    let walls = [0.1, 0.2, 0.3].map(|tolerance_m| {
        // Cells are compared by their centres: half a cell is nobody's error.
        let reach = tolerance_m + 0.5 * map.frame().resolution().min(reference.frame().resolution());
        WallMatch { tolerance_m, precision: share_within(&mapped, reach), recall: share_within(&found, reach) }
    });
    let known = known_cells(map, reference, reference_from_map);
    MapMatch {
        walls: walls.to_vec(),
        mapped_to_true_m: mean_distance(&mapped),
        true_to_mapped_m: mean_distance(&found),
        free_iou: free_iou(map, reference, reference_from_map),
        unknown_share: part(known.iter().filter(|(cell, _)| *cell == Occupancy::Unknown).count(), known.len()),
        #[expect(clippy::cast_precision_loss, reason = "cells of a grid")]
        score_per_cell: map_score(known.iter().map(|(cell, truth)| (probability(*cell), probability(*truth))))
            / known.len().max(1) as f64,
    }
}

/// The score of Martin & Moravec (1996): `Σ 1 + log₂(p q + (1 − p)(1 − q))` over pairs of occupancy probabilities, each `p` kept in `[0.02, 0.98]`.
///
/// A cell that is right scores 1, an unknown one (½) 0, a wrong one less than 0.
pub fn map_score(cells: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let score = |(p, q): (f64, f64)| {
        let p = p.clamp(0.02, 0.98);
        1.0 + (p * q + (1.0 - p) * (1.0 - q)).log2()
    };
    cells.into_iter().map(score).sum()
}

fn probability(cell: Occupancy) -> f64 {
    match cell {
        Occupancy::Unknown => 0.5,
        Occupancy::Free => 0.0,
        Occupancy::Occupied => 1.0,
    }
}

/// The centres of the cells of `map` that are `kind`.
fn centers(map: &Grid<Occupancy>, kind: Occupancy) -> impl Iterator<Item = Point2<f64>> + '_ {
    let columns = map.frame().columns();
    map.cells()
        .iter()
        .enumerate()
        .filter(move |(_, cell)| **cell == kind)
        .map(move |(index, _)| map.frame().center(index / columns, index % columns))
}

/// From every wall cell of `from` the distance to the nearest of `to`.
fn distances(from: &Grid<Occupancy>, to: &Grid<Occupancy>, to_from_from: &Isometry2<f64>) -> Vec<f64> {
    let field = DistanceField::of_walls(to);
    centers(from, Occupancy::Occupied).map(|center| field.at(to_from_from * center)).collect()
}

fn share_within(distances: &[f64], reach: f64) -> f64 {
    if distances.is_empty() {
        1.0
    } else {
        part(distances.iter().filter(|distance| **distance <= reach).count(), distances.len())
    }
}

fn mean_distance(distances: &[f64]) -> Option<f64> {
    #[expect(clippy::cast_precision_loss, reason = "cells of a grid")]
    let count = distances.len() as f64;
    (!distances.is_empty()).then(|| distances.iter().map(|distance| distance.min(1.0)).sum::<f64>() / count)
}

/// What the map says where the reference knows something: (map, reference).
fn known_cells(
    map: &Grid<Occupancy>,
    reference: &Grid<Occupancy>,
    reference_from_map: &Isometry2<f64>,
) -> Vec<(Occupancy, Occupancy)> {
    let map_from_reference = reference_from_map.inverse();
    let said = |point: Point2<f64>| map.at(map_from_reference * point).copied().unwrap_or_default();
    let kinds = [Occupancy::Free, Occupancy::Occupied];
    kinds.into_iter().flat_map(|kind| centers(reference, kind).map(move |center| (said(center), kind))).collect()
}

fn free_iou(map: &Grid<Occupancy>, reference: &Grid<Occupancy>, reference_from_map: &Isometry2<f64>) -> Option<f64> {
    #[expect(clippy::cast_precision_loss, reason = "cells of a grid")]
    let area = |of: &Grid<Occupancy>, count: usize| count as f64 * of.frame().resolution().powi(2);
    let map_from_reference = reference_from_map.inverse();
    let common = centers(reference, Occupancy::Free)
        .filter(|center| map.at(map_from_reference * center) == Some(&Occupancy::Free))
        .count();
    let common = area(reference, common);
    let union = area(reference, centers(reference, Occupancy::Free).count())
        + area(map, centers(map, Occupancy::Free).count())
        - common;
    (union > 0.0).then(|| common / union)
}

#[expect(clippy::cast_precision_loss, reason = "cells of a grid")]
fn part(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use local_grid::GridFrame;

    /// A room of 6 × 4 m with walls one cell thick, its lower left corner at `at`.
    fn room(at: Point2<f64>) -> Grid<Occupancy> {
        let (rows, columns) = (40, 60);
        let mut map = Grid::new(GridFrame::new(at, 0.1, rows, columns).unwrap());
        for row in 0..rows {
            for column in 0..columns {
                let wall = row == 0 || column == 0 || row == rows - 1 || column == columns - 1;
                *map.get_mut(row, column).unwrap() = if wall { Occupancy::Occupied } else { Occupancy::Free };
            }
        }
        map
    }

    #[test]
    fn a_map_matches_itself_wherever_it_lies() {
        let (map, moved) = (room(Point2::origin()), room(Point2::new(5.0, -3.0)));
        let same = compare_maps(&map, &moved, &Isometry2::translation(5.0, -3.0));
        assert!(same.walls.iter().all(|walls| walls.precision == 1.0 && walls.recall == 1.0));
        assert_eq!(same.free_iou, Some(1.0));
        assert_eq!((same.mapped_to_true_m, same.unknown_share), (Some(0.0), 0.0));
        approx::assert_relative_eq!(same.score_per_cell, 1.0 + 0.98f64.log2(), epsilon = 1e-9);
    }

    #[test]
    fn a_map_that_is_shifted_matches_within_the_shift() {
        let shifted = compare_maps(&room(Point2::origin()), &room(Point2::origin()), &Isometry2::translation(0.2, 0.0));
        assert!(shifted.walls[0].precision < 0.7, "{shifted:?}");
        assert!(shifted.walls[1].precision > 0.97 && shifted.walls[1].recall > 0.97, "{shifted:?}");
        assert!(shifted.free_iou.unwrap() < 0.97);
    }

    #[test]
    fn a_map_of_nothing_is_unknown_and_not_wrong() {
        let nothing: Grid<Occupancy> = Grid::new(*room(Point2::origin()).frame());
        let compared = compare_maps(&nothing, &room(Point2::origin()), &Isometry2::identity());
        assert_eq!((compared.unknown_share, compared.free_iou, compared.walls[2].recall), (1.0, Some(0.0), 0.0));
        approx::assert_relative_eq!(compared.score_per_cell, 0.0, epsilon = 1e-12);
        assert_eq!(compared.mapped_to_true_m, None);
    }

    #[test]
    fn cells_score_as_worked_by_hand() {
        approx::assert_relative_eq!(map_score([(0.9, 1.0)]), 0.848, epsilon = 1e-3);
        approx::assert_relative_eq!(map_score([(0.1, 1.0)]), -2.32, epsilon = 2e-3);
        approx::assert_relative_eq!(map_score([(0.5, 1.0), (0.5, 0.0)]), 0.0);
    }
}

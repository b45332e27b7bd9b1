mod distance;

use local_grid::{Grid, GridFrame};
use nalgebra::Point2;

use crate::Occupancy;
use distance::distances;

/// How well a map agrees with a reference map, cell by cell and wall by wall.
///
/// With `p` the map's probability of a cell being occupied and `q` the reference's (0 free, 1 occupied); cells that the
/// reference does not know are left out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MapScore {
    /// Cells of the reference that are free or occupied.
    pub cells: usize,
    /// Share of them of which the map knows nothing.
    pub unknown: f64,
    /// `Σ 1 + log₂(p q + (1 − p)(1 − q))`, `p` clamped to `[0.02, 0.98]` (Martin & Moravec): at most the number of cells.
    pub map_score: f64,
    /// `(mean(p q) − mean p · mean q) / (σ_p σ_q)`, 0 where a map is constant.
    pub correlation: f64,
    /// `Σ |p − q|`.
    pub overall_error: f64,
    /// `mean (p − q)²`.
    pub brier: f64,
    /// Area under the curve of true against false alarms over all thresholds: a wall ranks above a free cell so often.
    pub auc: f64,
    /// Share of mapped walls within the tolerance of a true one.
    pub wall_precision: f64,
    /// Share of true walls within the tolerance of a mapped one.
    pub wall_recall: f64,
    /// The harmonic mean of both.
    pub wall_f1: f64,
    /// Mean distance from mapped walls to true ones, in metres.
    pub mapped_to_true: f64,
    /// Mean distance from true walls to mapped ones, in metres.
    pub true_to_mapped: f64,
    /// Occupied in both maps over occupied in either.
    pub occupied_iou: f64,
    /// Free in both maps over free in either.
    pub free_iou: f64,
}

/// Scores a map against a reference. A cell counts as wall above one half and as free below; at one half nothing is known.
///
/// `probability` gives the map's probability at a point; `tolerance` is in metres, edge to edge of a cell's width for
/// neighbours.
#[must_use]
pub fn score(probability: impl Fn(Point2<f64>) -> f32, reference: &Grid<Occupancy>, tolerance: f64) -> MapScore {
    let frame = *reference.frame();
    let at = |index: usize| probability(frame.center(index / frame.columns(), index % frame.columns()));
    let map: Vec<f32> = (0..frame.n_cells()).map(at).collect();
    let mut score = MapScore::default();
    cell_by_cell(&mut score, &map, reference.cells());
    score.auc = area_under_curve(&map, reference.cells());
    wall_by_wall(&mut score, &map, reference.cells(), &frame, tolerance);
    score
}

/// The known cells: `p` and `q`.
fn known<'a>(map: &'a [f32], reference: &'a [Occupancy]) -> impl Iterator<Item = (f64, f64)> + 'a {
    map.iter().zip(reference).filter_map(|(&p, truth)| match truth {
        Occupancy::Unknown => None,
        Occupancy::Free => Some((f64::from(p), 0.0)),
        Occupancy::Occupied => Some((f64::from(p), 1.0)),
    })
}

fn cell_by_cell(score: &mut MapScore, map: &[f32], reference: &[Occupancy]) {
    let (mut p_sum, mut q_sum, mut pq, mut pp, mut unknown) = (0.0, 0.0, 0.0, 0.0, 0usize);
    for (p, q) in known(map, reference) {
        score.cells += 1;
        unknown += usize::from(is_unknown(p));
        let clamped = p.clamp(0.02, 0.98);
        score.map_score += 1.0 + (clamped * q + (1.0 - clamped) * (1.0 - q)).log2();
        score.overall_error += (p - q).abs();
        score.brier += (p - q) * (p - q);
        p_sum += p;
        q_sum += q;
        pq += p * q;
        pp += p * p;
    }
    let n = count(score.cells.max(1));
    score.unknown = count(unknown) / n;
    score.brier /= n;
    let (p, q) = (p_sum / n, q_sum / n);
    let spread = ((pp / n - p * p) * (q - q * q)).max(0.0).sqrt();
    score.correlation = if spread > 1e-12 { (pq / n - p * q) / spread } else { 0.0 };
}

/// The rank sum of the walls, equal ranks shared.
fn area_under_curve(map: &[f32], reference: &[Occupancy]) -> f64 {
    let mut cells: Vec<(f64, f64)> = known(map, reference).collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut rank, mut ranks, mut walls) = (0.0, 0.0, 0.0);
    for equal in cells.chunk_by(|a, b| a.0 == b.0) {
        let here: f64 = equal.iter().map(|cell| cell.1).sum();
        ranks += here * (rank + 0.5 * (count(equal.len()) + 1.0));
        rank += count(equal.len());
        walls += here;
    }
    let free = count(cells.len()) - walls;
    if walls == 0.0 || free == 0.0 { 0.0 } else { (ranks - 0.5 * walls * (walls + 1.0)) / (walls * free) }
}

fn wall_by_wall(score: &mut MapScore, map: &[f32], reference: &[Occupancy], frame: &GridFrame, tolerance: f64) {
    let judged = |at: usize| reference[at] != Occupancy::Unknown;
    let mapped: Vec<bool> = map.iter().enumerate().map(|(at, &p)| p > 0.5 && judged(at)).collect();
    let truly: Vec<bool> = reference.iter().map(|&cell| cell == Occupancy::Occupied).collect();
    let reach = tolerance / frame.resolution() + 1e-9;
    (score.wall_precision, score.mapped_to_true) = near(&mapped, &truly, frame, reach);
    (score.wall_recall, score.true_to_mapped) = near(&truly, &mapped, frame, reach);
    let both = score.wall_precision + score.wall_recall;
    score.wall_f1 = if both > 0.0 { 2.0 * score.wall_precision * score.wall_recall / both } else { 0.0 };
    score.occupied_iou = intersection_over_union(mapped.iter().copied().zip(truly.iter().copied()));
    let free = (0..map.len()).filter(|&at| judged(at)).map(|at| (map[at] < 0.5, reference[at] == Occupancy::Free));
    score.free_iou = intersection_over_union(free);
}

/// The share of the cells of `of` that lie within `reach` cells of one of `to`, and their mean distance in metres.
fn near(of: &[bool], to: &[bool], frame: &GridFrame, reach: f64) -> (f64, f64) {
    let distances = distances(to, frame.rows(), frame.columns());
    let cells: Vec<f64> = of.iter().zip(&distances).filter(|(of, _)| **of).map(|(_, distance)| *distance).collect();
    if cells.is_empty() {
        return (0.0, 0.0);
    }
    let within = cells.iter().filter(|&&distance| distance <= reach).count();
    let mean = cells.iter().filter(|distance| distance.is_finite()).sum::<f64>() / count(cells.len());
    (count(within) / count(cells.len()), mean * frame.resolution())
}

fn intersection_over_union(cells: impl Iterator<Item = (bool, bool)>) -> f64 {
    let (mut both, mut either) = (0usize, 0usize);
    for (a, b) in cells {
        both += usize::from(a && b);
        either += usize::from(a || b);
    }
    if either == 0 { 0.0 } else { count(both) / count(either) }
}

fn is_unknown(p: f64) -> bool {
    (p - 0.5).abs() < 1e-9
}

#[expect(clippy::cast_precision_loss, reason = "cells are far fewer than 2^52")]
fn count(n: usize) -> f64 {
    n as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference() -> Grid<Occupancy> {
        let frame = GridFrame::new(Point2::origin(), 0.1, 10, 10).unwrap();
        let cell = |at: usize| match at % 10 {
            5 => Occupancy::Occupied,
            0..5 => Occupancy::Free,
            _ => Occupancy::Unknown,
        };
        Grid::from_cells(frame, (0..100).map(cell).collect()).unwrap()
    }

    fn scored(p: impl Fn(usize) -> f32) -> MapScore {
        let reference = reference();
        let frame = *reference.frame();
        score(|point| p(frame.cell_at(point).map_or(9, |cell| cell.1)), &reference, 0.1)
    }

    #[test]
    fn a_perfect_map_scores_all_its_cells() {
        let best = scored(|column| if column == 5 { 1.0 } else { 0.0 });
        assert_eq!((best.cells, best.wall_f1, best.free_iou, best.occupied_iou), (60, 1.0, 1.0, 1.0));
        assert_eq!((best.auc, best.brier, best.unknown), (1.0, 0.0, 0.0));
        approx::assert_relative_eq!(best.correlation, 1.0, epsilon = 1e-9);
        approx::assert_relative_eq!(best.map_score, 60.0 * (1.0 + 0.98f64.log2()), epsilon = 1e-6);
    }

    #[test]
    fn single_cells_score_as_by_hand() {
        // 0.848 for p = 0.9 on a wall, −2.32 for p = 0.1.
        let right = scored(|column| if column == 5 { 0.9 } else { 0.5 });
        approx::assert_abs_diff_eq!(right.map_score, 8.48, epsilon = 1e-2);
        let wrong = scored(|column| if column == 5 { 0.1 } else { 0.5 });
        approx::assert_abs_diff_eq!(wrong.map_score, -23.2, epsilon = 0.1);
        approx::assert_relative_eq!(right.unknown, 50.0 / 60.0, epsilon = 1e-9);
    }

    #[test]
    fn a_wall_beside_the_true_one_counts_within_the_tolerance() {
        let beside = scored(|column| if column == 4 { 0.8 } else { 0.2 });
        assert_eq!((beside.wall_precision, beside.wall_recall, beside.occupied_iou), (1.0, 1.0, 0.0));
        approx::assert_relative_eq!(beside.mapped_to_true, 0.1, epsilon = 1e-9);
        let far = scored(|column| if column == 2 { 0.8 } else { 0.2 });
        assert_eq!((far.wall_precision, far.wall_recall), (0.0, 0.0));
        assert_eq!(scored(|_| 0.5).auc, 0.5);
        assert_eq!(scored(|_| 0.5).correlation, 0.0);
    }
}

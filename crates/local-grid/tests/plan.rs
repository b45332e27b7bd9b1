//! Small worlds drawn by hand, seen as signatures.

use local_grid::nalgebra::{Isometry2, Point2};
use local_grid::{CellClass, GridFrame, Signature};

/// A world: what is at a point.
pub(crate) trait Plan: Fn(Point2<f64>) -> CellClass {}
impl<F: Fn(Point2<f64>) -> CellClass> Plan for F {}

/// The signature of the place at `world_from_place`, on cells of 0.1 m, `edge` metres wide.
pub(crate) fn seen(plan: impl Plan, world_from_place: Isometry2<f64>, edge: f64) -> Signature {
    let frame = GridFrame::covering(Point2::new(-0.5 * edge, -0.5 * edge), Point2::origin(), 0.1).unwrap();
    let n = 2 * (frame.columns() - 1);
    let frame = GridFrame::new(frame.origin(), 0.1, n, n).unwrap();
    let class = |index: usize| plan(world_from_place * frame.center(index / n, index % n));
    Signature::from_classes(frame, (0..n * n).map(class).collect()).unwrap()
}

/// A room with a niche and a pillar: no two directions look alike.
pub(crate) fn room(point: Point2<f64>) -> CellClass {
    let (x, y) = (point.x, point.y);
    let inside = (x > -2.0 && x < 2.4 && y > -1.7 && y < 2.1) || (x > 0.4 && x < 1.3 && (2.1..2.7).contains(&y));
    let pillar = (x + 0.9).abs() < 0.15 && (y - 0.8).abs() < 0.25;
    let near_wall = |d: f64| {
        let grown = (x > -2.0 - d && x < 2.4 + d && y > -1.7 - d && y < 2.1 + d)
            || (x > 0.4 - d && x < 1.3 + d && (2.1..2.7 + d).contains(&y));
        grown && !inside
    };
    match (pillar, inside, near_wall(0.11)) {
        (true, ..) | (_, _, true) => CellClass::Occupied,
        (_, true, _) => CellClass::Empty,
        _ => CellClass::Unknown,
    }
}

/// A corridor 2 m wide along `x`, without end.
pub(crate) fn corridor(point: Point2<f64>) -> CellClass {
    match point.y.abs() {
        y if y < 1.0 => CellClass::Empty,
        y if y < 1.11 => CellClass::Occupied,
        _ => CellClass::Unknown,
    }
}

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Point2, Vector2};

use crate::Segment;
use crate::index::SegmentIndex;

/// How a point where surfaces end or meet throws sound back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CornerKind {
    /// A right angle seen from inside: two reflections send every ray back where it came from.
    Retroreflector,
    /// An end or a corner seen from outside: a weak echo, diffracted into all directions.
    Edge,
}

/// A corner or edge, with the angular sector from which it is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Corner {
    pub(crate) point: Point2<f64>,
    pub(crate) kind: CornerKind,
    /// Where the sector of free directions begins, counter-clockwise, in radians.
    begin: f64,
    /// How wide the sector is, in radians.
    extent: f64,
}

/// How far a corner may differ from a right angle and still send sound straight back: the beam's width covers it.
const RIGHT_ANGLE_TOLERANCE: f64 = 0.14;
/// A corner that opens wider than this is an edge: flatter ones are dents in a wall.
const EDGE_OPENING: f64 = PI + 0.5;
/// Surfaces nearer than this to a point meet there, in metres.
const TOUCH: f64 = 1e-4;

impl Corner {
    /// Whether the corner shows this side to `viewer`.
    pub(crate) fn faces(&self, viewer: Point2<f64>) -> bool {
        let toward = viewer - self.point;
        (toward.y.atan2(toward.x) - self.begin).rem_euclid(TAU) <= self.extent
    }
}

/// All corners and edges of a set of walls.
pub(crate) fn corners(segments: &[Segment], index: &SegmentIndex) -> Vec<Corner> {
    let mut points: Vec<Point2<f64>> = segments.iter().flat_map(|s| [s.from, s.to]).collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut corners = Vec::new();
    let mut done: Vec<Point2<f64>> = Vec::new();
    for point in points {
        // Points are sorted by x, so that a twin is among the last ones.
        let is_twin = |other: &&Point2<f64>| (point - **other).norm() < TOUCH;
        if done.iter().rev().take_while(|other| point.x - other.x < TOUCH).any(|other| is_twin(&other)) {
            continue;
        }
        done.push(point);
        corners.extend(sectors(point, segments, index));
    }
    corners
}

/// The corners that the surfaces touching `point` form there, one per sector of free directions.
fn sectors(point: Point2<f64>, segments: &[Segment], index: &SegmentIndex) -> Vec<Corner> {
    let mut directions: Vec<f64> = Vec::new();
    for number in index.near(point, TOUCH) {
        let segment = &segments[number];
        if segment.distance(point) < TOUCH {
            let ends = [segment.from - point, segment.to - point];
            directions.extend(ends.iter().filter(|end| end.norm() >= TOUCH).map(|end| angle(*end)));
        }
    }
    directions.sort_by(f64::total_cmp);
    let next = |k: usize| directions[(k + 1) % directions.len()] + if k + 1 == directions.len() { TAU } else { 0.0 };
    (0..directions.len())
        .filter_map(|k| {
            let (begin, extent) = (directions[k], next(k) - directions[k]);
            let kind = kind_of(extent)?;
            Some(Corner { point, kind, begin, extent })
        })
        .collect()
}

fn kind_of(extent: f64) -> Option<CornerKind> {
    if (extent - FRAC_PI_2).abs() < RIGHT_ANGLE_TOLERANCE {
        Some(CornerKind::Retroreflector)
    } else if extent > EDGE_OPENING {
        Some(CornerKind::Edge)
    } else {
        None // obtuse and sharp corners return sound by the bounces that rays follow
    }
}

fn angle(toward: Vector2<f64>) -> f64 {
    toward.y.atan2(toward.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;

    fn find(lines: &[[f64; 4]]) -> Vec<Corner> {
        let segments: Vec<Segment> = lines
            .iter()
            .map(|l| Segment { from: Point2::new(l[0], l[1]), to: Point2::new(l[2], l[3]), material: Material::Smooth })
            .collect();
        corners(&segments, &SegmentIndex::new(&segments))
    }

    #[test]
    fn an_angle_of_two_walls_is_a_retroreflector_inside_and_an_edge_outside() {
        let found = find(&[[0.0, 0.0, 2.0, 0.0], [0.0, 0.0, 0.0, 2.0]]);
        let at_origin: Vec<_> = found.iter().filter(|c| c.point == Point2::origin()).collect();
        assert_eq!(at_origin.len(), 2);
        for corner in at_origin {
            let inside = corner.faces(Point2::new(1.0, 1.0));
            assert_eq!(inside, corner.kind == CornerKind::Retroreflector);
            assert_eq!(!inside, corner.faces(Point2::new(-1.0, 1.0)));
        }
    }

    #[test]
    fn a_wall_that_meets_another_makes_two_right_angles() {
        let found = find(&[[-2.0, 0.0, 2.0, 0.0], [0.0, 0.0, 0.0, 2.0]]);
        assert_eq!(found.iter().filter(|c| c.kind == CornerKind::Retroreflector).count(), 2);
        assert_eq!(found.iter().filter(|c| c.kind == CornerKind::Edge).count(), 3); // the three free ends
    }

    #[test]
    fn a_wall_in_two_pieces_has_no_corner_in_the_middle() {
        let found = find(&[[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 2.0, 0.0]]);
        assert!(found.iter().all(|c| c.point.x != 1.0));
    }
}

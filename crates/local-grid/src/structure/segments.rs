use nalgebra::{Matrix2, Point2, Vector2};

use crate::Echo;

/// A straight stretch of wall in a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    /// Its direction in radians.
    pub(super) direction: f64,
    /// Its length in metres.
    pub(super) length: f64,
}

/// Echoes farther apart than this, in metres, are not of one wall.
const GAP: f64 = 0.3;
/// What is shorter than this, in metres, is furniture as likely as a wall.
const SHORTEST: f64 = 0.8;
/// The fewest echoes of a wall.
const FEWEST: usize = 8;
/// The most that an echo of a wall lies off its chord, in metres: noise of the scanner and what stands along walls.
const STRAIGHT: f64 = 0.08;

/// The straight walls of a scan: neighbouring echoes, split where they leave their chord the most
/// (Ramer 1972; Douglas & Peucker 1973), then fitted by a line with least squares across it.
pub(super) fn segments(echoes: &[Echo]) -> Vec<Segment> {
    segments_of(&echoes.iter().map(|echo| echo.point).collect::<Vec<_>>())
}

fn segments_of(points: &[Point2<f64>]) -> Vec<Segment> {
    let mut found = Vec::new();
    for surface in points.chunk_by(|a, b| (b - a).norm() <= GAP) {
        split(surface, &mut found);
    }
    found
}

fn split(points: &[Point2<f64>], found: &mut Vec<Segment>) {
    let (Some(first), Some(last), true) = (points.first(), points.last(), points.len() >= FEWEST) else { return };
    let chord = last - first;
    let length = chord.norm();
    if length < SHORTEST {
        return;
    }
    let normal = Vector2::new(-chord.y, chord.x) / length;
    let off = |point: &Point2<f64>| (point - first).dot(&normal).abs();
    let farthest = (0..points.len()).max_by(|&a, &b| off(&points[a]).total_cmp(&off(&points[b]))).unwrap_or(0);
    if off(&points[farthest]) > STRAIGHT {
        split(&points[..=farthest], found);
        split(&points[farthest..], found);
    } else {
        found.push(Segment { direction: direction(points), length });
    }
}

/// The direction along which points spread the most.
#[expect(clippy::cast_precision_loss, reason = "echoes of a scan are few")]
fn direction(points: &[Point2<f64>]) -> f64 {
    let mean = points.iter().map(|point| point.coords).sum::<Vector2<f64>>() / points.len() as f64;
    let off = |point: &Point2<f64>| point.coords - mean;
    let spread: Matrix2<f64> = points.iter().map(|point| off(point) * off(point).transpose()).sum();
    0.5 * (2.0 * spread[(0, 1)]).atan2(spread[(0, 0)] - spread[(1, 1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_is_two_walls_and_a_chair_is_none() {
        let at = |x: f64, y: f64| Point2::new(x, y);
        let steps = |n: u32| (0..n).map(|k| 0.1 * f64::from(k));
        let mut points: Vec<Point2<f64>> = steps(31).map(|x| at(x, 0.02 * (40.0 * x).sin())).collect();
        points.extend(steps(21).skip(1).map(|y| at(3.0, y)));
        points.extend(steps(5).map(|x| at(3.6 + x, 4.0)));
        let found = segments_of(&points);
        assert_eq!(found.len(), 2, "{found:?}");
        approx::assert_abs_diff_eq!(found[0].length, 3.0, epsilon = 0.1);
        approx::assert_abs_diff_eq!(found[1].length, 2.0, epsilon = 0.1);
        approx::assert_abs_diff_eq!(found[0].direction, 0.0, epsilon = 0.02);
        approx::assert_abs_diff_eq!(found[1].direction.abs(), std::f64::consts::FRAC_PI_2, epsilon = 0.02);
    }
}

use nalgebra::{Isometry2, Point2, Rotation2, Vector2};

use crate::mapper::Mapper;
use crate::metrics::TruthMetrics;

/// The log's truth: where the robot really was, by stamp.
#[derive(Debug, Clone, Default)]
pub struct Truth {
    poses: Vec<(f64, Isometry2<f64>)>,
}

impl Truth {
    /// Adds the next true pose; stamps must not run backwards.
    pub fn push(&mut self, stamp: f64, map_from_robot: Isometry2<f64>) {
        self.poses.push((stamp, map_from_robot));
    }

    /// Whether the log held no truth.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// The true position at `stamp`, interpolated; `None` outside of the log's truth.
    #[must_use]
    pub fn at(&self, stamp: f64) -> Option<Point2<f64>> {
        let after = self.poses.partition_point(|(other, _)| *other < stamp);
        let (later, to) = self.poses.get(after)?;
        if *later == stamp || after == 0 {
            return (*later == stamp).then(|| to.translation.vector.into());
        }
        let (earlier, from) = self.poses[after - 1];
        let share = (stamp - earlier) / (later - earlier);
        Some(from.translation.vector.lerp(&to.translation.vector, share).into())
    }

    /// Mean error of the places, each at the moment at which it was visited, after rigid alignment: of the raw
    /// odometry, of dead reckoning along the links, and after relaxation. `None` without truth for two visits.
    #[must_use]
    pub fn judge(&self, mapper: &Mapper) -> Option<TruthMetrics> {
        let (before, after) = (mapper.dead_reckoned(), mapper.coordinates().positions());
        let samples = mapper.trajectory().samples();
        let mut paths: [Vec<Point2<f64>>; 4] = Default::default();
        for anchor in mapper.trajectory().anchors() {
            let sample = samples.get(anchor.sample.saturating_sub(1));
            let (Some(truth), Some(sample)) = (self.at(anchor.stamp), sample) else { continue };
            let place = anchor.place.index();
            let Some((before, after)) = before.get(place).zip(after.get(place)) else { continue };
            let odometry = Point2::from(sample.odom_from_robot.translation.vector);
            for (path, point) in paths.iter_mut().zip([truth, odometry, *before, *after]) {
                path.push(point);
            }
        }
        let [truth, odometry, before, after] = paths;
        (truth.len() >= 2).then(|| TruthMetrics {
            places: truth.len(),
            odometry_m: mean_error(&odometry, &truth),
            before_m: mean_error(&before, &truth),
            after_m: mean_error(&after, &truth),
        })
    }
}

/// Mean distance of corresponding points after the rigid motion that brings `points` nearest to `truth`.
///
/// With centred points `p` and `q` the rotation is `atan2(Σ p × q, Σ p · q)`.
fn mean_error(points: &[Point2<f64>], truth: &[Point2<f64>]) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^52 points")]
    let n = points.len() as f64;
    let center = |of: &[Point2<f64>]| of.iter().map(|point| point.coords).sum::<Vector2<f64>>() / n;
    let (p0, q0) = (center(points), center(truth));
    let pairs = || points.iter().zip(truth).map(|(p, q)| (p.coords - p0, q.coords - q0));
    let (cross, dot) = pairs().fold((0.0, 0.0), |(cross, dot), (p, q)| (cross + p.perp(&q), dot + p.dot(&q)));
    let turn = Rotation2::new(f64::atan2(cross, dot));
    pairs().map(|(p, q)| (turn * p - q).norm()).sum::<f64>() / n
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rigid_motion_is_no_error() {
        let truth: Vec<Point2<f64>> = (0..5).map(|k| Point2::new(f64::from(k), f64::from(k * k))).collect();
        let moved: Vec<_> = truth.iter().map(|p| Isometry2::new(Vector2::new(3.0, -1.0), 0.7) * p).collect();
        assert!(mean_error(&moved, &truth) < 1e-12);
    }

    #[test]
    fn truth_is_interpolated_and_never_invented() {
        let mut truth = Truth::default();
        truth.push(1.0, Isometry2::translation(0.0, 0.0));
        truth.push(2.0, Isometry2::translation(1.0, 2.0));
        assert_eq!(truth.at(1.5), Some(Point2::new(0.5, 1.0)));
        assert_eq!(truth.at(1.0), Some(Point2::new(0.0, 0.0)));
        assert_eq!((truth.at(0.5), truth.at(2.5)), (None, None));
    }
}

use nalgebra::{Isometry2, Point2};
use serde::Serialize;

use super::alignment::{Alignment, align};
use super::path::TimedPath;
use super::statistics::Statistics;

/// How far a path is from where it should be (absolute trajectory error).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AbsoluteError {
    /// Pairs of poses that were compared.
    pub pairs: usize,
    /// The motion that was applied to the estimate before it was compared.
    #[serde(skip)]
    pub reference_from_estimate: Isometry2<f64>,
    /// Distances in metres, after the alignment.
    pub translation_m: Statistics,
    /// Differences of heading in degrees, after the alignment.
    pub rotation_deg: Statistics,
    /// The rotation of the rigid fit in degrees, whether it was applied or not.
    pub fitted_rotation_deg: f64,
    /// The factor by which the estimate would have to grow; never applied.
    pub fitted_scale: f64,
}

/// How far each stretch of a path is from what it should be (relative pose error).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RelativeError {
    /// Stretches that were compared.
    pub pairs: usize,
    /// Lengths of the errors in metres.
    pub translation_m: Statistics,
    /// Errors of the turns in degrees.
    pub rotation_deg: Statistics,
}

/// How long the stretches of a relative error are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Delta {
    /// So many poses on.
    Poses(usize),
    /// Until so many metres of the reference are driven.
    Metres(f64),
    /// Until so many seconds have gone.
    Seconds(f64),
}

/// Poses of two paths at common stamps: estimate, reference.
type Pairs = Vec<(Isometry2<f64>, Isometry2<f64>, f64)>;

/// Pairs every pose of the shorter path with the nearest in time of the longer, where they are at most `apart` seconds apart, as evo does.
fn pair(estimate: &TimedPath, reference: &TimedPath, apart: f64) -> Pairs {
    let swapped = reference.len() < estimate.len();
    let (short, long) = if swapped { (reference, estimate) } else { (estimate, reference) };
    let mut pairs = Vec::new();
    for (stamp, pose) in short.iter() {
        let Some(index) = long.nearest(stamp).filter(|index| (long.stamps()[*index] - stamp).abs() <= apart) else {
            continue;
        };
        let other = long.poses()[index];
        pairs.push(if swapped { (other, *pose, stamp) } else { (*pose, other, stamp) });
    }
    pairs
}

/// The absolute error of `estimate` against `reference`; poses at most `apart` seconds apart are compared (evo's default is 0.01).
///
/// `None` where no stamps agree.
#[must_use]
pub fn absolute_error(
    estimate: &TimedPath,
    reference: &TimedPath,
    alignment: Alignment,
    apart: f64,
) -> Option<AbsoluteError> {
    let pairs = pair(estimate, reference, apart);
    let point = |pose: &Isometry2<f64>| Point2::from(pose.translation.vector);
    let (points, true_points): (Vec<_>, Vec<_>) =
        pairs.iter().map(|(estimate, reference, _)| (point(estimate), point(reference))).unzip();
    let fit = align(&points, &true_points)?;
    let motion = match alignment {
        Alignment::Rigid => fit.reference_from_estimate,
        Alignment::Origin => pairs[0].1 * pairs[0].0.inverse(),
        Alignment::None => Isometry2::identity(),
    };
    let distances: Vec<f64> = points.iter().zip(&true_points).map(|(p, q)| (motion * p - q).norm()).collect();
    let turn = |(estimate, reference, _): &(Isometry2<f64>, Isometry2<f64>, f64)| {
        (motion * estimate).rotation.angle_to(&reference.rotation).abs().to_degrees()
    };
    let turns: Vec<f64> = pairs.iter().map(turn).collect();
    Some(AbsoluteError {
        pairs: pairs.len(),
        reference_from_estimate: motion,
        translation_m: Statistics::of(&distances)?,
        rotation_deg: Statistics::of(&turns)?,
        fitted_rotation_deg: fit.reference_from_estimate.rotation.angle().to_degrees(),
        fitted_scale: fit.scale,
    })
}

/// The relative error of `estimate` against `reference` over stretches of `delta`, from every common pose on.
///
/// The error of a stretch is `(reference stretch)⁻¹ · (estimated stretch)`. `None` where no stretch is that long.
#[must_use]
pub fn relative_error(estimate: &TimedPath, reference: &TimedPath, delta: Delta, apart: f64) -> Option<RelativeError> {
    let pairs = pair(estimate, reference, apart);
    let mut driven = vec![0.0];
    for pair in pairs.windows(2) {
        let step = (pair[1].1.translation.vector - pair[0].1.translation.vector).norm();
        driven.push(driven.last().copied().unwrap_or(0.0) + step);
    }
    let end = |start: usize| match delta {
        Delta::Poses(count) => start + count.max(1),
        Delta::Metres(metres) => start + driven[start..].partition_point(|so_far| so_far - driven[start] < metres),
        Delta::Seconds(seconds) => {
            start + pairs[start..].partition_point(|(_, _, stamp)| stamp - pairs[start].2 < seconds)
        }
    };
    let (mut lengths, mut turns) = (Vec::new(), Vec::new());
    for start in 0..pairs.len() {
        let Some(last) = pairs.get(end(start)).filter(|_| end(start) > start) else { continue };
        let stretch = pairs[start].0.inv_mul(&last.0);
        let true_stretch = pairs[start].1.inv_mul(&last.1);
        let error = true_stretch.inv_mul(&stretch);
        lengths.push(error.translation.vector.norm());
        turns.push(error.rotation.angle().abs().to_degrees());
    }
    Some(RelativeError {
        pairs: lengths.len(),
        translation_m: Statistics::of(&lengths)?,
        rotation_deg: Statistics::of(&turns)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    fn path(scale: f64, turn: f64) -> TimedPath {
        TimedPath::new((0..50).map(|k| {
            let k = f64::from(k);
            let at = Vector2::new((0.2 * k).cos() * k, (0.2 * k).sin() * k) * scale;
            (k, Isometry2::new(Vector2::new(1.0, 2.0), turn) * Isometry2::new(at, 0.2 * k))
        }))
    }

    #[test]
    fn a_path_moved_as_a_whole_has_no_error() {
        let (truth, moved) = (path(1.0, 0.0), path(1.0, 1.1));
        let error = absolute_error(&moved, &truth, Alignment::Rigid, 0.01).unwrap();
        assert!(error.translation_m.max < 1e-9 && error.rotation_deg.max < 1e-9);
        approx::assert_relative_eq!(error.fitted_rotation_deg, -1.1f64.to_degrees(), epsilon = 1e-9);
        assert!(absolute_error(&moved, &truth, Alignment::Origin, 0.01).unwrap().translation_m.max < 1e-9);
        assert!(absolute_error(&moved, &truth, Alignment::None, 0.01).unwrap().translation_m.max > 10.0);
        assert!(relative_error(&moved, &truth, Delta::Poses(1), 0.01).unwrap().translation_m.max < 1e-9);
    }

    #[test]
    fn a_wrong_scale_is_told_and_not_forgiven() {
        let error = absolute_error(&path(0.8, 0.0), &path(1.0, 0.0), Alignment::Rigid, 0.01).unwrap();
        approx::assert_relative_eq!(error.fitted_scale, 1.25, epsilon = 1e-9);
        assert!(error.translation_m.rmse > 1.0);
    }

    #[test]
    fn stretches_are_as_long_as_asked() {
        let straight = |speed: f64| {
            TimedPath::new((0..11).map(|k| (f64::from(k), Isometry2::translation(speed * f64::from(k), 0.0))))
        };
        let error = |delta| relative_error(&straight(1.1), &straight(1.0), delta, 0.01).unwrap();
        approx::assert_relative_eq!(error(Delta::Poses(1)).translation_m.mean, 0.1, epsilon = 1e-12);
        approx::assert_relative_eq!(error(Delta::Metres(5.0)).translation_m.mean, 0.5, epsilon = 1e-12);
        assert_eq!(error(Delta::Seconds(4.0)).pairs, 7);
        assert_eq!(relative_error(&straight(1.0), &straight(1.0), Delta::Metres(99.0), 0.01), None);
    }

    #[test]
    fn paths_without_common_stamps_cannot_be_compared() {
        let late = TimedPath::new(path(1.0, 0.0).iter().map(|(stamp, pose)| (stamp + 0.5, *pose)));
        assert_eq!(absolute_error(&late, &path(1.0, 0.0), Alignment::Rigid, 0.01), None);
        assert_eq!(absolute_error(&late, &path(1.0, 0.0), Alignment::Rigid, 0.5).unwrap().pairs, 50);
    }
}

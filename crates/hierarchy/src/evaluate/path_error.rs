use nalgebra::{Isometry2, Point2};
use serde::Serialize;

use super::alignment::{Alignment, align};
use super::pairing::{Pair, Pairing, pair};
use super::path::TimedPath;
use super::statistics::Statistics;

/// How far a path is from where it should be (absolute trajectory error).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AbsoluteError {
    /// Pairs of poses that were compared.
    pub pairs: usize,
    /// How they were found: `nearest` in time, or `interpolated`.
    pub pairing: &'static str,
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

/// The absolute error of `estimate` against `reference` at the stamps that `pairing` finds in common.
///
/// `None` where there is none.
#[must_use]
pub fn absolute_error(
    estimate: &TimedPath,
    reference: &TimedPath,
    alignment: Alignment,
    pairing: Pairing,
) -> Option<AbsoluteError> {
    let pairs = pair(estimate, reference, pairing);
    let point = |pose: &Isometry2<f64>| Point2::from(pose.translation.vector);
    let (points, true_points): (Vec<_>, Vec<_>) =
        pairs.iter().map(|pair| (point(&pair.estimate), point(&pair.reference))).unzip();
    let fit = align(&points, &true_points)?;
    let motion = match alignment {
        Alignment::Rigid => fit.reference_from_estimate,
        Alignment::Origin => pairs[0].reference * pairs[0].estimate.inverse(),
        Alignment::None => Isometry2::identity(),
    };
    let distances: Vec<f64> = points.iter().zip(&true_points).map(|(p, q)| (motion * p - q).norm()).collect();
    let turn = |pair: &Pair| (motion * pair.estimate).rotation.angle_to(&pair.reference.rotation).abs().to_degrees();
    let turns: Vec<f64> = pairs.iter().map(turn).collect();
    Some(AbsoluteError {
        pairs: pairs.len(),
        pairing: pairing.name(),
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
pub fn relative_error(
    estimate: &TimedPath,
    reference: &TimedPath,
    delta: Delta,
    pairing: Pairing,
) -> Option<RelativeError> {
    let pairs = pair(estimate, reference, pairing);
    let mut driven = vec![0.0];
    for pair in pairs.windows(2) {
        let step = (pair[1].reference.translation.vector - pair[0].reference.translation.vector).norm();
        driven.push(driven.last().copied().unwrap_or(0.0) + step);
    }
    let end = |start: usize| match delta {
        Delta::Poses(count) => start + count.max(1),
        Delta::Metres(metres) => start + driven[start..].partition_point(|so_far| so_far - driven[start] < metres),
        Delta::Seconds(seconds) => {
            start + pairs[start..].partition_point(|pair| pair.stamp - pairs[start].stamp < seconds)
        }
    };
    let (mut lengths, mut turns) = (Vec::new(), Vec::new());
    for start in 0..pairs.len() {
        let Some(last) = pairs.get(end(start)).filter(|_| end(start) > start) else { continue };
        let stretch = pairs[start].estimate.inv_mul(&last.estimate);
        let true_stretch = pairs[start].reference.inv_mul(&last.reference);
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
        let error = absolute_error(&moved, &truth, Alignment::Rigid, Pairing::default()).unwrap();
        assert!(error.translation_m.max < 1e-9 && error.rotation_deg.max < 1e-9);
        approx::assert_relative_eq!(error.fitted_rotation_deg, -1.1f64.to_degrees(), epsilon = 1e-9);
        assert!(
            absolute_error(&moved, &truth, Alignment::Origin, Pairing::default()).unwrap().translation_m.max < 1e-9
        );
        assert!(absolute_error(&moved, &truth, Alignment::None, Pairing::default()).unwrap().translation_m.max > 10.0);
        assert!(relative_error(&moved, &truth, Delta::Poses(1), Pairing::default()).unwrap().translation_m.max < 1e-9);
    }

    #[test]
    fn a_wrong_scale_is_told_and_not_forgiven() {
        let error = absolute_error(&path(0.8, 0.0), &path(1.0, 0.0), Alignment::Rigid, Pairing::default()).unwrap();
        approx::assert_relative_eq!(error.fitted_scale, 1.25, epsilon = 1e-9);
        assert!(error.translation_m.rmse > 1.0);
    }

    #[test]
    fn stretches_are_as_long_as_asked() {
        let straight = |speed: f64| {
            TimedPath::new((0..11).map(|k| (f64::from(k), Isometry2::translation(speed * f64::from(k), 0.0))))
        };
        let error = |delta| relative_error(&straight(1.1), &straight(1.0), delta, Pairing::default()).unwrap();
        approx::assert_relative_eq!(error(Delta::Poses(1)).translation_m.mean, 0.1, epsilon = 1e-12);
        approx::assert_relative_eq!(error(Delta::Metres(5.0)).translation_m.mean, 0.5, epsilon = 1e-12);
        assert_eq!(error(Delta::Seconds(4.0)).pairs, 7);
        assert_eq!(relative_error(&straight(1.0), &straight(1.0), Delta::Metres(99.0), Pairing::default()), None);
    }

    #[test]
    fn paths_without_common_stamps_cannot_be_compared() {
        let late = TimedPath::new(path(1.0, 0.0).iter().map(|(stamp, pose)| (stamp + 0.5, *pose)));
        assert_eq!(absolute_error(&late, &path(1.0, 0.0), Alignment::Rigid, Pairing::default()), None);
        assert_eq!(
            absolute_error(&late, &path(1.0, 0.0), Alignment::Rigid, Pairing::Nearest { apart: 0.5 }).unwrap().pairs,
            50
        );
    }
}

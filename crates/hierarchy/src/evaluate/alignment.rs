use nalgebra::{Isometry2, Point2, Rotation2, Vector2};
use serde::{Deserialize, Serialize};

/// How an estimated path is laid onto a reference before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Alignment {
    /// By the rigid motion that makes the sum of the squared distances least.
    #[default]
    Rigid,
    /// By the poses at the first common stamp.
    Origin,
    /// Not at all.
    None,
}

/// The similarity that lays one set of points onto another with the least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The rigid motion.
    pub reference_from_estimate: Isometry2<f64>,
    /// The factor by which the estimate would have to grow, besides; 1 where the points are all the same.
    pub scale: f64,
}

/// Fits `estimate` to `reference`, point by point; `None` without points, or where the numbers differ.
///
/// With centred points `p` (estimate) and `q` (reference) the rotation is `atan2(Σ p × q, Σ p · q)` (Umeyama 1991 in the plane) and the
/// scale `Σ (R p) · q / Σ p · p`.
#[must_use]
pub fn align(estimate: &[Point2<f64>], reference: &[Point2<f64>]) -> Option<Fit> {
    if estimate.is_empty() || estimate.len() != reference.len() {
        return None;
    }
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2⁵³ points")]
    let center =
        |points: &[Point2<f64>]| points.iter().map(|point| point.coords).sum::<Vector2<f64>>() / points.len() as f64;
    let (p0, q0) = (center(estimate), center(reference));
    let pairs = || estimate.iter().zip(reference).map(|(p, q)| (p.coords - p0, q.coords - q0));
    let (cross, dot) = pairs().fold((0.0, 0.0), |(cross, dot), (p, q)| (cross + p.perp(&q), dot + p.dot(&q)));
    let turn = Rotation2::new(f64::atan2(cross, dot));
    let spread: f64 = pairs().map(|(p, _)| p.norm_squared()).sum();
    let scale = if spread > 0.0 { pairs().map(|(p, q)| (turn * p).dot(&q)).sum::<f64>() / spread } else { 1.0 };
    let reference_from_estimate = Isometry2::new(q0 - turn * p0, turn.angle());
    Some(Fit { reference_from_estimate, scale })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_similarity_is_found_again() {
        let estimate: Vec<_> = (0..7).map(|k| Point2::new(f64::from(k), f64::from(k * k) / 3.0)).collect();
        let motion = Isometry2::new(Vector2::new(3.0, -8.0), 2.5);
        let reference: Vec<_> = estimate.iter().map(|p| motion * p).collect();
        let fit = align(&estimate, &reference).unwrap();
        approx::assert_relative_eq!(fit.reference_from_estimate, motion, epsilon = 1e-12);
        approx::assert_relative_eq!(fit.scale, 1.0, epsilon = 1e-12);
        let grown: Vec<_> = reference.iter().map(|p| p * 1.25).collect();
        approx::assert_relative_eq!(align(&estimate, &grown).unwrap().scale, 1.25, epsilon = 1e-12);
    }

    #[test]
    fn nothing_and_a_single_point_are_no_trouble() {
        assert_eq!(align(&[], &[]), None);
        let fit = align(&[Point2::new(1.0, 2.0)], &[Point2::new(5.0, 5.0)]).unwrap();
        assert_eq!((fit.scale, fit.reference_from_estimate.rotation.angle()), (1.0, 0.0));
    }
}

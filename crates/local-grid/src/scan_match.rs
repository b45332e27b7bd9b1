mod echoes;
mod refine;
mod search;
mod track;

use nalgebra::{Isometry2, Matrix3};

use crate::{Ambiguity, Heading, LocalMap};

pub use echoes::{Echo, echoes, thinned};
pub use refine::refine;
pub use search::{SearchWindow, search};
pub use track::{TrackOptions, track};

/// How scans are fitted to a local map.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct MatchOptions {
    /// Scale of the robust kernel in metres: echoes further from a wall lose influence.
    pub kernel: f64,
    /// Standard deviation of an echo's distance to its wall, in metres.
    pub echo_sigma: f64,
    /// How many echoes count as one independent measurement: neighbours see the same wall and share its errors.
    pub echoes_per_measurement: f64,
    /// An axis is ambiguous when less than this share of the walls' information lies along it.
    pub ambiguous_below: f64,
    /// The share of the prior's information that counts along axes of which the walls do tell.
    pub prior_share: f64,
    /// The most steps of Gauss and Newton.
    pub max_steps: usize,
}

impl Default for MatchOptions {
    fn default() -> Self {
        Self {
            kernel: 0.15,
            echo_sigma: 0.05,
            echoes_per_measurement: 10.0,
            ambiguous_below: 0.03,
            prior_share: 1e-3,
            max_steps: 30,
        }
    }
}

/// Where a scan fits into a map, and how far to believe it.
#[derive(Debug, Clone, PartialEq)]
pub struct Match {
    /// The robot's pose.
    pub map_from_robot: Isometry2<f64>,
    /// Covariance of `(x, y, heading)` from the scan alone, in metres and radians. Along an ambiguous axis it is that of
    /// ignorance within the field's reach, `max_distance² / 3`.
    pub covariance: Matrix3<f64>,
    /// Mean nearness of the echoes to walls, `exp(−d² / 2 kernel²)`, in `[0, 1]`.
    pub score: f64,
    /// The share of echoes within the kernel's scale of a wall.
    pub inliers: f64,
    /// The share of echoes that lie in known free space, away from walls.
    pub contradiction: f64,
    /// The share of echoes that lie where the map knows anything.
    pub overlap: f64,
    /// Where the position is a guess.
    pub ambiguity: Ambiguity,
}

/// A guess of the robot's pose and how far it is trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The guess, from odometry.
    pub map_from_robot: Isometry2<f64>,
    /// Inverse covariance of `(x, y, heading)` in the map's frame; zero for a guess that is only a start.
    pub information: Matrix3<f64>,
}

impl Prior {
    /// A start for the search that is not held against the scan.
    #[must_use]
    pub fn start(map_from_robot: Isometry2<f64>) -> Self {
        Self { map_from_robot, information: Matrix3::zeros() }
    }

    /// How many standard deviations (Mahalanobis' distance) a pose lies from the guess.
    #[must_use]
    pub fn deviation(&self, map_from_robot: &Isometry2<f64>) -> f64 {
        let turned = Heading::from_radians(map_from_robot.rotation.angle())
            - Heading::from_radians(self.map_from_robot.rotation.angle());
        let off = (map_from_robot.translation.vector - self.map_from_robot.translation.vector).push(turned);
        off.dot(&(self.information * off)).max(0.0).sqrt()
    }
}

/// How well echoes fit at a pose, without any search.
#[must_use]
pub fn judge(map: &LocalMap, echoes: &[Echo], map_from_robot: &Isometry2<f64>, options: &MatchOptions) -> Fit {
    let mut fit = Fit::default();
    if echoes.is_empty() {
        return fit;
    }
    for echo in echoes {
        let point = map_from_robot * echo.point;
        let (distance, _) = map.distance(point);
        fit.score += (-0.5 * (distance / options.kernel).powi(2)).exp();
        if distance <= options.kernel {
            fit.inliers += 1.0;
        } else if distance <= 2.0 * options.kernel {
            fit.overlap += 1.0;
        } else if map.is_known(point) {
            fit.contradiction += 1.0;
        }
    }
    fit.overlap += fit.inliers + fit.contradiction;
    #[expect(clippy::cast_precision_loss, reason = "echoes of a scan are few")]
    let n = echoes.len() as f64;
    Fit {
        score: fit.score / n,
        inliers: fit.inliers / n,
        contradiction: fit.contradiction / n,
        overlap: fit.overlap / n,
    }
}

/// The quality of a fit; see the fields of the same names in [`Match`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fit {
    /// Mean nearness of the echoes to walls, in `[0, 1]`.
    pub score: f64,
    /// The share of echoes near a wall.
    pub inliers: f64,
    /// The share of echoes in known free space.
    pub contradiction: f64,
    /// The share of echoes where the map knows anything.
    pub overlap: f64,
}

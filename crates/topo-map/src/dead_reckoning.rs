use nalgebra::{Matrix2, Vector2};

/// How far a robot that counts its wheels and holds a compass' heading may be from where it believes to be.
///
/// Wheels count metres well, but a heading that is wrong for some metres carries the robot sideways.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct DeadReckoning {
    /// Variance along the way, in m² per metre driven.
    pub along: f64,
    /// Variance across the way, in m² per metre driven.
    pub sideways: f64,
}

impl Default for DeadReckoning {
    /// 3½ % of a metre along the way; across it, a heading wrong by 2° over some metres. Measured on simulated Nomads whose
    /// compass is held by walls: 0.2 m along and 0.3 m across after 40 m.
    fn default() -> Self {
        Self { along: 0.0012, sideways: 0.004 }
    }
}

impl DeadReckoning {
    /// The covariance, in m², of a displacement `moved` over a way of `driven` metres: what was driven beyond the straight
    /// line went into all directions.
    #[must_use]
    pub fn covariance(&self, moved: Vector2<f64>, driven: f64) -> Matrix2<f64> {
        let straight = moved.norm().min(driven);
        let ahead = moved.try_normalize(1e-6).unwrap_or_else(Vector2::zeros);
        let side = Vector2::new(-ahead.y, ahead.x);
        let about = 0.5 * (self.along + self.sideways) * (driven - straight);
        ahead * ahead.transpose() * (self.along * straight)
            + side * side.transpose() * (self.sideways * straight)
            + Matrix2::identity() * about
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_way_is_surer_along_than_across_and_a_detour_unsure_all_round() {
        let model = DeadReckoning { along: 0.001, sideways: 0.01 };
        let straight = model.covariance(Vector2::new(0.0, 4.0), 4.0);
        approx::assert_relative_eq!(straight, Matrix2::new(0.04, 0.0, 0.0, 0.004), epsilon = 1e-12);
        let detour = model.covariance(Vector2::new(0.0, 4.0), 6.0);
        approx::assert_relative_eq!(detour - straight, Matrix2::identity() * 0.011, epsilon = 1e-12);
        approx::assert_relative_eq!(
            model.covariance(Vector2::zeros(), 2.0),
            Matrix2::identity() * 0.011,
            epsilon = 1e-12
        );
    }
}

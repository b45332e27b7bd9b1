use nalgebra::{Matrix2, Matrix3, Rotation2, Vector2, Vector3};

/// What was driven between two moments, with the uncertainty that it gathered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Travel {
    /// Summed length of the steps, in metres.
    pub path: f64,
    /// Variance of the distance driven, in m², along the robot's heading.
    pub distance_variance: f64,
    /// Covariance of the displacement in the track frame, in m², the heading at the start taken as right.
    pub position: Matrix2<f64>,
    /// Variance of the turn, in rad².
    pub turn_variance: f64,
    /// Covariance of the displacement with the heading at its end, in m·rad.
    pub with_heading: Vector2<f64>,
}

impl Default for Travel {
    fn default() -> Self {
        Self {
            path: 0.0,
            distance_variance: 0.0,
            position: Matrix2::zeros(),
            turn_variance: 0.0,
            with_heading: Vector2::zeros(),
        }
    }
}

impl Travel {
    /// The covariance of (x, y, heading) in the track frame.
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        let mut covariance = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, self.turn_variance));
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&self.position);
        covariance.fixed_view_mut::<2, 1>(0, 2).copy_from(&self.with_heading);
        covariance.fixed_view_mut::<1, 2>(2, 0).copy_from(&self.with_heading.transpose());
        covariance
    }

    /// The turn is known better, by something that says nothing of the displacement.
    pub(super) fn know_turn_to(&mut self, variance: f64) {
        if variance < self.turn_variance {
            self.with_heading *= variance / self.turn_variance;
            self.turn_variance = variance;
        }
    }

    /// The covariance of the displacement in a frame turned by `−heading`, with a floor of `floor` metres.
    #[must_use]
    pub fn position_in(&self, heading: f64, floor: f64) -> Matrix2<f64> {
        let turn = Rotation2::new(-heading);
        turn * self.position * turn.transpose() + Matrix2::identity() * floor.powi(2)
    }
}

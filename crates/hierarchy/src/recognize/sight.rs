use std::sync::Arc;

use nalgebra::{Isometry2, Point2, Vector2};
use robot_log::local_grid::{
    FrameError, FuzzyGrid, Grid, GridFrame, LaserRay, SensorKind, Signature, SignatureOptions, SonarCone,
};

use crate::trajectory::Sample;

/// Draws what a place looks like from the scans taken near it.
///
/// A signature is always drawn anew: a grid that the robot carries along would mix in what was seen on an earlier
/// visit, and a place would be recognised by its own memory instead of by what is there.
#[derive(Debug, Default)]
pub(crate) struct Sight {
    sonar: SonarCone,
    laser: LaserRay,
    options: SignatureOptions,
}

/// Edge of a signature's cells, in metres.
const RESOLUTION: f64 = 0.1;

impl Sight {
    /// What a place looks like, in its own axes.
    pub(crate) fn signature(
        &self,
        track_from_place: &Isometry2<f64>,
        samples: &[Sample],
    ) -> Result<Arc<Signature>, FrameError> {
        Ok(self.cut(&self.grid(track_from_place, samples)?))
    }

    /// The signature of a local grid that has a place at its origin.
    pub(crate) fn cut(&self, grid: &FuzzyGrid) -> Arc<Signature> {
        Arc::new(Signature::cut(grid, Point2::origin(), &self.options))
    }

    /// What the scans say of the surroundings of a place, as a grid in its own axes.
    pub(crate) fn grid(&self, track_from_place: &Isometry2<f64>, samples: &[Sample]) -> Result<FuzzyGrid, FrameError> {
        let half = Vector2::repeat(0.5 * self.options.size);
        let frame = GridFrame::covering(Point2::from(-half), Point2::from(half), RESOLUTION)?;
        let mut grid: FuzzyGrid = Grid::new(frame);
        for sample in samples {
            let pose = &track_from_place.inv_mul(&sample.track_from_robot);
            match sample.scan.sensor().kind() {
                SensorKind::Sonar => grid.integrate(&self.sonar, pose, &sample.scan),
                SensorKind::Laser | SensorKind::Infrared => grid.integrate(&self.laser, pose, &sample.scan),
            }
        }
        Ok(grid)
    }
}

use std::sync::Arc;

use nalgebra::{Point2, Vector2};
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
    /// What the scans say of the surroundings of a point of the track frame, with that point as origin.
    pub(crate) fn signature(
        &self,
        track_from_place: Point2<f64>,
        samples: &[Sample],
    ) -> Result<Arc<Signature>, FrameError> {
        let half = Vector2::repeat(0.5 * self.options.size);
        let frame = GridFrame::covering(track_from_place - half, track_from_place + half, RESOLUTION)?;
        let mut grid: FuzzyGrid = Grid::new(frame);
        for sample in samples {
            let pose = &sample.track_from_robot;
            match sample.scan.sensor().kind() {
                SensorKind::Sonar => grid.integrate(&self.sonar, pose, &sample.scan),
                SensorKind::Laser | SensorKind::Infrared => grid.integrate(&self.laser, pose, &sample.scan),
            }
        }
        Ok(Arc::new(Signature::cut(&grid, track_from_place, &self.options)))
    }
}

use nalgebra::{Isometry2, Matrix3};
use robot_log::local_grid::{
    LocalMap, LocalMapError, LocalMapOptions, Match, Prior, Scan, TrackOptions, echoes, track,
};

/// Follows the robot by a precise sensor: each scan slides into the map of the scans before it.
#[derive(Debug)]
pub(crate) struct LaserTrack {
    map: LocalMap,
    options: TrackOptions,
    /// Where the last scan was matched.
    last: Option<Isometry2<f64>>,
    /// Where the last scan was drawn.
    drawn: Option<Isometry2<f64>>,
}

/// A scan is drawn only where the robot has moved on since the last that was: so many metres, or radians.
const DRAW_EVERY: f64 = 0.1;

impl LaserTrack {
    pub(crate) fn new() -> Self {
        let map = LocalMap::new(LocalMapOptions::default()).expect("the default options describe a map");
        Self { map, options: TrackOptions::default(), last: None, drawn: None }
    }

    /// The map that some scans have left behind, each drawn where it was taken.
    pub(crate) fn restored<'a>(
        scans: impl Iterator<Item = (&'a Isometry2<f64>, &'a Scan)>,
    ) -> Result<Self, LocalMapError> {
        let mut track = Self::new();
        for (pose, scan) in scans {
            track.last = Some(*pose);
            track.draw(*pose, scan)?;
        }
        Ok(track)
    }

    /// Fits a scan near the pose that odometry predicts and draws it; `None` for the first one, which defines the frame.
    pub(crate) fn follow(&mut self, predicted: &Isometry2<f64>, scan: &Scan) -> Result<Option<Match>, LocalMapError> {
        let found = self.last.map(|last| {
            let echoes = echoes(scan, self.map.options().max_range);
            track(&self.map, &echoes, &trusted(predicted, &last), &self.options)
        });
        let pose = found.as_ref().map_or(*predicted, |found| found.map_from_robot);
        self.last = Some(pose);
        self.draw(pose, scan)?;
        Ok(found)
    }

    fn draw(&mut self, pose: Isometry2<f64>, scan: &Scan) -> Result<(), LocalMapError> {
        let near = self.drawn.is_some_and(|drawn| {
            let moved = drawn.inv_mul(&pose);
            moved.translation.vector.norm() <= DRAW_EVERY && moved.rotation.angle().abs() <= DRAW_EVERY
        });
        if !near {
            self.map.insert(&pose, scan)?;
            self.drawn = Some(pose);
        }
        Ok(())
    }
}

/// What odometry says, held against the scan only as far as wheels deserve it: a tenth of each step and of each turn.
fn trusted(predicted: &Isometry2<f64>, last: &Isometry2<f64>) -> Prior {
    let step = last.inv_mul(predicted);
    let (metres, turn) = (step.translation.vector.norm(), step.rotation.angle().abs());
    let (position, heading) = (0.02 + 0.1 * metres, 0.02 + 0.1 * turn + 0.035 * metres);
    let information = Matrix3::from_diagonal(&[position.powi(-2), position.powi(-2), heading.powi(-2)].into());
    Prior { map_from_robot: *predicted, information }
}

use nalgebra::{Isometry2, Matrix3, UnitComplex};
use robot_log::local_grid::{
    Learnt, LocalMap, LocalMapError, LocalMapOptions, Match, Prior, Scan, StructureOptions, TrackOptions, WallCompass,
    WallCompassOptions, echoes, track, wall_direction_of_echoes,
};

/// Follows the robot by a precise sensor: each scan slides into the map of the scans before it.
#[derive(Debug)]
pub(crate) struct LaserTrack {
    map: LocalMap,
    options: TrackOptions,
    /// The directions in which the building's walls run: they hold the heading where scans alone would let it creep.
    walls: WallCompass,
    /// Where the last scan was matched.
    last: Option<Isometry2<f64>>,
    /// Where the last scan was drawn.
    drawn: Option<Isometry2<f64>>,
}

/// A scan is drawn only where the robot has moved on since the last that was: so many metres, or radians.
const DRAW_EVERY: f64 = 0.1;
/// A scan during which the robot turned by more than this, in radians, is drawn only when it must be: what is not known
/// exactly of the scanner's clock turns all of its walls, and the scans after it would be laid onto them.
const ASKEW: f64 = 0.02;
/// It must where the robot has moved so far since the last scan that was drawn, in metres or radians.
const DRAW_AT_LEAST_EVERY: f64 = 0.5;

impl LaserTrack {
    pub(crate) fn new() -> Self {
        let map = LocalMap::new(LocalMapOptions::default()).expect("the default options describe a map");
        let walls = WallCompass::new(WallCompassOptions::default());
        Self { map, options: TrackOptions::default(), walls, last: None, drawn: None }
    }

    /// The map that some scans have left behind, each drawn where it was taken, and what their walls have taught.
    pub(crate) fn restored<'a>(
        scans: impl Iterator<Item = (&'a Isometry2<f64>, &'a Scan)>,
        walls: Learnt,
    ) -> Result<Self, LocalMapError> {
        let walls = WallCompass::recalling(WallCompassOptions::default(), walls);
        let mut track = Self { walls, ..Self::new() };
        for (pose, scan) in scans {
            track.last = Some(*pose);
            track.draw(*pose, scan)?;
        }
        Ok(track)
    }

    /// What the directions of walls have taught so far.
    pub(crate) fn walls(&self) -> Learnt {
        self.walls.learnt()
    }

    /// Fits a scan near the pose that odometry predicts and draws it; `None` for the first one, which defines the frame.
    pub(crate) fn follow(&mut self, predicted: &Isometry2<f64>, scan: &Scan) -> Result<Option<Match>, LocalMapError> {
        let echoes = echoes(scan, self.map.options().max_range);
        let fit = |last| track(&self.map, &echoes, &trusted(predicted, &last), &self.options);
        let mut found = self.last.map(fit);
        if let Some(found) = &mut found
            && let Some(seen) = wall_direction_of_echoes(&echoes, &StructureOptions::default())
        {
            let pose = &mut found.map_from_robot;
            pose.rotation *= UnitComplex::new(self.walls.sight(&seen, pose.rotation.angle()));
        }
        let pose = found.as_ref().map_or(*predicted, |found| found.map_from_robot);
        self.last = Some(pose);
        self.draw(pose, scan)?;
        Ok(found)
    }

    fn draw(&mut self, pose: Isometry2<f64>, scan: &Scan) -> Result<(), LocalMapError> {
        let near = self.drawn.is_some_and(|drawn| {
            let moved = drawn.inv_mul(&pose);
            let askew = scan.sweep().is_some_and(|sweep| sweep.turn.abs() > ASKEW);
            let enough = if askew { DRAW_AT_LEAST_EVERY } else { DRAW_EVERY };
            moved.translation.vector.norm() <= enough && moved.rotation.angle().abs() <= enough
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

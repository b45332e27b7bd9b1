use nalgebra::{Isometry2, Matrix3, UnitComplex, Vector2};
use robot_log::local_grid::{
    Echo, Learnt, LocalMap, LocalMapError, LocalMapOptions, Match, Prior, Scan, StructureOptions, TrackOptions,
    WallCompass, WallCompassOptions, WallDirection, echoes, track, wall_direction_of_echoes,
    wall_direction_of_segments,
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
    /// Radians turned, left or right, during scans that stand askew, since walls last told the heading.
    turned_askew: f64,
}

/// A scan is drawn only where the robot has moved on since the last that was: so many metres, or radians.
const DRAW_EVERY: f64 = 0.1;
/// A scan during which the robot turned by more than this, in radians, is drawn only when it must be: what is not known
/// exactly of the scanner's clock turns all of its walls, and the scans after it would be laid onto them.
const ASKEW: f64 = 0.02;
/// The share of a turn during such scans by which the heading may go astray, as a standard deviation.
const ASTRAY: f64 = 0.15;
/// It must where the robot has moved so far since the last scan that was drawn, in metres or radians.
const DRAW_AT_LEAST_EVERY: f64 = 0.5;

/// A scan with fewer echoes than this says nothing of a pose...
const LEAST_ECHOES: usize = 20;
/// ...nor one whose echoes lie this close together, in metres (root mean square from their mean).
const LEAST_SPREAD: f64 = 0.2;

/// Whether a scan can tell where the robot is: a range finder of one beam, or a scan into the void, cannot.
pub(crate) fn tells_a_pose(scan: &Scan) -> bool {
    let near = |echo: &Vector2<f64>| echo.norm() <= LocalMapOptions::default().max_range;
    let echoes: Vec<Vector2<f64>> = scan.echo_points().filter(near).collect();
    if echoes.len() < LEAST_ECHOES {
        return false;
    }
    #[expect(clippy::cast_precision_loss, reason = "echoes of a scan are few")]
    let count = echoes.len() as f64;
    let mean = echoes.iter().sum::<Vector2<f64>>() / count;
    echoes.iter().map(|echo| (echo - mean).norm_squared()).sum::<f64>() / count >= LEAST_SPREAD.powi(2)
}

impl LaserTrack {
    pub(crate) fn new() -> Self {
        let map = LocalMap::new(LocalMapOptions::default()).expect("the default options describe a map");
        let walls = WallCompass::new(WallCompassOptions::default());
        Self { map, options: TrackOptions::default(), walls, last: None, drawn: None, turned_askew: 0.0 }
    }

    /// The map that some scans have left behind, each drawn where it was taken, and what their walls have taught.
    pub(crate) fn restored<'a>(
        scans: impl Iterator<Item = (&'a Isometry2<f64>, &'a Scan)>,
        walls: Learnt,
    ) -> Result<Self, LocalMapError> {
        let walls = WallCompass::recalling(WallCompassOptions::default(), walls);
        let mut track = Self { walls, ..Self::new() };
        for (pose, scan) in scans {
            let seen = scan.sweep().and_then(|_| sight(scan, &echoes(scan, track.map.options().max_range)));
            let told = track.last.is_some() && seen.is_some();
            track.turned_askew = if told { 0.0 } else { track.turned_askew + turned_askew(scan) };
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
        self.turned_askew += turned_askew(scan);
        if let Some(found) = &mut found
            && let Some(seen) = sight(scan, &echoes)
        {
            let (pose, astray) = (&mut found.map_from_robot, ASTRAY * std::mem::take(&mut self.turned_askew));
            pose.rotation *= UnitComplex::new(self.walls.sight_after(&seen, pose.rotation.angle(), astray));
        }
        let pose = found.as_ref().map_or(*predicted, |found| found.map_from_robot);
        self.last = Some(pose);
        self.draw(pose, scan)?;
        Ok(found)
    }

    fn draw(&mut self, pose: Isometry2<f64>, scan: &Scan) -> Result<(), LocalMapError> {
        let near = self.drawn.is_some_and(|drawn| {
            let moved = drawn.inv_mul(&pose);
            let enough = if is_askew(scan) { DRAW_AT_LEAST_EVERY } else { DRAW_EVERY };
            moved.translation.vector.norm() <= enough && moved.rotation.angle().abs() <= enough
        });
        if !near {
            self.map.insert(&pose, scan)?;
            self.drawn = Some(pose);
        }
        Ok(())
    }
}

/// Whether the robot turned too fast during a scan for its walls to be where they seem.
fn is_askew(scan: &Scan) -> bool {
    scan.sweep().is_some_and(|sweep| sweep.turn.abs() > ASKEW)
}

/// The walls that a scan shows, unless it stands askew.
///
/// Where scans may stand askew the heading goes astray, and few scans show walls well: then the long ones alone will do. They
/// hold no other heading, for in a building with odd angles they speak for single walls (Örebro: 0.28 → 0.68 m).
fn sight(scan: &Scan, echoes: &[Echo]) -> Option<WallDirection> {
    let options = StructureOptions::default();
    if is_askew(scan) {
        return None;
    }
    let long = || scan.sweep().and_then(|_| wall_direction_of_segments(echoes, &options));
    wall_direction_of_echoes(echoes, &options).or_else(long)
}

/// Radians turned during a scan that stands askew.
fn turned_askew(scan: &Scan) -> f64 {
    scan.sweep().filter(|_| is_askew(scan)).map_or(0.0, |sweep| sweep.turn.abs())
}

/// What odometry says, held against the scan only as far as wheels deserve it: a tenth of each step and of each turn.
fn trusted(predicted: &Isometry2<f64>, last: &Isometry2<f64>) -> Prior {
    let step = last.inv_mul(predicted);
    let (metres, turn) = (step.translation.vector.norm(), step.rotation.angle().abs());
    let (position, heading) = (0.02 + 0.1 * metres, 0.02 + 0.1 * turn + 0.035 * metres);
    let information = Matrix3::from_diagonal(&[position.powi(-2), position.powi(-2), heading.powi(-2)].into());
    Prior { map_from_robot: *predicted, information }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use robot_log::local_grid::{RangeSensor, SensorKind};

    use super::*;

    #[test]
    fn a_range_finder_of_one_beam_is_no_laser_scanner() {
        let scan = |n: usize, range: f64| {
            let mounts = (0..n).map(|k| Isometry2::rotation(0.02 * f64::from(u32::try_from(k).unwrap()))).collect();
            let sensor = RangeSensor::new("laser", SensorKind::Laser, mounts, 0.01, 0.02..=30.0).unwrap();
            Scan::from_ranges(Arc::new(sensor), vec![range; n]).unwrap()
        };
        assert!(tells_a_pose(&scan(180, 3.0)));
        assert!(!tells_a_pose(&scan(1, 3.0)), "one beam");
        assert!(!tells_a_pose(&scan(180, 40.0)), "nothing in reach");
        assert!(!tells_a_pose(&scan(180, 0.1)), "a hand before the lens");
    }
}

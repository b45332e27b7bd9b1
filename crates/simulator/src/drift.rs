use nalgebra::Isometry2;
use robot_log::{Entry, EntryKind};

use crate::noise::Noise;
use crate::odometry::{Motion, Odometry, OdometryModel};

/// Spoils the odometry of a log: the increments are counted by the wheels of a robot that an [`OdometryModel`]
/// describes, and what the log said before becomes its truth.
///
/// So a log whose path is known well, because it was corrected or simulated without noise, shows how far a mapper gets
/// from honest dead reckoning. Headings of a compass stay as they are.
///
/// ```
/// use robot_log::{Entry, EntryKind};
/// use simulator::{Drift, OdometryModel, nalgebra::Isometry2};
///
/// let at = |x: f64| EntryKind::Odometry { odom_from_robot: Isometry2::translation(x, 0.0) };
/// let mut drift = Drift::new(OdometryModel::of_shares(0.02, 0.017), 7);
/// drift.spoil(Entry { stamp: 0.0, kind: at(0.0) });
/// let (odometry, truth) = drift.spoil(Entry { stamp: 1.0, kind: at(10.0) });
/// assert!(matches!(odometry.kind, EntryKind::Odometry { odom_from_robot } if odom_from_robot.rotation.angle() != 0.0));
/// assert!(truth.is_some_and(|truth| truth.kind == EntryKind::Truth { map_from_robot: Isometry2::translation(10.0, 0.0) }));
/// ```
#[derive(Debug, Clone)]
pub struct Drift {
    odometry: Odometry,
    /// Where the log's first pose lies: the spoilt path begins there, too.
    start: Option<Isometry2<f64>>,
    last: Isometry2<f64>,
}

impl Drift {
    /// Wheels of the given model; the same seed errs the same way again.
    #[must_use]
    pub fn new(model: OdometryModel, seed: u64) -> Self {
        Self { odometry: Odometry::new(model, Noise::new(seed, 0)), start: None, last: Isometry2::identity() }
    }

    /// The entry with spoilt odometry, and the truth that it held, if it held a pose. A truth of the log's own stays.
    pub fn spoil(&mut self, entry: Entry) -> (Entry, Option<Entry>) {
        let Entry { stamp, kind } = entry;
        let truth = |map_from_robot| Some(Entry { stamp, kind: EntryKind::Truth { map_from_robot } });
        match kind {
            EntryKind::Odometry { odom_from_robot } => {
                let kind = EntryKind::Odometry { odom_from_robot: self.follow(odom_from_robot) };
                (Entry { stamp, kind }, truth(odom_from_robot))
            }
            EntryKind::Scan { odom_from_robot: Some(pose), scan } => {
                let kind = EntryKind::Scan { odom_from_robot: Some(self.follow(pose)), scan };
                (Entry { stamp, kind }, truth(pose))
            }
            kind => (Entry { stamp, kind }, None),
        }
    }

    /// Where the wheels believe the robot to be when it is at `pose`.
    fn follow(&mut self, pose: Isometry2<f64>) -> Isometry2<f64> {
        let Some(start) = self.start else {
            (self.start, self.last) = (Some(pose), pose);
            return pose;
        };
        let step = self.last.inv_mul(&pose);
        let (chord, turn) = (step.translation.vector, step.rotation.angle());
        let turret = local_grid::Heading::from_radians(self.last.rotation.angle());
        // A chord points half a turn away from where the robot faced at its beginning.
        let direction = chord.y.atan2(chord.x) - 0.5 * turn;
        self.odometry.advance(&Motion { turret, direction, distance: chord.norm(), turn });
        self.last = pose;
        start * self.odometry.odom_from_robot()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    fn path() -> Vec<Isometry2<f64>> {
        let pose = |k: i32| {
            let a = 0.05 * f64::from(k);
            Isometry2::new(Vector2::new(4.0 * a.cos(), 3.0 * a.sin()), 1.3 * a)
        };
        (0..200).map(pose).collect()
    }

    #[test]
    fn perfect_wheels_change_nothing() {
        let mut drift = Drift::new(OdometryModel::PERFECT, 1);
        for pose in path() {
            let followed = drift.follow(pose);
            assert!((followed.translation.vector - pose.translation.vector).norm() < 1e-9);
            assert!(followed.rotation.angle_to(&pose.rotation).abs() < 1e-9);
        }
    }

    #[test]
    fn the_same_seed_errs_the_same_way_and_another_does_not() {
        let end = |seed| {
            let mut drift = Drift::new(OdometryModel::of_shares(0.02, 0.017), seed);
            path().into_iter().map(|pose| drift.follow(pose)).last().unwrap()
        };
        assert_eq!(end(3), end(3));
        assert_ne!(end(3), end(4));
        let off = (end(3).translation.vector - path().last().unwrap().translation.vector).norm();
        assert!(off > 0.2, "{off} m of drift after 35 m");
    }
}

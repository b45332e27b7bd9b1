use nalgebra::Isometry2;
use robot_log::local_grid::Reading;
use robot_log::{Entry, EntryKind};

use crate::mapper::MapperError;

/// What came in: counts, times and the length of the odometry's path.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// Entries of any kind.
    pub entries: usize,
    /// Firings of range sensors.
    pub scans: usize,
    /// Beams that measured: an echo, or none up to the maximum range.
    pub readings: usize,
    /// Summed length of the odometry's steps, in metres.
    pub path_length: f64,
    /// First and last stamp, in seconds.
    pub stamps: Option<(f64, f64)>,
    last_odometry: Option<Isometry2<f64>>,
}

impl Tally {
    /// The counts of entries, scans and readings, as a session holds them.
    pub(crate) fn restored(counts: [u64; 3], path_length: f64, stamps: Option<(f64, f64)>) -> Self {
        let [entries, scans, readings] = counts.map(|count| usize::try_from(count).unwrap_or(usize::MAX));
        Self { entries, scans, readings, path_length, stamps, last_odometry: None }
    }

    /// The same, with the odometry's path going on from there.
    pub(crate) fn going_on_from(self, odometry: Option<Isometry2<f64>>) -> Self {
        Self { last_odometry: odometry, ..self }
    }

    /// Refuses an entry that is not finite or comes too late.
    pub(crate) fn check(&self, entry: &Entry) -> Result<(), MapperError> {
        let stamp = entry.stamp;
        let what = match &entry.kind {
            _ if !stamp.is_finite() => Some("the stamp"),
            EntryKind::Odometry { odom_from_robot } if !is_finite(odom_from_robot) => Some("the odometry"),
            EntryKind::Scan { odom_from_robot: Some(pose), .. } if !is_finite(pose) => Some("the odometry"),
            EntryKind::Heading { heading, deviation } | EntryKind::Gyro { heading, deviation }
                if !(heading.radians() + deviation).is_finite() =>
            {
                Some("the heading")
            }
            EntryKind::Recognition { earlier, similarity } if !(earlier + similarity).is_finite() => {
                Some("the recognition")
            }
            _ => None,
        };
        if let Some(what) = what {
            return Err(MapperError::NotFinite { stamp, what });
        }
        match self.stamps {
            Some((_, previous)) if stamp < previous => Err(MapperError::Backwards { stamp, previous }),
            _ => Ok(()),
        }
    }

    pub(crate) fn count(&mut self, entry: &Entry) {
        self.entries += 1;
        let first = self.stamps.map_or(entry.stamp, |(first, _)| first);
        self.stamps = Some((first, entry.stamp));
        match &entry.kind {
            EntryKind::Odometry { odom_from_robot } => self.step_to(*odom_from_robot),
            EntryKind::Scan { odom_from_robot, scan } => {
                self.scans += 1;
                self.readings += scan.readings().iter().filter(|reading| **reading != Reading::Invalid).count();
                if let Some(pose) = odom_from_robot {
                    self.step_to(*pose);
                }
            }
            _ => {}
        }
    }

    fn step_to(&mut self, pose: Isometry2<f64>) {
        if let Some(last) = self.last_odometry.replace(pose) {
            self.path_length += (pose.translation.vector - last.translation.vector).norm();
        }
    }

    /// Last stamp minus first, in seconds.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.stamps.map_or(0.0, |(first, last)| last - first)
    }
}

fn is_finite(pose: &Isometry2<f64>) -> bool {
    pose.translation.vector.iter().all(|x| x.is_finite()) && pose.rotation.angle().is_finite()
}

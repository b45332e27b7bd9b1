use std::sync::{Arc, LazyLock};

use robot_log::local_grid::{RangeSensor, Reading, Scan, SensorKind, SonarCone};
use robot_log::{Entry, EntryKind};

/// Whether the robot sees its surroundings, or has nothing but odometry and a recogniser of its own.
///
/// That shows with the first scan or the first recognition, whichever comes first. What came before waits until then.
#[derive(Debug)]
pub(crate) enum Eyes {
    /// Nothing has shown it yet.
    Undecided(Vec<Entry>),
    /// There are range scans.
    Open,
    /// There are none: the robot knows of its surroundings only that its body was where it drove.
    Shut,
}

impl Default for Eyes {
    fn default() -> Self {
        Self::Undecided(Vec::new())
    }
}

impl Eyes {
    /// Looks at the next entry; answers those that are to be taken in now, in order.
    pub(crate) fn admit(&mut self, entry: &Entry) -> Vec<Entry> {
        match (&entry.kind, &mut *self) {
            (EntryKind::Scan { .. }, Self::Undecided(_) | Self::Shut) => self.decide(Self::Open, Some(entry)),
            (EntryKind::Recognition { .. }, Self::Undecided(_)) => self.decide(Self::Shut, Some(entry)),
            (_, Self::Undecided(waiting)) => {
                waiting.push(entry.clone());
                Vec::new()
            }
            _ => vec![entry.clone()],
        }
    }

    /// Nothing more will come: what still waits is to be taken in.
    pub(crate) fn release(&mut self) -> Vec<Entry> {
        if let Self::Undecided(waiting) = self { std::mem::take(waiting) } else { Vec::new() }
    }

    fn decide(&mut self, found: Self, entry: Option<&Entry>) -> Vec<Entry> {
        let mut due = match std::mem::replace(self, found) {
            Self::Undecided(waiting) => waiting,
            _ => Vec::new(),
        };
        due.extend(entry.cloned());
        due
    }

    /// How it was when the last of some scans was taken.
    pub(crate) fn restored(last: Option<&Scan>) -> Self {
        match last {
            None => Self::default(),
            Some(scan) if scan.sensor().name() == BODY => Self::Shut,
            Some(_) => Self::Open,
        }
    }

    /// Whether there is nothing to see.
    pub(crate) fn are_shut(&self) -> bool {
        matches!(self, Self::Shut)
    }
}

/// What the body of a robot is called where it serves as its only range sensor.
const BODY: &str = "body";
/// Half the width in metres that any wheeled robot sweeps free where it drives.
const RADIUS: f64 = 0.2;
/// Cones that fill its outline, some of them over every point.
const CONES: u8 = 72;

/// The body as a sensor: the robot stands here, so nothing else does. Of all kinds, a sonar's silence means emptiness;
/// it fades towards the end of the cone, which therefore reaches that much farther.
static TOUCH: LazyLock<Scan> = LazyLock::new(|| {
    let (kind, width) = (SensorKind::Sonar, std::f64::consts::TAU / f64::from(CONES));
    let reach = RADIUS + SonarCone::default().depth;
    let sensor = RangeSensor::ring(BODY, kind, usize::from(CONES), 0.0, width, 0.0..=reach).expect("a valid ring");
    Scan::new(Arc::new(sensor), vec![Reading::NoEcho; usize::from(CONES)]).expect("a reading for each cone")
});

/// What a robot without range sensors knows where it is.
pub(crate) fn touch() -> Scan {
    TOUCH.clone()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry2;

    fn at(stamp: f64, kind: EntryKind) -> Entry {
        Entry { stamp, kind }
    }

    fn odometry(stamp: f64) -> Entry {
        at(stamp, EntryKind::Odometry { odom_from_robot: Isometry2::identity() })
    }

    #[test]
    fn what_came_before_waits_for_the_first_scan_or_recognition() {
        let scan = at(3.0, EntryKind::Scan { odom_from_robot: None, scan: touch() });
        let recognition = at(3.0, EntryKind::Recognition { earlier: 1.0, similarity: 0.5 });
        for (decider, shut) in [(&scan, false), (&recognition, true)] {
            let mut eyes = Eyes::default();
            assert!(eyes.admit(&odometry(1.0)).is_empty() && eyes.admit(&odometry(2.0)).is_empty());
            let stamps: Vec<f64> = eyes.admit(decider).iter().map(|entry| entry.stamp).collect();
            assert_eq!(stamps, [1.0, 2.0, 3.0]);
            assert_eq!((eyes.are_shut(), eyes.admit(&odometry(4.0)).len()), (shut, 1));
        }
        let mut eyes = Eyes::Shut;
        assert_eq!(eyes.admit(&scan).len(), 1);
        assert!(!eyes.are_shut(), "a robot that sees is not blind");
    }

    #[test]
    fn a_log_that_shows_neither_is_let_go_at_its_end() {
        let mut eyes = Eyes::default();
        eyes.admit(&odometry(1.0));
        assert_eq!((eyes.release().len(), eyes.release().len()), (1, 0));
    }
}

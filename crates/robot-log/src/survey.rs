use std::sync::Arc;

use local_grid::nalgebra::{Isometry2, Point2};
use local_grid::{RangeSensor, Reading, Scan, SensorKind};
use serde::Serialize;

use crate::entry::{Entry, EntryKind};

mod finding;
mod interval;

pub use finding::Finding;
use interval::Intervals;

/// What a log holds, gathered entry by entry in memory that does not grow with it.
///
/// ```
/// use robot_log::{CarmenOptions, CarmenReader, Survey};
///
/// let text = "ODOM 0 0 0 0 0 0 1.0 h 1\nODOM 3 4 0 0 0 0 3.0 h 3\n";
/// let mut survey = Survey::default();
/// for entry in CarmenReader::new("x", text.as_bytes(), CarmenOptions::default())? {
///     survey.push(&entry?);
/// }
/// assert_eq!((survey.path_length, survey.duration()), (5.0, 2.0));
/// # Ok::<(), robot_log::LogError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Survey {
    /// Entries of all kinds.
    pub entries: u64,
    /// Entries that state the odometry, scans with it included.
    pub poses: u64,
    /// Scans of all sensors.
    pub scans: u64,
    /// Headings of a compass, an inertial unit or a gyro.
    pub headings: u64,
    /// Recognitions that the robot's own recogniser claims.
    pub recognitions: u64,
    /// True poses.
    pub truths: u64,
    /// The first and the last stamp in seconds.
    pub stamps: Option<(f64, f64)>,
    /// Length of the odometry's path in metres.
    pub path_length: f64,
    /// Sum of the odometry's turns, whichever way, in radians.
    pub turning: f64,
    /// The corners of the box that the odometry's path fills, in metres.
    pub bounds: Option<(Point2<f64>, Point2<f64>)>,
    /// The longest step from one odometry to the next in metres, and the stamp at its end.
    pub longest_step: (f64, f64),
    /// The longest time from one entry to the next in seconds, and the stamp at its end.
    pub longest_gap: (f64, f64),
    /// Each sensor with what it read.
    pub sensors: Vec<SensorSurvey>,
    latest_pose: Option<Isometry2<f64>>,
}

/// What one sensor read.
#[derive(Debug, Clone)]
pub struct SensorSurvey {
    /// The sensor.
    pub sensor: Arc<RangeSensor>,
    /// Its scans.
    pub scans: u64,
    /// Beams with an echo.
    pub echoes: u64,
    /// Beams without.
    pub no_echoes: u64,
    /// Beams without a measurement.
    pub invalid: u64,
    /// The nearest and the farthest echo in metres.
    pub nearest_farthest: (f32, f32),
    intervals: Intervals,
    latest: f64,
}

impl Survey {
    /// Takes one entry into account.
    pub fn push(&mut self, entry: &Entry) {
        self.entries += 1;
        if let Some((_, last)) = self.stamps {
            let gap = entry.stamp - last;
            if gap > self.longest_gap.0 {
                self.longest_gap = (gap, entry.stamp);
            }
        }
        self.stamps = Some((self.stamps.map_or(entry.stamp, |(first, _)| first), entry.stamp));
        match &entry.kind {
            EntryKind::Odometry { odom_from_robot } => self.pose(odom_from_robot, entry.stamp),
            EntryKind::Scan { odom_from_robot, scan } => {
                odom_from_robot.iter().for_each(|pose| self.pose(pose, entry.stamp));
                self.scan(scan, entry.stamp);
            }
            EntryKind::Heading { .. } | EntryKind::Gyro { .. } => self.headings += 1,
            EntryKind::Recognition { .. } => self.recognitions += 1,
            EntryKind::Truth { .. } => self.truths += 1,
        }
    }

    /// Seconds from the first entry to the last.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.stamps.map_or(0.0, |(first, last)| last - first)
    }

    /// Width and height in metres of the box that the odometry's path fills.
    #[must_use]
    pub fn extent(&self) -> (f64, f64) {
        self.bounds.map_or((0.0, 0.0), |(low, high)| (high.x - low.x, high.y - low.y))
    }

    fn pose(&mut self, odom_from_robot: &Isometry2<f64>, stamp: f64) {
        self.poses += 1;
        let at = Point2::from(odom_from_robot.translation.vector);
        let (low, high) = self.bounds.unwrap_or((at, at));
        self.bounds = Some((low.inf(&at), high.sup(&at)));
        if let Some(latest) = self.latest_pose.replace(*odom_from_robot) {
            let step = latest.inv_mul(odom_from_robot);
            let length = step.translation.vector.norm();
            self.path_length += length;
            self.turning += step.rotation.angle().abs();
            if length > self.longest_step.0 {
                self.longest_step = (length, stamp);
            }
        }
    }

    fn scan(&mut self, scan: &Scan, stamp: f64) {
        /// A damaged log could name a new sensor with every scan.
        const SENSORS: usize = 100;
        self.scans += 1;
        let known = self.sensors.iter().rposition(|survey| Arc::ptr_eq(&survey.sensor, scan.sensor()));
        let index = match known {
            Some(index) => index,
            None if self.sensors.len() < SENSORS => {
                self.sensors.push(SensorSurvey::new(Arc::clone(scan.sensor())));
                self.sensors.len() - 1
            }
            None => return,
        };
        self.sensors[index].push(scan, stamp);
    }
}

impl SensorSurvey {
    fn new(sensor: Arc<RangeSensor>) -> Self {
        let nearest_farthest = (f32::INFINITY, 0.0);
        let intervals = Intervals::default();
        Self { sensor, scans: 0, echoes: 0, no_echoes: 0, invalid: 0, nearest_farthest, intervals, latest: 0.0 }
    }

    fn push(&mut self, scan: &Scan, stamp: f64) {
        if self.scans > 0 {
            self.intervals.push(stamp - self.latest);
        }
        self.latest = stamp;
        self.scans += 1;
        for reading in scan.readings() {
            match *reading {
                Reading::Echo(range) => {
                    self.echoes += 1;
                    let (nearest, farthest) = self.nearest_farthest;
                    self.nearest_farthest = (nearest.min(range), farthest.max(range));
                }
                Reading::NoEcho => self.no_echoes += 1,
                Reading::Invalid => self.invalid += 1,
            }
        }
    }

    /// Readings of all beams of all scans.
    #[must_use]
    pub fn readings(&self) -> u64 {
        self.echoes + self.no_echoes + self.invalid
    }

    /// The share of the readings that are echoes.
    #[must_use]
    pub fn echo_share(&self) -> f64 {
        share(self.echoes, self.readings())
    }

    /// The share of the readings that are no measurement.
    #[must_use]
    pub fn invalid_share(&self) -> f64 {
        share(self.invalid, self.readings())
    }

    /// The median time from scan to scan in seconds, to a tenth of itself; `None` below two scans.
    #[must_use]
    pub fn interval(&self) -> Option<f64> {
        self.intervals.median()
    }
}

#[expect(clippy::cast_precision_loss, reason = "a share of counts below 2⁵³")]
fn share(part: u64, whole: u64) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// The survey as programs read it.
#[derive(Serialize)]
struct Document<'a> {
    entries: u64,
    odometry: u64,
    scans: u64,
    headings: u64,
    recognitions: u64,
    truths: u64,
    first_stamp_s: Option<f64>,
    duration_s: f64,
    path_length_m: f64,
    turning_rad: f64,
    extent_m: (f64, f64),
    longest_step_m: f64,
    longest_gap_s: f64,
    sensors: Vec<SensorDocument<'a>>,
}

#[derive(Serialize)]
struct SensorDocument<'a> {
    name: &'a str,
    kind: SensorKind,
    beams: usize,
    beam_width_rad: f64,
    min_range_m: f64,
    max_range_m: f64,
    scans: u64,
    readings: u64,
    echoes: u64,
    no_echoes: u64,
    invalid: u64,
    interval_s: Option<f64>,
}

impl Serialize for Survey {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let document = Document {
            entries: self.entries,
            odometry: self.poses,
            scans: self.scans,
            headings: self.headings,
            recognitions: self.recognitions,
            truths: self.truths,
            first_stamp_s: self.stamps.map(|(first, _)| first),
            duration_s: self.duration(),
            path_length_m: self.path_length,
            turning_rad: self.turning,
            extent_m: self.extent(),
            longest_step_m: self.longest_step.0,
            longest_gap_s: self.longest_gap.0,
            sensors: self.sensors.iter().map(SensorSurvey::document).collect(),
        };
        document.serialize(serializer)
    }
}

impl SensorSurvey {
    fn document(&self) -> SensorDocument<'_> {
        SensorDocument {
            name: self.sensor.name(),
            kind: self.sensor.kind(),
            beams: self.sensor.mounts().len(),
            beam_width_rad: self.sensor.beam_width(),
            min_range_m: self.sensor.min_range(),
            max_range_m: self.sensor.max_range(),
            scans: self.scans,
            readings: self.readings(),
            echoes: self.echoes,
            no_echoes: self.no_echoes,
            invalid: self.invalid,
            interval_s: self.interval(),
        }
    }
}

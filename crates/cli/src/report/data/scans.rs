use std::sync::Arc;

use hierarchy::Mapper;
use local_grid::{RangeSensor, Reading, SensorKind};
use serde::Serialize;

use super::{mm, whole};
use crate::report::base64::base64_u16;

/// The readings that were taken at each place.
#[derive(Debug, Default, Serialize)]
pub(super) struct ScanData {
    sensors: Vec<SensorData>,
    /// The place to which each scan belongs.
    place: Vec<u32>,
    sensor: Vec<usize>,
    /// Where the robot was, in millimetres and thousandths of a radian.
    x: Vec<i64>,
    y: Vec<i64>,
    heading: Vec<i64>,
    /// Each beam's range in units of `unit` millimetres, [`NO_ECHO`] and [`INVALID`] apart.
    ranges: String,
    unit: i64,
    /// One scan in so many is in the page.
    every: usize,
}

#[derive(Debug, Serialize)]
struct SensorData {
    name: String,
    kind: &'static str,
    /// Each beam's mount: millimetres ahead and to the left, thousandths of a radian.
    mounts: Vec<[i64; 3]>,
    max: i64,
}

/// Readings that a page should hold at most: 0.4 MB of text.
const BUDGET: usize = 150_000;
/// The range of a beam that came back without an echo.
const NO_ECHO: u16 = u16::MAX;
/// The range of a beam that measured nothing.
const INVALID: u16 = u16::MAX - 1;

impl ScanData {
    pub(super) fn new(mapper: &Mapper) -> Self {
        let (trajectory, poses) = (mapper.trajectory(), mapper.poses());
        let samples = trajectory.samples();
        let n_readings: usize = samples.iter().map(|sample| sample.scan.readings().len()).sum();
        let every = n_readings.div_ceil(BUDGET).max(1);
        let farthest = samples.iter().map(|sample| sample.scan.sensor().max_range()).fold(0.0, f64::max);
        let unit = mm(farthest) / (i64::from(INVALID) - 1) + 1;
        let mut data = Self { every, unit, ..Self::default() };
        let mut sensors: Vec<Arc<RangeSensor>> = Vec::new();
        let mut ranges = Vec::new();
        for (index, (pose, sample)) in poses.iter().zip(samples).enumerate().step_by(every) {
            let after = trajectory.anchors().partition_point(|anchor| anchor.sample <= index);
            let Some(anchor) = trajectory.anchors().get(after.saturating_sub(1)) else { continue };
            data.place.push(anchor.place.0);
            data.sensor.push(known(&mut sensors, sample.scan.sensor()));
            data.x.push(mm(pose.translation.x));
            data.y.push(mm(pose.translation.y));
            data.heading.push(whole(1000.0 * pose.rotation.angle()));
            ranges.extend(sample.scan.readings().iter().map(|reading| stored(*reading, unit)));
        }
        data.sensors = sensors.iter().map(|sensor| SensorData::new(sensor)).collect();
        data.ranges = base64_u16(ranges);
        data
    }
}

/// The number of a sensor among those met so far.
fn known(sensors: &mut Vec<Arc<RangeSensor>>, sensor: &Arc<RangeSensor>) -> usize {
    let same = |other: &Arc<RangeSensor>| Arc::ptr_eq(other, sensor) || other == sensor;
    sensors.iter().position(same).unwrap_or_else(|| {
        sensors.push(Arc::clone(sensor));
        sensors.len() - 1
    })
}

fn stored(reading: Reading, unit: i64) -> u16 {
    match reading {
        Reading::Echo(range) => u16::try_from(mm(range.into()) / unit).unwrap_or(NO_ECHO).min(INVALID - 1),
        Reading::NoEcho => NO_ECHO,
        Reading::Invalid => INVALID,
    }
}

impl SensorData {
    fn new(sensor: &RangeSensor) -> Self {
        let kind = match sensor.kind() {
            SensorKind::Sonar => "sonar",
            SensorKind::Laser => "laser",
            SensorKind::Infrared => "infrared",
        };
        let mount = |mount: &nalgebra::Isometry2<f64>| {
            [mm(mount.translation.x), mm(mount.translation.y), whole(1000.0 * mount.rotation.angle())]
        };
        let mounts = sensor.mounts().iter().map(mount).collect();
        Self { name: sensor.name().to_owned(), kind, mounts, max: mm(sensor.max_range()) }
    }
}

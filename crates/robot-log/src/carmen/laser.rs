use std::f64::consts::{FRAC_PI_2, PI};

use local_grid::nalgebra::{Isometry2, Vector2};
use local_grid::{RangeSensor, Reading, Scan};

use super::params::Param;
use super::{Parser, pose};
use crate::entry::EntryKind;
use crate::error::{Fault, LogErrorKind};
use crate::lines::Words;
use crate::report::LogReport;

/// More beams than any scanner has.
pub(crate) const MOST_BEAMS: usize = 100_000;

/// A laser's pose in a log that differs by more from the robot's is no mount: the two are estimates of different programs.
const FARTHEST_MOUNT: f64 = 2.0;

/// What the line says of the fan of beams: the first beam and the step in radians from the sensor's axis, the limit in metres.
struct Fan {
    first: f64,
    step: f64,
    max_range: f64,
}

/// `FLASER n r1 … rn laser_x laser_y laser_theta odom_x odom_y odom_theta`: half a turn, from the right to the left.
pub(super) fn old_style(
    tag: &[u8],
    words: &mut Words<'_>,
    parser: &mut Parser,
    report: &mut LogReport,
) -> Result<EntryKind, Fault> {
    let count = words.count("the number of ranges", MOST_BEAMS)?;
    let ranges = ranges(words, count)?;
    let fan = Fan { first: -FRAC_PI_2, step: half_turn_step(count), max_range: parser.options.laser_max_range };
    posed(tag, words, &ranges, &fan, parser, report)
}

/// `ROBOTLASER1 type start fov step max accuracy remission n r1 … rn m rem1 … remm laser-pose robot-pose tv rv forward side turn`.
pub(super) fn robot_laser(
    tag: &[u8],
    words: &mut Words<'_>,
    parser: &mut Parser,
    report: &mut LogReport,
) -> Result<EntryKind, Fault> {
    let (fan, ranges) = configured(words, parser)?;
    let kind = posed(tag, words, &ranges, &fan, parser, report)?;
    words.skip(5, "the velocities and the safety distances of the robot")?;
    Ok(kind)
}

/// `RAWLASER1 type start fov step max accuracy remission n r1 … rn m rem1 … remm`: no pose; the mount is a matter of parameters.
pub(super) fn raw_laser(tag: &[u8], words: &mut Words<'_>, parser: &mut Parser) -> Result<EntryKind, Fault> {
    let (fan, ranges) = configured(words, parser)?;
    let (offset, turn) = match tag {
        b"RAWLASER1" => ("robot_frontlaser", 0.0),
        b"RAWLASER2" => ("robot_rearlaser", PI),
        _ => ("", 0.0),
    };
    let of = |property: &str| parser.params.number(&format!("{offset}_{property}"));
    let forward = of("offset").unwrap_or(0.0);
    let aside = of("side_offset").unwrap_or(0.0);
    let turn = of("angular_offset").unwrap_or(turn);
    let mount = Isometry2::new(Vector2::new(forward, aside), turn);
    let scan = scan(tag, &fan, mount, &ranges, parser)?;
    Ok(EntryKind::Scan { odom_from_robot: None, scan })
}

/// The configuration and the ranges of a new-style laser message.
fn configured(words: &mut Words<'_>, parser: &Parser) -> Result<(Fan, Vec<f64>), Fault> {
    words.skip(1, "the type of the laser")?;
    let first = words.number("the angle of the first beam in radians")?;
    let view = words.number("the field of view in radians")?;
    let step = words.number("the angle between beams in radians")?;
    let limit = words.number("the maximum range in metres")?;
    words.skip(2, "the accuracy and the remission mode")?;
    let count = words.count("the number of ranges", MOST_BEAMS)?;
    let ranges = ranges(words, count)?;
    let remissions = words.count("the number of remission values", MOST_BEAMS)?;
    words.skip(remissions, "a remission value")?;
    #[expect(clippy::cast_precision_loss, reason = "at most MOST_BEAMS")]
    let even = view / (count.max(2) - 1) as f64;
    let step = if step == 0.0 { even } else { step };
    // Some programs leave the limit out by writing 0.
    let max_range = if limit > 0.0 { limit } else { parser.options.laser_max_range };
    Ok((Fan { first, step, max_range }, ranges))
}

/// The two poses after the ranges: the laser's and the robot's, whose difference is the mount.
fn posed(
    tag: &[u8],
    words: &mut Words<'_>,
    ranges: &[f64],
    fan: &Fan,
    parser: &mut Parser,
    report: &mut LogReport,
) -> Result<EntryKind, Fault> {
    let odom_from_laser = pose(words, "the laser")?;
    let odom_from_robot = pose(words, "the robot")?;
    let stated = odom_from_robot.inv_mul(&odom_from_laser);
    let mount = match parser.sensors.mount(tag) {
        Some(known) => {
            let apart = known.inv_mul(&stated);
            // Rounded poses wobble by far less; more means that one of the two is corrected and the other is not.
            let wanders = apart.translation.vector.norm() > 0.05 || apart.rotation.angle().abs() > 0.035;
            report.mounts_ignored += u64::from(wanders);
            known
        }
        None if stated.translation.vector.norm() <= FARTHEST_MOUNT => stated,
        None => {
            report.mounts_ignored += 1;
            Isometry2::identity()
        }
    };
    parser.posed[usize::from(matches!(tag, b"RLASER" | b"ROBOTLASER2"))] = true;
    let scan = scan(tag, fan, mount, ranges, parser)?;
    Ok(EntryKind::Scan { odom_from_robot: Some(odom_from_robot), scan })
}

/// The scan of the laser `tag`, whose description is shared with its other scans.
fn scan(tag: &[u8], fan: &Fan, mount: Isometry2<f64>, ranges: &[f64], parser: &mut Parser) -> Result<Scan, Fault> {
    let label = std::str::from_utf8(tag).unwrap_or("laser");
    let (params, options) = (&parser.params, &parser.options);
    let max_range = params.of(label, Param::MaxRange).unwrap_or(fan.max_range);
    let min_range = params.of(label, Param::MinRange).unwrap_or(options.laser_min_range);
    #[expect(clippy::cast_precision_loss, reason = "at most MOST_BEAMS")]
    let key = [ranges.len() as f64, fan.first, fan.step, min_range, max_range];
    let make = || {
        let name = params.sensor_name(label);
        RangeSensor::fan(name, mount, fan.first, fan.step, ranges.len(), min_range..=max_range)
    };
    let sensor = parser
        .sensors
        .find(tag, &key, mount, make)
        .map_err(|error| Fault { kind: LogErrorKind::Sensor(error), span: None })?;
    let readings = ranges.iter().map(|range| reading(&sensor, *range)).collect();
    // One reading per beam, each an echo only between the limits: there is nothing left to refuse.
    Ok(Scan::new(sensor, readings).expect("readings made for this sensor"))
}

/// What a range in a CARMEN log means: 0 is no measurement, the maximum range and more is no echo.
pub(super) fn reading(sensor: &RangeSensor, range: f64) -> Reading {
    if range <= 0.0 {
        Reading::Invalid
    } else if range >= sensor.max_range() {
        Reading::NoEcho
    } else {
        sensor.reading(range)
    }
}

/// `count` ranges in metres.
pub(super) fn ranges(words: &mut Words<'_>, count: usize) -> Result<Vec<f64>, Fault> {
    let mut ranges = Vec::with_capacity(count.min(4096));
    for _ in 0..count {
        ranges.push(words.length("a range in metres, finite and not negative")?);
    }
    Ok(ranges)
}

/// Scanners that cover half a turn send 180 or 360 beams with a whole or half degree between them, or one beam more.
fn half_turn_step(count: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "at most MOST_BEAMS")]
    let steps = if count.is_multiple_of(2) { count } else { count - 1 } as f64;
    PI / steps.max(1.0)
}

use local_grid::nalgebra::{Isometry2, Vector2};
use local_grid::{RangeSensor, Scan, SensorKind};

use super::Parser;
use super::laser::{MOST_BEAMS, ranges, reading};
use super::params::Param;
use crate::entry::EntryKind;
use crate::error::{Fault, LogErrorKind};
use crate::lines::Words;

/// `SONAR cone n r1 … rn x1 y1 theta1 … xn yn thetan`: the full width of the cones, the ranges, the mounts.
pub(super) fn scan(words: &mut Words<'_>, parser: &mut Parser) -> Result<EntryKind, Fault> {
    let cone = words.length("the width of the cones in radians")?;
    // Some drivers write degrees; nothing above half a turn can be radians.
    let cone = if cone > std::f64::consts::PI { cone.to_radians() } else { cone };
    let count = words.count("the number of sonars", MOST_BEAMS)?;
    let ranges = ranges(words, count)?;
    let mut key = vec![cone];
    for _ in 0..3 * count {
        key.push(words.number("the mount of a sonar in metres and radians")?);
    }
    let (params, options) = (&parser.params, &parser.options);
    let kind = params.kind("SONAR").unwrap_or(SensorKind::Sonar);
    let name = params.sensor_name("SONAR");
    let max_range = params.of("SONAR", Param::MaxRange).or_else(|| params.number("robot_sonar_max"));
    let limits = params.of("SONAR", Param::MinRange).unwrap_or(options.sonar_min_range)
        ..=max_range.unwrap_or(options.sonar_max_range);
    let mounts =
        || key[1..].chunks_exact(3).map(|mount| Isometry2::new(Vector2::new(mount[0], mount[1]), mount[2])).collect();
    let tag = format!("SONAR {name} {kind:?} {limits:?}");
    let make = || RangeSensor::new(name, kind, mounts(), cone, limits);
    let sensor = parser.sensors.find(tag.as_bytes(), &key, Isometry2::identity(), make);
    let sensor = sensor.map_err(|error| Fault { kind: LogErrorKind::Sensor(error), span: None })?;
    let readings = ranges.iter().map(|range| reading(&sensor, *range)).collect();
    let scan = Scan::new(sensor, readings).expect("readings made for this sensor");
    Ok(EntryKind::Scan { odom_from_robot: None, scan })
}

use std::sync::Arc;

use local_grid::RangeSensor;

use super::DescriptionError;
use super::table::{Column, Layout, Motors, Table};

/// Whether the tables and the sensors fit together.
pub(super) fn check(tables: &[Table], sensors: &[Arc<RangeSensor>]) -> Result<(), DescriptionError> {
    let wrong = |what: String| Err(DescriptionError::Content(what));
    if tables.is_empty() {
        return wrong("it has no table".to_owned());
    }
    for (index, table) in tables.iter().enumerate() {
        let number = index + 1;
        if let Some(scale) = scales(table).into_iter().find(|scale| !scale.is_finite() || *scale == 0.0) {
            return wrong(format!("table {number} has the unit {scale}, which must be finite and not 0"));
        }
        let sources = [table.pose.is_some(), table.wheels.is_some(), table.motors.is_some()];
        if sources.iter().filter(|there| **there).count() > 1 {
            return wrong(format!("table {number} has more than one of `pose`, `wheels` and `motors`"));
        }
        if columns(table).into_iter().any(|column| column.0 == 0) {
            return wrong(format!("table {number} names column 0, but the first column is 1"));
        }
        if !table.ignore && table.stamp.is_some() == table.period_s.is_some() {
            return wrong(format!("table {number} needs either `stamp` or `period_s`"));
        }
        if table.wheels.as_ref().is_some_and(|wheels| wheels.left.is_empty() || wheels.right.is_empty()) {
            return wrong(format!("table {number} has wheels without columns"));
        }
        if table.heading.as_ref().is_some_and(|heading| heading.deviation_deg.is_nan() || heading.deviation_deg <= 0.0)
        {
            return wrong(format!("table {number} has a heading whose deviation is not positive"));
        }
        for ranges in &table.ranges {
            let Some(sensor) = sensors.iter().find(|sensor| sensor.name() == ranges.sensor) else {
                return wrong(format!(
                    "table {number} has ranges of the sensor `{}`, which is not described",
                    ranges.sensor
                ));
            };
            if !(0.0..=10.0).contains(&ranges.sweep_s) {
                let (name, sweep) = (&ranges.sensor, ranges.sweep_s);
                return wrong(format!("sensor `{name}` sweeps for {sweep} s, which must lie in 0..=10"));
            }
            if !(0.0..=1.0).contains(&ranges.latency_s) {
                let (name, latency) = (&ranges.sensor, ranges.latency_s);
                return wrong(format!("ranges of `{name}` come after {latency} s, which must lie in 0..=1"));
            }
            let has_motion = table.pose.is_some() || table.wheels.is_some() || table.motors.is_some();
            if ranges.latency_s > 0.0 && (!has_motion || table.heading.is_some()) {
                return wrong(format!(
                    "table {number} has ranges of `{}` with a latency: their lines must have the odometry, and no heading",
                    ranges.sensor
                ));
            }
            let beams = sensor.mounts().len();
            if let Layout::Columns(columns) = &ranges.layout
                && columns.len() != beams
            {
                return wrong(format!(
                    "sensor `{}` has {beams} beams, but table {number} names {} columns",
                    ranges.sensor,
                    columns.len()
                ));
            }
        }
    }
    Ok(())
}

/// The units of a table.
fn scales(table: &Table) -> Vec<f64> {
    let mut scales: Vec<f64> = table.ranges.iter().map(|ranges| ranges.metres).collect();
    scales.extend(table.stamp.map(|stamp| stamp.seconds));
    scales.extend(table.period_s);
    scales.extend(table.pose.iter().flat_map(|pose| [pose.metres, pose.degrees.unwrap_or(1.0)]));
    scales.extend(table.wheels.iter().flat_map(|wheels| [wheels.metres, wheels.track]));
    scales.extend(table.motors.iter().flat_map(|motors| [motors.seconds, motors.speed, motors.turn_deg]));
    scales.extend(
        table.heading.iter().flat_map(|heading| [heading.degrees.unwrap_or(1.0), 1.0 + heading.offset_deg.abs()]),
    );
    scales
}

/// The columns that a table names.
fn columns(table: &Table) -> Vec<Column> {
    let mut columns: Vec<Column> = table.stamp.iter().map(|stamp| stamp.column).collect();
    columns.extend(table.pose.iter().flat_map(|pose| [pose.x, pose.y, pose.heading]));
    columns.extend(table.wheels.iter().flat_map(|wheels| wheels.left.iter().chain(&wheels.right)));
    columns.extend(table.motors.iter().flat_map(|motors: &Motors| [motors.left, motors.right, motors.lasted]));
    columns.extend(table.heading.iter().map(|heading| heading.column));
    for ranges in &table.ranges {
        match &ranges.layout {
            Layout::Columns(some) => columns.extend(some),
            Layout::From(from) => columns.push(*from),
            Layout::Pairs(pairs) => columns.push(pairs.from),
            Layout::Beam(beam) => columns.extend([beam.bearing, beam.range]),
            Layout::Points(points) => columns.extend([points.count, points.from]),
        }
    }
    columns
}

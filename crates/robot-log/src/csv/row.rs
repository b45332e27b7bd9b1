use std::collections::VecDeque;

use local_grid::nalgebra::{Isometry2, Vector2};
use local_grid::{Heading, Sweep};

use super::{Rows, ranges};
use crate::description::{Column, HeadingColumn, PoseColumns};
use crate::entry::{Entry, EntryKind};
use crate::error::Fault;
use crate::report::LogReport;

/// Reads a row of table `index`; the row is cut into fields already.
pub(super) fn read(
    rows: &mut Rows,
    index: usize,
    line: &[u8],
    told: &mut VecDeque<Entry>,
    report: &mut LogReport,
) -> Result<(), Fault> {
    let table = &rows.tables[index];
    let fields = &rows.fields;
    if let Some(count) = table.columns.filter(|count| *count != fields.len()) {
        let extra = fields.span(line, (fields.len() > count).then_some(count));
        let expected = if extra.is_empty() {
            format!("{count} columns, of which {} are there", fields.len())
        } else {
            format!("the end of the line after {count} columns")
        };
        return Err(Fault::field(line, extra, expected));
    }
    let heading = match &table.heading {
        Some(column) => heading(column, rows, line)?.map(|heading| (heading, column.deviation_deg.to_radians())),
        None => None,
    };
    let gyro = table.heading.as_ref().is_some_and(|column| column.gyro);
    // Everything is read before anything is believed, so that a faulty row changes nothing.
    let scans = table
        .ranges
        .iter()
        .filter_map(|ranges| Some((ranges, rows.robot.sensor(&ranges.sensor)?)))
        .map(|(ranges, sensor)| Ok((ranges::scan(ranges, sensor, line, fields)?, ranges.sweep_s, ranges.latency_s)))
        .collect::<Result<Vec<_>, Fault>>()?;
    let motion = motion(rows, index, line)?;
    let stamp = stamp(rows, index, line, report)?;
    let odom_from_robot = moved(rows, index, motion, heading.map(|(heading, _)| heading));
    if let Some(odom_from_robot) = odom_from_robot {
        rows.path.follow(stamp, odom_from_robot);
    }
    let mut give = |stamp: f64, kind: EntryKind| {
        rows.given = rows.given.max(stamp); // a scan that was long on its way is no older than what was told already
        told.push_back(Entry { stamp: rows.given, kind });
    };
    // A heading is that of the moment at which the wheels have made the step.
    if let (Some(odom_from_robot), true) = (odom_from_robot, scans.is_empty() || heading.is_some()) {
        give(stamp, EntryKind::Odometry { odom_from_robot });
    }
    if let Some((heading, deviation)) = heading {
        let gyro_or_compass =
            if gyro { EntryKind::Gyro { heading, deviation } } else { EntryKind::Heading { heading, deviation } };
        give(stamp, gyro_or_compass);
    }
    for (scan, seconds, latency) in scans {
        let taken = stamp - latency;
        let motion = rows.path.motion(taken - 0.5 * seconds).filter(|_| seconds > 0.0);
        let scan = match motion.and_then(|(motion, time)| Sweep::during(&motion, time, seconds)) {
            Some(sweep) => scan.swept(sweep),
            None => scan,
        };
        let odom_from_robot = if latency > 0.0 { rows.path.at(taken) } else { odom_from_robot };
        give(taken, EntryKind::Scan { odom_from_robot, scan });
    }
    Ok(())
}

/// What a row says of the robot's motion, before it is added up.
enum Motion {
    Pose(Isometry2<f64>),
    Wheels(f64, f64),
    Motors { command: (f64, f64), seconds: f64 },
    None,
}

fn motion(rows: &Rows, index: usize, line: &[u8]) -> Result<Motion, Fault> {
    let (table, fields) = (&rows.tables[index], &rows.fields);
    if let Some(columns) = &table.pose {
        return Ok(Motion::Pose(pose(columns, rows, line)?));
    }
    if let Some(wheels) = &table.wheels {
        let mean = |columns: &[Column], what: &str| -> Result<f64, Fault> {
            let sum: f64 = columns.iter().map(|column| fields.number(line, *column, what)).sum::<Result<f64, _>>()?;
            #[expect(clippy::cast_precision_loss, reason = "a robot has few wheels")]
            Ok(sum / columns.len() as f64)
        };
        return Ok(Motion::Wheels(
            mean(&wheels.left, "the counter of a left wheel")?,
            mean(&wheels.right, "the counter of a right wheel")?,
        ));
    }
    if let Some(motors) = &table.motors {
        let left = fields.number(line, motors.left, "the command to the left motor")?;
        let right = fields.number(line, motors.right, "the command to the right motor")?;
        let lasted = fields.number(line, motors.lasted, "how long the command before lasted")?;
        return Ok(Motion::Motors { command: (left, right), seconds: lasted * motors.seconds });
    }
    Ok(Motion::None)
}

/// Adds the motion up; the odometry after the row, where the row says something of it.
fn moved(rows: &mut Rows, index: usize, motion: Motion, heading: Option<Heading>) -> Option<Isometry2<f64>> {
    let table = &rows.tables[index];
    match motion {
        Motion::Pose(pose) => Some(pose),
        Motion::Wheels(left, right) => {
            table.wheels.as_ref().map(|wheels| rows.odometry.wheels(wheels, left, right, heading))
        }
        Motion::Motors { command, seconds } => table
            .motors
            .map(|motors| rows.odometry.motors(command, seconds, motors.speed, motors.turn_deg.to_radians())),
        Motion::None => None,
    }
}

fn pose(columns: &PoseColumns, rows: &Rows, line: &[u8]) -> Result<Isometry2<f64>, Fault> {
    let x = rows.fields.number(line, columns.x, "x of the robot")?;
    let y = rows.fields.number(line, columns.y, "y of the robot")?;
    let heading = rows.fields.number(line, columns.heading, "the heading of the robot")?;
    let heading = radians(heading, columns.degrees, columns.clockwise);
    Ok(Isometry2::new(Vector2::new(x, y) * columns.metres, heading))
}

/// The absolute heading of the row; `None` where its value means that it is not known.
fn heading(column: &HeadingColumn, rows: &Rows, line: &[u8]) -> Result<Option<Heading>, Fault> {
    let raw = rows.fields.number(line, column.column, "the absolute heading of the robot")?;
    if column.invalid.contains(&raw) {
        return Ok(None);
    }
    let heading = radians(raw, column.degrees, column.clockwise) + column.offset_deg.to_radians();
    Ok(Some(Heading::from_radians(heading)))
}

/// The angle `raw` in radians, counter-clockwise.
fn radians(raw: f64, degrees: Option<f64>, clockwise: bool) -> f64 {
    let radians = degrees.map_or(raw, |degrees| (raw * degrees).to_radians());
    if clockwise { -radians } else { radians }
}

/// The stamp of the row in seconds, in order; a row without one is a period after the row before.
fn stamp(rows: &mut Rows, index: usize, line: &[u8], report: &mut LogReport) -> Result<f64, Fault> {
    let table = &rows.tables[index];
    let Some(column) = table.stamp else {
        let stamp = rows.counted.map_or(0.0, |stamp| stamp + table.period_s.unwrap_or(0.0));
        rows.counted = Some(stamp);
        return Ok(stamp);
    };
    let stamp = column.seconds * rows.fields.number(line, column.column, "the stamp")?;
    let span = rows.fields.span(line, rows.fields.index(column.column));
    rows.watch.accept(stamp, report).map_err(|kind| Fault { kind, span: Some(span) })
}

//! Just enough reading and writing for this example; `robot-log` is the crate that reads logs.

use std::error::Error;
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Read, Write};
use std::sync::Arc;

use local_grid::nalgebra::{Isometry2, Vector2};
use local_grid::{Evidence, Grid, RangeSensor, Scan};

/// A scan and where odometry saw it.
pub(crate) struct Log {
    pub(crate) stamp: f64,
    pub(crate) odom_from_robot: Isometry2<f64>,
    pub(crate) scan: Scan,
}

/// A true displacement between two moments.
pub(crate) struct Relation {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) from_pose_to: Isometry2<f64>,
}

fn open(path: &str) -> Result<Box<dyn BufRead>, Box<dyn Error>> {
    let file = File::open(path)?;
    let reader: Box<dyn Read> =
        if path.ends_with(".gz") { Box::new(flate2::read::MultiGzDecoder::new(file)) } else { Box::new(file) };
    Ok(Box::new(BufReader::new(reader)))
}

pub(crate) fn read_log(path: &str) -> Result<Vec<Log>, Box<dyn Error>> {
    let mut log = Vec::new();
    let mut sensor: Option<Arc<RangeSensor>> = None;
    let mut wheels = Wheels::default();
    for line in open(path)?.lines() {
        let line = line?;
        let mut words = line.split_ascii_whitespace();
        let Some(first) = words.next() else { continue };
        match first {
            "FLASER" => {
                let n: usize = words.next().ok_or("no count")?.parse()?;
                let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
                let sensor = sensor.get_or_insert_with(|| half_circle(n, Isometry2::identity(), 40.0));
                let pose = &numbers[n + 3..n + 6];
                let odom_from_robot = Isometry2::new(Vector2::new(pose[0], pose[1]), pose[2]);
                let scan = Scan::from_ranges(sensor.clone(), numbers[..n].iter().copied())?;
                // The host's name stands between the two stamps.
                let stamp = numbers.get(n + 6).copied().unwrap_or(log.len() as f64);
                log.push(Log { stamp, odom_from_robot, scan });
            }
            "L" => {
                let numbers: Vec<f64> = words.map(str::parse).collect::<Result<_, _>>()?;
                let sensor = sensor.get_or_insert_with(|| half_circle(180, Isometry2::translation(0.25, 0.0), 40.0));
                let odom_from_robot = Isometry2::new(Vector2::new(numbers[0], numbers[1]) / 100.0, numbers[2]);
                let scan = Scan::from_ranges(sensor.clone(), numbers[6..186].iter().map(|cm| cm / 100.0))?;
                log.push(Log { stamp: numbers[186], odom_from_robot, scan });
            }
            _ if first.parse::<f64>().is_ok() && line.len() > 1000 => {
                let numbers: Vec<f64> = line.split_ascii_whitespace().map(str::parse).collect::<Result<_, _>>()?;
                let sensor = sensor.get_or_insert_with(ticks_scanner);
                let odom_from_robot = wheels.advance(numbers[2], numbers[3]);
                let scan = Scan::from_ranges(sensor.clone(), numbers[24..706].iter().map(|mm| mm / 1000.0))?;
                log.push(Log { stamp: numbers[0] * 1e-6, odom_from_robot, scan });
            }
            _ => {}
        }
    }
    Ok(log)
}

fn half_circle(n: usize, mount: Isometry2<f64>, max_range: f64) -> Arc<RangeSensor> {
    let degrees = 180.0 / if n % 2 == 1 { n as f64 - 1.0 } else { n as f64 };
    let fan = RangeSensor::fan("laser", mount, (-90f64).to_radians(), degrees.to_radians(), n, 0.05..=max_range);
    Arc::new(fan.expect("a sensor of known good numbers"))
}

/// The scanner of the CoreSLAM logs: 682 beams over 240°.
fn ticks_scanner() -> Arc<RangeSensor> {
    let (first, step) = (-120f64.to_radians(), 240f64.to_radians() / 681.0);
    let mount = Isometry2::translation(0.145, 0.0);
    Arc::new(RangeSensor::fan("laser", mount, first, step, 682, 0.05..=10.0).expect("a sensor of known good numbers"))
}

/// Dead reckoning from the accumulated ticks of two wheels.
#[derive(Default)]
struct Wheels {
    last: Option<(f64, f64)>,
    odom_from_robot: Isometry2<f64>,
}

impl Wheels {
    fn advance(&mut self, left: f64, right: f64) -> Isometry2<f64> {
        let per_tick = std::f64::consts::TAU * 0.077 / 2000.0;
        if let Some((old_left, old_right)) = self.last {
            let (l, r) = ((left - old_left) * per_tick, (right - old_right) * per_tick);
            let (along, turn) = (0.5 * (l + r), (r - l) / (2.0 * 0.165));
            let step = Vector2::new(along * (0.5 * turn).cos(), along * (0.5 * turn).sin());
            self.odom_from_robot *= Isometry2::new(step, turn);
        }
        self.last = Some((left, right));
        self.odom_from_robot
    }
}

pub(crate) fn read_relations(path: &str) -> Result<Vec<Relation>, Box<dyn Error>> {
    let mut relations = Vec::new();
    for line in open(path)?.lines() {
        let numbers: Vec<f64> = line?.split_ascii_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        let [from, to, x, y, _, _, _, turn] = numbers[..] else { continue };
        relations.push(Relation { from, to, from_pose_to: Isometry2::new(Vector2::new(x, y), turn) });
    }
    Ok(relations)
}

/// The pose at a moment, between the two scans around it; `None` more than 2 s outside of the log.
pub(crate) fn interpolate(log: &[Log], poses: &[Isometry2<f64>], stamp: f64) -> Option<Isometry2<f64>> {
    if stamp < log.first()?.stamp - 2.0 || stamp > log.last()?.stamp + 2.0 {
        return None;
    }
    let after = log.partition_point(|entry| entry.stamp <= stamp).clamp(1, log.len() - 1);
    let (a, b) = (log[after - 1].stamp, log[after].stamp);
    let share = if b > a { ((stamp - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
    Some(poses[after - 1].lerp_slerp(&poses[after], share))
}

/// Spoils the odometry: each step's length by 2 %, its turn by 1° per metre, both as systematic and as random errors.
pub(crate) fn drifted(log: &mut [Log], seed: u64) {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut noise = move || {
        // The sum of twelve uniform numbers is near enough to a normal one.
        let uniform = |state: &mut u64| {
            *state ^= *state << 13;
            *state ^= *state >> 7;
            *state ^= *state << 17;
            (*state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform(&mut state)).sum::<f64>() - 6.0
    };
    let (scale, bias) = (1.0 + 0.02 * noise(), 1f64.to_radians() * noise().signum());
    let mut spoilt = log.first().map_or_else(Isometry2::identity, |entry| entry.odom_from_robot);
    let mut before = spoilt;
    for entry in log.iter_mut() {
        let step = before.inv_mul(&entry.odom_from_robot);
        before = entry.odom_from_robot;
        let metres = step.translation.vector.norm();
        let shift = step.translation.vector * (scale + 0.02 * noise());
        let turn = step.rotation.angle() + metres * (bias + 1f64.to_radians() * noise());
        spoilt *= Isometry2::new(shift, turn);
        entry.odom_from_robot = spoilt;
    }
}

/// A picture of a grid: black walls, white space, grey unknown.
pub(crate) fn write_pgm(path: &str, grid: &Grid<Evidence>) -> Result<(), Box<dyn Error>> {
    let mut out = BufWriter::new(File::create(path)?);
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    writeln!(out, "P5\n{columns} {rows}\n255")?;
    for row in (0..rows).rev() {
        let shade = |cell: &Evidence| match (cell.empty, cell.occupied) {
            (0.0, 0.0) => 160u8,
            (_, occupied) if occupied >= 0.25 => 0,
            _ => 255,
        };
        let line: Vec<u8> = grid.cells()[row * columns..(row + 1) * columns].iter().map(shade).collect();
        out.write_all(&line)?;
    }
    Ok(())
}

pub(crate) fn write_trajectory(path: &str, log: &[Log], poses: &[Isometry2<f64>]) -> Result<(), Box<dyn Error>> {
    let mut out = BufWriter::new(File::create(path)?);
    for (entry, pose) in log.iter().zip(poses) {
        let at = pose.translation.vector;
        writeln!(out, "{:.6} {:.5} {:.5} {:.6}", entry.stamp, at.x, at.y, pose.rotation.angle())?;
    }
    Ok(())
}

//! Builds a gridmap from readings at known poses, times it, and writes it as images.
//!
//! ```text
//! known_poses sonar|laser FILE REPEATS OUT [fuzzy|bayes|dempster-shafer]
//! ```
//!
//! `FILE` holds one scan per line: `x y heading range…`, metres and radians. A sonar has one beam of 25 degrees and 6 m;
//! a laser looks over 180 degrees and sees up to 50 m.
//! The time is the mean of the one thread on its processor; with the feature `parallel`, by the wall.
//! Writes `OUT.pgm` (grey `254 (1 − p)`, 205 unknown; for sonar the 450 × 350 cells from the origin) and `OUT.png`
//! (empty, occupied, contradictory and unexplored told apart), and prints one line of JSON.

#![expect(clippy::print_stdout, reason = "a program says what it made")]

use std::error::Error;
use std::f64::consts::PI;
use std::io::Write;
use std::sync::Arc;
use std::time::{Duration, Instant};

use global_grid::local_grid::nalgebra::{Isometry2, Vector2};
use global_grid::local_grid::{RangeSensor, Scan, SensorKind};
use global_grid::{Calculus, GridMap, GridOptions, assemble, write_picture};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [kind, file, repeats, out, rest @ ..] = arguments.as_slice() else {
        return Err("usage: known_poses sonar|laser FILE REPEATS OUT [fuzzy|bayes|dempster-shafer]".into());
    };
    let sonar = kind == "sonar";
    let scans = read(&std::fs::read_to_string(file)?, sonar)?;
    let calculus = match rest.first().map(String::as_str) {
        None | Some("fuzzy") => Calculus::Fuzzy,
        Some("bayes") => Calculus::Bayes,
        Some("dempster-shafer") => Calculus::DempsterShafer,
        Some(other) => return Err(format!("no such calculus: {other}").into()),
    };
    let options = GridOptions { resolution: if sonar { 0.1 } else { 0.05 }, calculus, ..GridOptions::default() };
    let (repeats, mut map) = (repeats.parse::<usize>()?.max(1), None);
    let clock = Clock::start();
    for _ in 0..repeats {
        let built = assemble(scans.iter().map(|(pose, scan)| (pose, scan)), &options)?;
        built.settle();
        map = Some(built);
    }
    let ms = clock.milliseconds() / to_f64(repeats);
    let map = map.ok_or("nothing was built")?;
    let readings: usize = scans.iter().map(|(_, scan)| scan.readings().len()).sum();
    let per = ms * 1e6 / to_f64(readings);
    println!("{{\"kind\":\"{kind}\",\"readings\":{readings},\"ms\":{ms:.3},\"ns_per_reading\":{per:.1}}}");
    write_gray(&map, sonar, &format!("{out}.pgm"))?;
    write_picture(&map.to_grid()?, std::fs::File::create(format!("{out}.png"))?)?;
    Ok(())
}

/// Time of this thread on a processor, which other programs do not disturb; by the wall where the system does not tell.
struct Clock {
    wall: Instant,
    busy: Option<u64>,
}

impl Clock {
    fn start() -> Self {
        Self { wall: Instant::now(), busy: Self::busy() }
    }

    /// Nanoseconds that the thread has run so far.
    fn busy() -> Option<u64> {
        std::fs::read_to_string("/proc/thread-self/schedstat").ok()?.split_whitespace().next()?.parse().ok()
    }

    fn milliseconds(&self) -> f64 {
        let busy = self.busy.zip(Self::busy()).map(|(start, end)| Duration::from_nanos(end - start));
        busy.filter(|_| cfg!(not(feature = "parallel"))).unwrap_or_else(|| self.wall.elapsed()).as_secs_f64() * 1e3
    }
}

fn to_f64(count: usize) -> f64 {
    f64::from(u32::try_from(count).unwrap_or(u32::MAX))
}

type PosedScans = Vec<(Isometry2<f64>, Scan)>;

/// One scan per line.
fn read(text: &str, sonar: bool) -> Result<PosedScans, Box<dyn Error>> {
    let mut sensor: Option<Arc<RangeSensor>> = None;
    let mut scans = Vec::new();
    for line in text.lines() {
        let numbers = line.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        let [x, y, heading, ranges @ ..] = numbers.as_slice() else { return Err("a line is too short".into()) };
        let known = sensor.as_ref().filter(|sensor| sensor.mounts().len() == ranges.len());
        let shared = match known {
            Some(sensor) => sensor.clone(),
            None => Arc::new(if sonar { cone()? } else { fan(ranges.len())? }),
        };
        sensor = Some(shared.clone());
        // The generator writes the maximum range where there was no echo.
        let limit = shared.max_range();
        let ranges = ranges.iter().map(|&range| if range >= limit { f64::INFINITY } else { range });
        scans.push((Isometry2::new(Vector2::new(*x, *y), *heading), Scan::from_ranges(shared, ranges)?));
    }
    Ok(scans)
}

fn cone() -> Result<RangeSensor, Box<dyn Error>> {
    Ok(RangeSensor::ring("sonar", SensorKind::Sonar, 1, 0.0, 25f64.to_radians(), 0.1..=6.0)?)
}

fn fan(count: usize) -> Result<RangeSensor, Box<dyn Error>> {
    // An odd number of beams covers both ends of the half circle; an even one stops a step short.
    let step = PI / to_f64(if count % 2 == 1 { count - 1 } else { count });
    Ok(RangeSensor::fan("laser", Isometry2::identity(), -PI / 2.0, step, count, 0.02..=50.0)?)
}

/// The probability of being occupied as a grey image.
fn write_gray(map: &GridMap, sonar: bool, path: &str) -> Result<(), Box<dyn Error>> {
    let shade = |tally| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 254")]
        let gray = (254.0 * (1.0 - map.options().probability(tally))).round() as u8;
        if tally.is_unknown() { 205 } else { gray }
    };
    let grid = map.read(shade)?;
    let (low, rows, columns) = if sonar {
        (Vector2::zeros(), 350, 450)
    } else {
        (grid.frame().origin().coords, grid.frame().rows(), grid.frame().columns())
    };
    let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
    write!(out, "P5\n{columns} {rows}\n255\n")?;
    for row in (0..rows).rev() {
        for column in 0..columns {
            let center = Vector2::new(to_f64(column) + 0.5, to_f64(row) + 0.5) * grid.frame().resolution();
            out.write_all(&[*grid.at((low + center).into()).unwrap_or(&205)])?;
        }
    }
    Ok(out.flush()?)
}

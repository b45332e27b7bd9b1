//! Builds a gridmap from readings at known poses, times it, and writes it as images.
//!
//! ```text
//! known_poses sonar|laser FILE REPEATS OUT [fuzzy|bayes|dempster-shafer [shared|oriolo]]
//! ```
//!
//! `FILE` holds one scan per line: `x y heading range…`, metres and radians. A sonar has one beam of 25 degrees and 6 m;
//! a laser looks over 180 degrees and sees up to 50 m.
//! The time is the median over the repeats, of the one thread on its processor; with the feature `parallel`, by the wall.
//! Writes `OUT.pgm` (grey `254 (1 − p)`, 205 unknown; for sonar the 450 × 350 cells from the origin) and `OUT.png`
//! (empty, occupied, contradictory and unexplored told apart), and prints one line of JSON.

#![expect(clippy::print_stdout, reason = "a program says what it made")]

use std::error::Error;
use std::f64::consts::PI;
use std::io::Write;
use std::sync::Arc;

use global_grid::local_grid::nalgebra::{Isometry2, Vector2};
use global_grid::local_grid::{RangeSensor, Scan, SensorKind, SonarCone};
use global_grid::{Calculus, GridMap, GridOptions, SonarModel, assemble, write_picture};
use rustix::time::{ClockId, clock_gettime};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [kind, file, repeats, out, rest @ ..] = arguments.as_slice() else {
        return Err(
            "usage: known_poses sonar|laser FILE REPEATS OUT [fuzzy|bayes|dempster-shafer [shared|oriolo]]".into()
        );
    };
    let sonar = kind == "sonar";
    let scans = read(&std::fs::read_to_string(file)?, sonar)?;
    let calculus = match rest.first().map(String::as_str) {
        None | Some("fuzzy") => Calculus::Fuzzy,
        Some("bayes") => Calculus::Bayes,
        Some("dempster-shafer") => Calculus::DempsterShafer,
        Some(other) => return Err(format!("no such calculus: {other}").into()),
    };
    let model = match rest.get(1).map(String::as_str) {
        None | Some("shared") => SonarModel::default(),
        Some("oriolo") => SonarModel::Cone(SonarCone::default()),
        Some(other) => return Err(format!("no such model: {other}").into()),
    };
    let resolution = if sonar { 0.1 } else { 0.05 };
    let options = GridOptions { resolution, calculus, sonar: model, ..GridOptions::default() };
    let (mut times, mut map) = (Vec::new(), None);
    for _ in 0..repeats.parse::<usize>()?.max(1) {
        drop(map.take());
        let start = milliseconds();
        let built = assemble(scans.iter().map(|(pose, scan)| (pose, scan)), &options)?;
        built.settle();
        times.push(milliseconds() - start);
        map = Some(built);
    }
    times.sort_by(f64::total_cmp);
    let ms = times[times.len() / 2];
    let map = map.ok_or("nothing was built")?;
    let readings: usize = scans.iter().map(|(_, scan)| scan.readings().len()).sum();
    let per = ms * 1e6 / to_f64(readings);
    let bytes = map.cell_bytes();
    println!(
        "{{\"kind\":\"{kind}\",\"readings\":{readings},\"ms\":{ms:.3},\"ns_per_reading\":{per:.1},\"cell_bytes\":{bytes}}}"
    );
    write_gray(&map, sonar, &format!("{out}.pgm"))?;
    write_picture(&map.to_grid()?, std::fs::File::create(format!("{out}.png"))?)?;
    Ok(())
}

/// Milliseconds that this thread has run on a processor, which other programs hardly disturb; by the wall where many do.
fn milliseconds() -> f64 {
    let clock = if cfg!(feature = "parallel") { ClockId::Monotonic } else { ClockId::ThreadCPUTime };
    let time = clock_gettime(clock);
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of days")]
    let ns = time.tv_nsec as f64;
    #[expect(clippy::cast_precision_loss, reason = "seconds of years")]
    let s = time.tv_sec as f64;
    s * 1e3 + ns * 1e-6
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

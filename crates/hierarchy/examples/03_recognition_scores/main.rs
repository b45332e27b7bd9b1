//! How well the mapper knows its place on logs whose path is known: position error, and closures true and false.
//!
//! ```text
//! cargo run --release -p hierarchy --example 03_recognition_scores -- [--robot NAME] [--drift SEEDS] [--stampless] [--carry FROM,TO] [--links] [--growth] LOG...
//! ```
//!
//! Without `--drift` a log's own truth judges it (`TRUEPOS`). With it the log's odometry is the truth, and is spoilt by
//! 2 % of distance and 1° per metre, as a constant and as a random walk, once for each of so many seeds. With `--carry` the
//! robot was carried: what it recorded between two shares of a log's time, as `0.3,0.5`, is cut out. `--links` compares the errors
//! of the links from place to place with the deviations that they claim. With `--growth` it says what each place has cost whenever
//! there are half as many again.
#![expect(clippy::print_stdout, reason = "an example says what it found")]

mod growth;
mod links;

use std::fs::File;
use std::io::BufReader;
use std::ops::Range;
use std::time::Instant;

use links::LinkErrors;

use hierarchy::evaluate::{Alignment, Pairing, TimedPath, absolute_error};
use hierarchy::{Closure, Config, Mapper};
use nalgebra::{Isometry2, UnitComplex, Vector2};
use robot_log::{CarmenOptions, Clock, Entry, EntryKind, Input, ReadOptions, RobotDescription, open_log};
use simulator::{Drift, OdometryModel, carried};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let (mut robot, mut seeds, mut logs) = (None, None, Vec::new());
    let (mut clock, mut gone, mut with_links, mut growth) = (Clock::Message, None, false, false);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--robot" => robot = arguments.next(),
            "--drift" => seeds = arguments.next().map(|seeds| seeds.parse::<u64>()).transpose()?,
            "--carry" => {
                gone = arguments.next().as_deref().and_then(|gone| gone.split_once(',')).map(shares).transpose()?
            }
            "--links" => with_links = true,
            "--growth" => growth = true,
            "--stampless" => clock = Clock::Counted { period: 1.0 },
            _ => logs.push(argument),
        }
    }
    println!("{:<28} seed  scans places   raw ATE  mapped ATE  closures  false  CPU", "log");
    for log in &logs {
        let entries = read(log, robot.as_deref(), clock)?;
        let name = log.rsplit('/').next().unwrap_or(log);
        for seed in seeds.map_or(0..1, |seeds| 1..seeds + 1) {
            let entries = if seeds.is_some() { spoilt(&entries, seed) } else { entries.clone() };
            let entries = match &gone {
                Some(shares) => carried(entries.iter().cloned(), stamps(&entries, shares)),
                None => entries,
            };
            let scores = Scores::of(&entries, growth)?;
            let Scores { scans, places, raw, mapped, closures, wrong, seconds, carried, links } = scores;
            println!(
                "{name:<28} {seed:>4} {scans:>6} {places:>6} {raw:>8.2} m {mapped:>9.3} m {closures:>9} {wrong:>6} {seconds:>5.2} s{carried}"
            );
            if with_links {
                print!("{links}");
            }
        }
    }
    Ok(())
}

fn shares((from, to): (&str, &str)) -> Result<Range<f64>, std::num::ParseFloatError> {
    Ok(from.parse()?..to.parse()?)
}

/// The stamps at two shares of a log's time.
fn stamps(entries: &[Entry], shares: &Range<f64>) -> Range<f64> {
    let [begin, end] = [entries.first(), entries.last()].map(|entry| entry.map_or(0.0, |entry| entry.stamp));
    begin + shares.start * (end - begin)..begin + shares.end * (end - begin)
}

fn read(log: &str, robot: Option<&str>, clock: Clock) -> Result<Vec<Entry>, Failure> {
    let robot = robot.map(|name| RobotDescription::builtin(name).ok_or("no such robot")).transpose()?;
    let inputs = vec![Input::new(log, BufReader::new(File::open(log)?))];
    let read = open_log(
        inputs,
        &ReadOptions { robot, carmen: CarmenOptions { clock, lenient: true, ..CarmenOptions::default() } },
    )?;
    Ok(read.collect::<Result<_, _>>()?)
}

fn spoilt(entries: &[Entry], seed: u64) -> Vec<Entry> {
    let mut drift = Drift::new(OdometryModel::of_shares(0.02, 1f64.to_radians()), seed);
    entries
        .iter()
        .cloned()
        .flat_map(|entry| {
            <[Option<Entry>; 2]>::from({
                let (a, b) = drift.spoil(entry);
                (Some(a), b)
            })
        })
        .flatten()
        .collect()
}

/// What one run comes to.
struct Scores {
    scans: usize,
    places: usize,
    raw: f64,
    mapped: f64,
    closures: usize,
    wrong: usize,
    seconds: f64,
    /// Which links the robot was found to have been carried over, and how many pieces are left.
    carried: String,
    links: LinkErrors,
}

impl Scores {
    fn of(entries: &[Entry], growth: bool) -> Result<Self, Failure> {
        let start = Instant::now();
        let mut mark = growth::Mark::begin();
        let mut mapper = Mapper::new(Config::default())?;
        let mut truth = Vec::new();
        for entry in entries {
            if let EntryKind::Truth { map_from_robot } = entry.kind {
                truth.push((entry.stamp, map_from_robot));
            }
            mapper.push(entry)?;
            if growth {
                mark.pass(&mapper);
            }
        }
        mapper.finish()?;
        let seconds = start.elapsed().as_secs_f64();
        let samples = mapper.trajectory().samples();
        let stamped = |poses: Vec<Isometry2<f64>>| TimedPath::new(samples.iter().map(|s| s.stamp).zip(poses));
        let truth = TimedPath::new(truth);
        let error = |path: &TimedPath| {
            absolute_error(path, &truth, Alignment::Rigid, Pairing::default())
                .map_or(f64::NAN, |error| error.translation_m.rmse)
        };
        let raw = error(&stamped(samples.iter().map(|sample| sample.odom_from_robot).collect()));
        let mapped = error(&stamped(mapper.poses()));
        let wrong = wrong_closures(&mapper, &truth);
        let accepted = mapper.closures().iter().filter(|closure| closure.is_accepted());
        Ok(Self {
            scans: samples.len(),
            places: mapper.topology().n_visited(),
            raw,
            mapped,
            closures: accepted.count(),
            wrong,
            seconds,
            carried: carryings(&mapper),
            links: LinkErrors::of(&mapper, &truth),
        })
    }
}

/// Between which places the robot was found to have been carried, and in how many pieces the map is.
fn carryings(mapper: &Mapper) -> String {
    let carried = mapper.topology().links().iter().filter(|link| link.is_carried());
    let told: String = carried.map(|link| format!("  carried: {} → {}", link.from, link.to)).collect();
    let pieces = mapper.topology().components().len();
    if pieces > 1 { format!("{told}, {pieces} pieces") } else { told }
}

/// Accepted closures that the truth contradicts by more than their covariance admits (99.9 %), and by more than 0.5 m or
/// 10°.
fn wrong_closures(mapper: &Mapper, truth: &TimedPath) -> usize {
    let at = |place| {
        let anchor = mapper.trajectory().anchors().iter().find(|anchor| anchor.place == place)?;
        Some(truth.at(anchor.stamp)? * anchor.place_from_robot.inverse())
    };
    let accepted = mapper.closures().iter().filter(|closure| closure.is_accepted());
    let wrong = |closure: &&Closure| {
        let Closure { place, known, displacement: measured, score, verdict, .. } = closure;
        let (Some(from), Some(to)) = (at(*place), at(*known)) else { return false };
        let seen = from.inv_mul(&to);
        let off = seen.translation.vector - measured.vector;
        let information = measured.covariance.try_inverse();
        let chi2_of = |off: Vector2<f64>| information.map_or(f64::INFINITY, |i| (off.transpose() * i * off)[0]);
        let chi2 = chi2_of(off);
        let turned = measured.turn.map_or(0.0, |turn| seen.rotation.angle_to(&UnitComplex::new(turn.change)).abs());
        let askew = measured.turn.is_some_and(|turn| turned > 10f64.to_radians().max(3.3 * turn.variance.sqrt()));
        let wrong = askew || off.norm() > 0.5 && chi2 > 13.8;
        if wrong {
            let (off, turned) = (off.norm(), turned.to_degrees());
            let mapped = |place| mapper.coordinates().map_from_place(place);
            let in_map = mapped(*place).inv_mul(&mapped(*known)).translation.vector - measured.vector;
            println!(
                "  {place} is not {known}: {off:.2} m and {turned:.0}° off, χ² {chi2:.1}, {:.1} in the map, score {score:.2}, {verdict}",
                chi2_of(in_map)
            );
        }
        wrong
    };
    accepted.filter(wrong).count()
}

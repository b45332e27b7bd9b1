//! Tells how well signatures tell places apart: aligns all pairs of places of a laser log, near ones and far ones.
//!
//! ```text
//! cargo run --release -p local-grid --example recognition -- LOG [TURN_WINDOW_DEGREES]
//! ```
//!
//! Scan matching carries the robot; a place is taken every metre and its signature cut from the working grid. Pairs less
//! than 0.7 m apart, seen at least 10 m of path apart, should match; pairs more than 3 m apart should not.
#![expect(clippy::print_stdout, reason = "an example says what it found")]

#[path = "../laser_odometry/io.rs"]
#[expect(dead_code, reason = "shared with the other example")]
mod io;

use std::error::Error;

use local_grid::nalgebra::{Isometry2, Point2};
use local_grid::{
    AlignOptions, Alignment, Fuzzy, LaserRay, LocalMap, LocalMapOptions, Prior, Signature, SignatureOptions,
    TrackOptions, WorkingGrid, WorkingGridOptions, align, echoes, track,
};

/// A place, where it truly is, and how the robot saw it.
struct Place {
    at: Point2<f64>,
    path: f64,
    heading_error: f64,
    signature: Signature,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let log = io::read_log(arguments.first().ok_or("which log?")?)?;
    let window = arguments.get(1).map_or(Ok(0.0), |degrees| degrees.parse::<f64>())?;
    // With turns searched, every second place is seen with a heading that is 7° off.
    let off = if window > 0.0 { 7f64.to_radians() } else { 0.0 };
    let places = places(&log, off)?;
    let options = AlignOptions { turn_window: window.to_radians(), reach: 1.0, ..AlignOptions::default() };
    let (mut near, mut far) = (Vec::new(), Vec::new());
    let start = std::time::Instant::now();
    for (k, a) in places.iter().enumerate() {
        for (j, b) in places[..k].iter().enumerate() {
            let truth = Isometry2::rotation(a.heading_error) * (b.at - a.at);
            let turn = a.heading_error - b.heading_error;
            if truth.norm() < 0.7 && (a.path - b.path).abs() > 10.0 {
                near.push((align(&a.signature, &b.signature, &options), truth, turn));
            } else if truth.norm() > 3.0 && (k * 7919 + j) % 29 == 0 {
                far.push((align(&a.signature, &b.signature, &options), truth, turn));
            }
        }
    }
    let micros = 1e6 * start.elapsed().as_secs_f64() / (near.len() + far.len()) as f64;
    println!("{} places, {} near pairs, {} far pairs, {micros:.0} µs each", places.len(), near.len(), far.len());
    let convincing = || near.iter().filter(|(found, ..)| found.is_convincing());
    quantiles("offset in metres", convincing().map(|(found, truth, _)| (found.offset - truth).norm()).collect());
    quantiles("turn in degrees", convincing().map(|(found, _, turn)| (found.turn - turn).to_degrees().abs()).collect());
    let rate = |pairs: &[(Alignment, _, f64)], accept: &dyn Fn(&Alignment) -> bool| {
        let hits = pairs.iter().filter(|(found, ..)| accept(found)).count();
        format!("{hits} of {} ({:.2} %)", pairs.len(), 100.0 * hits as f64 / pairs.len().max(1) as f64)
    };
    println!("convincing: near {}, far {}", rate(&near, &|a| a.is_convincing()), rate(&far, &|a| a.is_convincing()));
    for least in [0.5, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9] {
        for most in [0.03, 0.06, 0.1, 0.2] {
            let accept = |found: &Alignment| found.score >= least && found.contradiction <= most && found.overlap > 0.5;
            println!(
                "score {least:.2} contradiction {most:.2}: near {}, far {}",
                rate(&near, &accept),
                rate(&far, &accept)
            );
        }
    }
    Ok(())
}

fn quantiles(what: &str, mut errors: Vec<f64>) {
    errors.sort_by(f64::total_cmp);
    if let (Some(median), Some(most)) = (errors.get(errors.len() / 2), errors.get(errors.len() * 19 / 20)) {
        println!("error of convincing near pairs, {what}: median {median:.3}, 95 % below {most:.3}");
    }
}

/// A place every metre.
fn places(log: &[io::Log], off: f64) -> Result<Vec<Place>, Box<dyn Error>> {
    let mut map = LocalMap::new(LocalMapOptions::default())?;
    let window = WorkingGrid::<Fuzzy>::new(&WorkingGridOptions::default(), Point2::origin())?;
    let mut windows = [(0.0, window.clone()), (off, window)];
    let mut places: Vec<Place> = Vec::new();
    let (mut path, mut last): (f64, Option<Isometry2<f64>>) = (0.0, None);
    for (k, entry) in log.iter().enumerate() {
        let pose = last.map_or(entry.odom_from_robot, |before| {
            let step = log[k - 1].odom_from_robot.inv_mul(&entry.odom_from_robot);
            track(&map, &echoes(&entry.scan, 30.0), &Prior::start(before * step), &TrackOptions::default())
                .map_from_robot
        });
        map.insert(&pose, &entry.scan)?;
        for (off, window) in &mut windows {
            window.integrate(&LaserRay::default(), &(Isometry2::rotation(*off) * pose), &entry.scan)?;
        }
        path += last.map_or(0.0, |before| (pose.translation.vector - before.translation.vector).norm());
        last = Some(pose);
        if places.last().is_none_or(|place| path - place.path >= 1.0) {
            let at = Point2::from(pose.translation.vector);
            let (heading_error, window) = &windows[places.len() % 2];
            let signature = window.signature(Isometry2::rotation(*heading_error) * at, &SignatureOptions::default());
            places.push(Place { at, path, heading_error: *heading_error, signature });
        }
    }
    Ok(places)
}

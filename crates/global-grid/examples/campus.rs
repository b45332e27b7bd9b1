//! A campus of 10 km², of which a robot drove the streets: what the map takes, where a dense grid would take its box.
//!
//! ```text
//! campus
//! ```
//!
//! Nine streets each way, 400 m apart and 24 m wide; a laser looks around every 5 m; cells of 0.05 m.

#![expect(clippy::print_stdout, reason = "a program says what it made")]

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;
use std::time::Instant;

use global_grid::local_grid::nalgebra::{Isometry2, Point2, Vector2};
use global_grid::local_grid::{RangeSensor, Scan};
use global_grid::{GridMap, GridOptions};

/// Metres from the first street to the last.
const SIDE: f64 = 3200.0;
/// Half the width of a street in metres.
const HALF_STREET: f64 = 12.0;

fn main() -> Result<(), Box<dyn Error>> {
    let step = 0.5f64.to_radians();
    let fan =
        Arc::new(RangeSensor::fan("laser", Isometry2::identity(), -179.75f64.to_radians(), step, 720, 0.05..=50.0)?);
    let house = |beam: u32| HALF_STREET / (f64::from(beam) * step - 3.137).sin().abs();
    let ranges = (0..720).map(|beam| if house(beam) < 50.0 { house(beam) } else { f64::INFINITY });
    let scan = Scan::from_ranges(fan, ranges)?;
    let start = Instant::now();
    let mut map = GridMap::new(GridOptions { resolution: 0.05, ..GridOptions::default() })?;
    for street in 0..9u32 {
        for stop in 0..640u32 {
            let (across, along) = (400.0 * f64::from(street), 5.0 * f64::from(stop));
            let key = u64::from(street) * 640 + u64::from(stop);
            map.insert(2 * key, &Isometry2::translation(along, across), &scan)?;
            map.insert(2 * key + 1, &Isometry2::new(Vector2::new(across, along), FRAC_PI_2), &scan)?;
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    let mut known = 0u64;
    for strip in -1..33 {
        let (low, high) = (100.0 * f64::from(strip), 100.0 * f64::from(strip + 1));
        let corners = (Point2::new(-60.0, low), Point2::new(SIDE + 60.0, high));
        map.read_within(corners, |tally| known += u64::from(!tally.is_unknown()))?;
    }
    let bytes = map.cell_bytes();
    println!("{} scans in {seconds:.2} s, {known} known cells", 2 * 9 * 640);
    println!(
        "{:.1} MiB, {:.3} bytes per known cell; its box at a byte per cell: {:.0} MiB",
        mib(bytes as f64),
        bytes as f64 / known as f64,
        mib((SIDE / 0.05).powi(2))
    );
    Ok(())
}

fn mib(bytes: f64) -> f64 {
    bytes / f64::from(1 << 20)
}

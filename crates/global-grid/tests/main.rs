//! The gridmap as its users meet it: against slow and exact references, against a second reader, after any history.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up must fail")]

mod against_reference;
mod history;
mod office;
mod second_reader;

use std::sync::Arc;

use global_grid::local_grid::nalgebra::{Isometry2, Vector2};
use global_grid::local_grid::{RangeSensor, Scan, SensorKind};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Dice that always fall the same way.
fn dice(seed: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed)
}

/// A laser of `beams` beams over half a circle, mounted ahead of the robot's centre.
fn laser(beams: usize, clockwise: bool) -> Arc<RangeSensor> {
    let step = std::f64::consts::PI / f64::from(u32::try_from(beams).unwrap() - 1);
    let half = std::f64::consts::FRAC_PI_2;
    let (first, step) = if clockwise { (half, -step) } else { (-half, step) };
    let mount = Isometry2::new(Vector2::new(0.2, 0.01), 0.0);
    Arc::new(RangeSensor::fan("laser", mount, first, step, beams, 0.05..=20.0).unwrap())
}

/// A ring of 16 sonars.
fn sonars() -> Arc<RangeSensor> {
    let width = 25f64.to_radians();
    Arc::new(RangeSensor::ring("sonar", SensorKind::Sonar, 16, 0.225, width, 0.15..=6.0).unwrap())
}

/// A scan with ranges that wander from beam to beam, some silent, some invalid.
fn scan(sensor: &Arc<RangeSensor>, random: &mut impl Rng) -> Scan {
    let mut range: f64 = random.random_range(0.5..6.0);
    let ranges: Vec<f64> = (0..sensor.mounts().len())
        .map(|_| {
            range = (range + random.random_range(-0.3..0.3)).clamp(0.3, 7.9);
            match random.random_range(0..40) {
                0 => f64::INFINITY,
                1 => f64::NAN,
                2 => random.random_range(0.3..8.0),
                _ => range,
            }
        })
        .collect();
    Scan::from_ranges(sensor.clone(), ranges).unwrap()
}

/// A pose within a few metres of the origin, also at negative coordinates.
fn pose(random: &mut impl Rng) -> Isometry2<f64> {
    let at = Vector2::new(random.random_range(-9.0..9.0), random.random_range(-9.0..9.0));
    Isometry2::new(at, random.random_range(-4.0..4.0))
}

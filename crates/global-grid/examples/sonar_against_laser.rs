//! Scores sonar maps against the laser map of the same run, both at the poses of the odometry.
//!
//! ```text
//! sonar_against_laser RUN_PREFIX OUT
//! ```
//!
//! Reads `RUN_PREFIX_od.txt`, `RUN_PREFIX_sonar.txt` and `RUN_PREFIX_laser.txt` of a robot with eight sonars and a laser:
//! one row per instant, stamps in ms first, lengths in mm, headings in tenths of a degree. Prints one line per sonar model
//! and calculus, and writes `OUT_laser.png` and `OUT_MODEL_CALCULUS.png`.

#![expect(clippy::print_stdout, reason = "a program says what it found")]

use std::error::Error;
use std::fs::File;
use std::sync::Arc;

use global_grid::local_grid::nalgebra::{Isometry2, Vector2};
use global_grid::local_grid::{RangeSensor, Scan, SensorKind, SonarCone, SonarRegions};
use global_grid::{
    Calculus, CrispOptions, GridOptions, SharedEcho, SonarModel, assemble, occupancy, score, write_picture,
};

/// Bearings of the sonars in degrees, and how far from the robot's centre each sits, in metres.
const SONARS: [(f64, f64); 8] =
    [(-90.0, 0.19), (-37.5, 0.03), (-22.5, 0.03), (-7.5, 0.03), (7.5, 0.03), (22.5, 0.03), (37.5, 0.03), (90.0, 0.19)];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [prefix, out] = arguments.as_slice() else { return Err("usage: sonar_against_laser RUN_PREFIX OUT".into()) };
    let poses: Vec<_> = rows(&format!("{prefix}_od.txt"))?
        .iter()
        .map(|row| Isometry2::new(Vector2::new(row[1], row[2]) * 1e-3, (0.1 * row[3]).to_radians()))
        .collect();
    let laser =
        RangeSensor::fan("laser", Isometry2::identity(), -90f64.to_radians(), 0.5f64.to_radians(), 361, 0.05..=30.0)?;
    let lasers = scans(&format!("{prefix}_laser.txt"), laser)?;
    let mounts =
        SONARS.map(|(bearing, radius)| Isometry2::rotation(bearing.to_radians()) * Isometry2::translation(radius, 0.0));
    let sonar = RangeSensor::new("sonar", SensorKind::Sonar, mounts.to_vec(), 20f64.to_radians(), 0.17..=5.0)?;
    let sonars = scans(&format!("{prefix}_sonar.txt"), sonar)?;
    let truth = assemble(poses.iter().zip(&lasers), &GridOptions::default())?.to_grid()?;
    write_picture(&truth, File::create(format!("{out}_laser.png"))?)?;
    let reference = occupancy(&truth, &CrispOptions::default());
    let models = [
        ("shared", SonarModel::Shared(SharedEcho::default())),
        ("oriolo", SonarModel::Cone(SonarCone { half_width: 10f64.to_radians(), ..SonarCone::default() })),
        ("regions", SonarModel::Regions(SonarRegions { half_width: 10f64.to_radians(), ..SonarRegions::default() })),
    ];
    println!("| model | calculus | wall precision | wall recall | wall F1 | free IoU | AUC | Brier | unknown |");
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|");
    for (name, model) in models {
        for calculus in [Calculus::Fuzzy, Calculus::Bayes, Calculus::DempsterShafer] {
            let options = GridOptions { calculus, sonar: model.clone(), ..GridOptions::default() };
            let map = assemble(poses.iter().zip(&sonars), &options)?;
            let probability = map.read(|tally| map.options().probability(tally))?;
            let s = score(|point| *probability.at(point).unwrap_or(&0.5), &reference, 0.15);
            println!(
                "| {name} | {calculus:?} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} |",
                s.wall_precision, s.wall_recall, s.wall_f1, s.free_iou, s.auc, s.brier, s.unknown
            );
            write_picture(&map.to_grid()?, File::create(format!("{out}_{name}_{calculus:?}.png"))?)?;
        }
    }
    Ok(())
}

fn rows(path: &str) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let row = |line: &str| line.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>();
    Ok(text.lines().map(row).collect::<Result<_, _>>()?)
}

fn scans(path: &str, sensor: RangeSensor) -> Result<Vec<Scan>, Box<dyn Error>> {
    let sensor = Arc::new(sensor);
    let scan = |row: &Vec<f64>| Scan::from_ranges(sensor.clone(), row[1..].iter().map(|range| range * 1e-3));
    Ok(rows(path)?.iter().map(scan).collect::<Result<_, _>>()?)
}

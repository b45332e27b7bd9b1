//! Scores laser maps of the three calculi, each built from every other scan, against the map of the scans between.
//!
//! ```text
//! calculi_on_laser FILE…
//! ```
//!
//! A `FILE` holds one scan per line: `x y heading range…`, metres and radians, a half circle of beams up to 50 m.

#![expect(clippy::print_stdout, reason = "a program says what it found")]

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use global_grid::local_grid::nalgebra::{Isometry2, Vector2};
use global_grid::local_grid::{RangeSensor, Scan};
use global_grid::{Calculus, CrispOptions, GridOptions, assemble, occupancy, score};

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "| log | calculus | map score / cells | correlation | wall precision | wall recall | wall F1 | free IoU | AUC | Brier |"
    );
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    for file in std::env::args().skip(1) {
        let scans = read(&std::fs::read_to_string(&file)?)?;
        let half = |which: usize| scans.iter().skip(which).step_by(2).map(|(pose, scan)| (pose, scan));
        let options = GridOptions { resolution: 0.05, ..GridOptions::default() };
        let reference = occupancy(&assemble(half(1), &options)?.to_grid()?, &CrispOptions::default());
        let name = Path::new(&file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for calculus in [Calculus::Fuzzy, Calculus::Bayes, Calculus::DempsterShafer] {
            let map = assemble(half(0), &GridOptions { calculus, ..options.clone() })?;
            let probability = map.read(|tally| map.options().probability(tally))?;
            let s = score(|point| *probability.at(point).unwrap_or(&0.5), &reference, 0.05);
            #[expect(clippy::cast_precision_loss, reason = "a count of cells")]
            let per_cell = s.map_score / s.cells as f64;
            println!(
                "| {name} | {calculus:?} | {per_cell:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} |",
                s.correlation, s.wall_precision, s.wall_recall, s.wall_f1, s.free_iou, s.auc, s.brier
            );
        }
    }
    Ok(())
}

type PosedScans = Vec<(Isometry2<f64>, Scan)>;

fn read(text: &str) -> Result<PosedScans, Box<dyn Error>> {
    let mut sensor: Option<Arc<RangeSensor>> = None;
    let mut scans = Vec::new();
    for line in text.lines() {
        let numbers = line.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        let [x, y, heading, ranges @ ..] = numbers.as_slice() else { return Err("a line is too short".into()) };
        let shared = match sensor.take().filter(|sensor| sensor.mounts().len() == ranges.len()) {
            Some(sensor) => sensor,
            None => {
                let gaps = f64::from(u32::try_from(ranges.len() - ranges.len() % 2)?);
                Arc::new(RangeSensor::fan(
                    "laser",
                    Isometry2::identity(),
                    -PI / 2.0,
                    PI / gaps,
                    ranges.len(),
                    0.02..=50.0,
                )?)
            }
        };
        sensor = Some(shared.clone());
        let limit = shared.max_range();
        let ranges = ranges.iter().map(|&range| if range >= limit { f64::INFINITY } else { range });
        scans.push((Isometry2::new(Vector2::new(*x, *y), *heading), Scan::from_ranges(shared, ranges)?));
    }
    Ok(scans)
}

mod runs;

use std::fmt::Write as _;
use std::io;
use std::path::PathBuf;

use clap::Args;
use global_grid::{CrispOptions, GridMap, GridOptions, MapScore, Occupancy, count_cells, occupancy, score};
use local_grid::{FuzzyGrid, Grid, LaserRay, SensorKind};
use nalgebra::Isometry2;
use serde_json::{Value, json};

use crate::context::Context;
use crate::failure::Failure;
use crate::input::posed::{CalculusChoice, Posed, PosedArgs, SensorChoice, fuse, no_grid};
use crate::{files, finished::map_folder};

/// Runs against each other as a page to blink between them; or the three calculi on the same readings of a log
///
/// Runs: compare.html shows their maps upon each other, blinking, and what became of every cell from the first to each of
/// the others. Their coordinates must be the same, as those of one log mapped in different ways are.
///
/// A log, or one run: one picture and one table.
/// The readings, of which the poses must be known, are fused by fuzzy sets, by Bayes' rule and by Dempster's. One sensor model
/// makes the same statement to all three: what a reading says is matched through its pignistic probability. The reference
/// is a map, or the laser's map where the log holds laser and sonar and the sonar is judged.
///
/// Examples:
/// topogrid compare runs/office runs/office-2
/// topogrid compare office.log.gz --poses truth --sensor sonar -o compare.png
#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    #[command(flatten)]
    posed: PosedArgs,
    /// The map that is right: a run folder, or a map server's map.yaml
    #[arg(long, value_name = "RUN|MAP")]
    reference: Option<PathBuf>,
    /// Metres within which walls count as the same
    #[arg(long, value_name = "M", default_value_t = 0.15)]
    tolerance: f64,
    /// The page of runs [default: compare.html], or a picture of a log's maps side by side
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace the page or the picture where it exists
    #[arg(long)]
    force: bool,
}

/// A map by one calculus, and what is to be said of it.
struct Entrant {
    calculus: CalculusChoice,
    map: GridMap,
    grid: FuzzyGrid,
    /// Mean contradiction of known cells: `E · O`, or nats of conflict for Dempster-Shafer.
    conflict: f64,
    score: Option<MapScore>,
}

/// Builds, scores and draws the maps.
pub(crate) fn run(args: &CompareArgs, context: &Context) -> Result<(), Failure> {
    if runs::are_runs(&args.posed.sources) {
        return runs::compare(&args.posed.sources, args.out.as_deref(), args.force, context);
    }
    let posed = args.posed.read(context)?;
    let reference = reference(args, &posed)?;
    let entrants = CalculusChoice::ALL.map(|calculus| entrant(args, &posed, reference.as_ref(), calculus));
    let entrants: Vec<Entrant> = entrants.into_iter().collect::<Result<_, Failure>>()?;
    if let Some(out) = &args.out {
        let maps: Vec<_> = entrants.iter().map(|entrant| (entrant.calculus.name(), &entrant.grid)).collect();
        let draw = |file: &mut dyn io::Write| global_grid::write_side_by_side(&maps, file).map_err(io::Error::other);
        files::write(out, args.force, draw).map_err(|error| Failure::writing(out, &error))?;
    }
    if context.json {
        let calculi: Vec<Value> = entrants.iter().map(as_json).collect();
        return context.print_json(&json!({
            "schema": "topogrid/compare/1", "scans": posed.scans.len(), "reference": reference_name(args, reference.is_some()),
            "tolerance_m": args.tolerance, "calculi": calculi,
        }));
    }
    context.print(&table(&entrants, &reference_name(args, reference.is_some())))
}

/// The map that is right.
struct Reference {
    cells: Grid<Occupancy>,
    map_from_grid: Isometry2<f64>,
}

/// The map that is right, if there is one.
fn reference(args: &CompareArgs, posed: &Posed) -> Result<Option<Reference>, Failure> {
    let crisp = |grid: &FuzzyGrid| occupancy(grid, &CrispOptions::for_map(grid));
    if let Some(path) = &args.reference {
        let known = map_folder::read(path)?;
        return Ok(Some(Reference { cells: crisp(&known.grid), map_from_grid: known.map_from_grid }));
    }
    let lasers = posed.scans.iter().any(|(_, scan)| scan.sensor().kind() == SensorKind::Laser);
    if args.posed.sensor != SensorChoice::Sonar || !lasers {
        return Ok(None);
    }
    // As far as the laser sees, whatever the sonar is limited to.
    let options = GridOptions { laser: LaserRay::default(), ..posed.options(CalculusChoice::Fuzzy.calculus()) };
    let map = fuse(posed, SensorChoice::Laser, &options)?;
    let cells = crisp(&map.to_grid().map_err(|error| no_grid(&error))?);
    Ok(Some(Reference { cells, map_from_grid: Isometry2::identity() }))
}

fn reference_name(args: &CompareArgs, any: bool) -> String {
    match &args.reference {
        Some(path) => path.display().to_string(),
        None if any => "the laser's map of the same log".to_owned(),
        None => "none".to_owned(),
    }
}

fn entrant(
    args: &CompareArgs,
    posed: &Posed,
    reference: Option<&Reference>,
    calculus: CalculusChoice,
) -> Result<Entrant, Failure> {
    let map = fuse(posed, args.posed.sensor, &posed.options(calculus.calculus()))?;
    let rejected = |error: global_grid::GridError| no_grid(&error);
    let grid = map.to_grid().map_err(rejected)?;
    let probability = map.read(|tally| map.options().probability(tally)).map_err(rejected)?;
    let conflicts =
        map.read(|tally| (!tally.is_unknown()).then(|| conflict(calculus, &map, tally))).map_err(rejected)?;
    let known: Vec<f64> = conflicts.cells().iter().flatten().copied().collect();
    #[expect(clippy::cast_precision_loss, reason = "a count of cells")]
    let conflict = known.iter().sum::<f64>() / known.len().max(1) as f64;
    let score = reference.map(|Reference { cells, map_from_grid }| {
        score(|point| *probability.at(map_from_grid * point).unwrap_or(&0.5), cells, args.tolerance)
    });
    Ok(Entrant { calculus, map, grid, conflict, score })
}

/// How much a cell's readings contradict each other.
fn conflict(calculus: CalculusChoice, map: &GridMap, tally: global_grid::Tally) -> f64 {
    if calculus == CalculusChoice::DempsterShafer {
        return f64::from(tally.dempster_shafer().conflict);
    }
    let cell = map.options().degrees(tally);
    f64::from(cell.empty * cell.occupied)
}

fn as_json(entrant: &Entrant) -> Value {
    json!({
        "calculus": entrant.calculus.name(), "cells": count_cells(&entrant.grid, &CrispOptions::for_map(&entrant.grid)),
        "mean_conflict": entrant.conflict, "score": entrant.score, "cell_bytes": entrant.map.cell_bytes(),
    })
}

/// One figure of a score.
type Figure = fn(&MapScore) -> f64;

/// The table; writing to a string cannot fail.
fn table(entrants: &[Entrant], reference: &str) -> String {
    let mut text = format!("{:<22}", "");
    let mut row = |name: &str, value: &dyn Fn(&Entrant) -> String| {
        let _ = write!(text, "\n{name:<22}");
        for entrant in entrants {
            let _ = write!(text, "{:>17}", value(entrant));
        }
    };
    let crisp = |entrant: &Entrant| count_cells(&entrant.grid, &CrispOptions::for_map(&entrant.grid));
    row("calculus", &|entrant| entrant.calculus.name().to_owned());
    row("occupied cells", &|entrant| crisp(entrant).occupied.to_string());
    row("empty cells", &|entrant| crisp(entrant).empty.to_string());
    row("contradictory cells", &|entrant| crisp(entrant).contradictory.to_string());
    row("mean conflict", &|entrant| format!("{:.4}", entrant.conflict));
    let scores: [(&str, Figure); 11] = [
        ("wall precision", |score| score.wall_precision),
        ("wall recall", |score| score.wall_recall),
        ("wall F1", |score| score.wall_f1),
        ("walls to truth [m]", |score| score.mapped_to_true),
        ("truth to walls [m]", |score| score.true_to_mapped),
        ("free IoU", |score| score.free_iou),
        ("AUC", |score| score.auc),
        ("Brier", |score| score.brier),
        ("correlation", |score| score.correlation),
        ("map score", |score| score.map_score),
        ("unknown share", |score| score.unknown),
    ];
    if entrants.iter().any(|entrant| entrant.score.is_some()) {
        for (name, value) in scores {
            row(name, &|entrant| entrant.score.as_ref().map_or(String::new(), |score| format!("{:.4}", value(score))));
        }
    }
    let _ = write!(text, "\nreference: {reference}\n");
    text.trim_start().to_owned()
}

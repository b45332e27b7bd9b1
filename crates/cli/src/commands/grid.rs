use std::path::{Path, PathBuf};

use clap::Args;
use global_grid::map_server::Mode;
use global_grid::{CrispOptions, GridMap, count_cells};
use local_grid::FuzzyGrid;
use nalgebra::Point2;
use serde_json::json;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::finished::map_folder;
use crate::input::posed::{CalculusChoice, Posed, PosedArgs, fuse, no_grid};

/// The gridmap again: of a run, without mapping again, or of a log whose poses are known
///
/// Examples:
///   topogrid grid runs/office --resolution 0.05
///   topogrid grid office.log.gz --poses runs/office/trajectory.tum -o maps/office
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct GridArgs {
    #[command(flatten)]
    posed: PosedArgs,
    /// By which rule readings are joined
    #[arg(long, value_name = "RULE", default_value = "fuzzy")]
    calculus: CalculusChoice,
    /// Cut the map to a box: its west, south, east and north edges in metres
    #[arg(long, value_name = "W,S,E,N", value_parser = crop, allow_hyphen_values = true)]
    crop: Option<(Point2<f64>, Point2<f64>)>,
    /// What a map server is to make of the map; scale and raw keep degrees and are written beside map.yaml
    #[arg(long, value_name = "MODE", default_value = "trinary")]
    mode: ModeChoice,
    /// The folder for the map [default: RUN/grid; to be given with a log]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace a map that is there
    #[arg(long)]
    force: bool,
}

/// What a map server is to make of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ModeChoice {
    /// Occupied, free or unknown
    Trinary,
    /// Degrees between the thresholds, too: map_scale.yaml
    Scale,
    /// Whole percents of occupancy: map_raw.yaml
    Raw,
}

fn crop(text: &str) -> Result<(Point2<f64>, Point2<f64>), String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[west, south, east, north]) if west < east && south < north => {
            Ok((Point2::new(west, south), Point2::new(east, north)))
        }
        _ => Err("expected west,south,east,north in metres, west below east and south below north".to_owned()),
    }
}

impl GridArgs {
    /// The folder for the map.
    fn folder(&self) -> Result<PathBuf, Failure> {
        match (&self.out, self.posed.run()) {
            (Some(out), _) => Ok(out.clone()),
            (None, Some(run)) if run.is_dir() => Ok(run.join("grid")),
            (None, _) => {
                Err(Failure::new(Exit::Usage, "grid.out", "there is no folder for the map").help("give --out"))
            }
        }
    }
}

/// Builds and writes the map.
pub(crate) fn run(args: &GridArgs, context: &Context) -> Result<(), Failure> {
    let out = args.folder()?;
    if !args.force && out.join("map.yaml").exists() {
        let message = format!("could not write into {}: it holds another map", out.display());
        return Err(Failure::new(Exit::Usage, "grid.folder", message).help("choose another --out, or --force"));
    }
    let posed = args.posed.read(context)?;
    let stage = context.progress().stage("gridmap", 0);
    let map = fuse(&posed, args.posed.sensor, &posed.options(args.calculus.calculus()))?;
    let grid = match args.crop {
        Some(corners) => map.read_within(corners, |tally| map.options().degrees(tally)),
        None => map.to_grid(),
    };
    let grid = grid.map_err(|error| no_grid(&error))?;
    stage.finish(&format!("{} × {} cells", grid.frame().rows(), grid.frame().columns()));
    map_folder::write(&out, &grid, args.force)?;
    match args.mode {
        ModeChoice::Trinary => {}
        ModeChoice::Scale => map_folder::write_degrees(&out, &grid, Mode::Scale, args.force)?,
        ModeChoice::Raw => map_folder::write_degrees(&out, &grid, Mode::Raw, args.force)?,
    }
    tell(args, context, &out, (&posed, &map, &grid))
}

/// Says what was made.
fn tell(
    args: &GridArgs,
    context: &Context,
    out: &Path,
    (posed, map, grid): (&Posed, &GridMap, &FuzzyGrid),
) -> Result<(), Failure> {
    let counts = count_cells(grid, &CrispOptions::for_map(grid));
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    if context.json {
        return context.print_json(&json!({
            "schema": "topogrid/grid/1", "out": out.display().to_string(), "scans": posed.scans.len(),
            "left_out": posed.left_out, "calculus": args.calculus.name(), "rows": rows, "columns": columns,
            "resolution_m": map.options().resolution, "cells": counts, "cell_bytes": map.cell_bytes(),
        }));
    }
    let mut text = format!(
        "{} scans, {rows} × {columns} cells of {} m ({}): {} occupied, {} empty, {} contradictory, {} unexplored\n\
         {dir}/map.png    to look at\n{dir}/map.yaml   for a map server\n{dir}/layers/    degrees, 16 bits each\n",
        posed.scans.len(),
        map.options().resolution,
        args.calculus.name(),
        counts.occupied,
        counts.empty,
        counts.contradictory,
        counts.unexplored,
        dir = out.display(),
    );
    match args.mode {
        ModeChoice::Trinary => {}
        ModeChoice::Scale => text.push_str(&format!("{}/map_scale.yaml   degrees, too\n", out.display())),
        ModeChoice::Raw => text.push_str(&format!("{}/map_raw.yaml   percents\n", out.display())),
    }
    context.print(&text)
}

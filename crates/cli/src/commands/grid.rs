use std::path::PathBuf;

use clap::Args;
use global_grid::{CrispOptions, count_cells};
use serde_json::json;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::map_folder;
use crate::posed::{CalculusChoice, PosedArgs, fuse, no_grid};

/// A gridmap from a log whose poses are known: no mapping, no correction
///
/// Example: topogrid grid office.log.gz --poses runs/office/trajectory.tum -o maps/office
#[derive(Debug, Args)]
pub(crate) struct GridArgs {
    #[command(flatten)]
    posed: PosedArgs,
    /// By which rule readings are joined
    #[arg(long, value_name = "RULE", default_value = "fuzzy")]
    calculus: CalculusChoice,
    /// The folder for the map
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Replace a map that is there
    #[arg(long)]
    force: bool,
}

/// Builds and writes the map.
pub(crate) fn run(args: &GridArgs, context: &Context) -> Result<(), Failure> {
    if !args.force && args.out.join("map.yaml").exists() {
        let message = format!("could not write into {}: it holds another map", args.out.display());
        return Err(Failure::new(Exit::Usage, "grid.folder", message).help("choose another --out, or --force"));
    }
    let posed = args.posed.read(context)?;
    let stage = context.progress().stage("gridmap", 0);
    let map = fuse(&posed, args.posed.sensor, &args.posed.options(args.calculus.calculus()))?;
    let grid = map.to_grid().map_err(|error| no_grid(&error))?;
    stage.finish(&format!("{} × {} cells", grid.frame().rows(), grid.frame().columns()));
    map_folder::write(&args.out, &grid, args.force)?;
    let counts = count_cells(&grid, &CrispOptions::default());
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    if context.json {
        return context.print_json(&json!({
            "schema": "topogrid/grid/1", "out": args.out.display().to_string(), "scans": posed.scans.len(),
            "left_out": posed.left_out, "calculus": args.calculus.name(), "rows": rows, "columns": columns,
            "resolution_m": args.posed.resolution, "cells": counts, "cell_bytes": map.cell_bytes(),
        }));
    }
    context.print(&format!(
        "{} scans, {rows} × {columns} cells of {} m ({}): {} occupied, {} empty, {} contradictory, {} unexplored\n\
         {dir}/map.png    to look at\n{dir}/map.yaml   for a map server\n{dir}/layers/    degrees, 16 bits each\n",
        posed.scans.len(),
        args.posed.resolution,
        args.calculus.name(),
        counts.occupied,
        counts.empty,
        counts.contradictory,
        counts.unexplored,
        dir = args.out.display(),
    ))
}

use std::path::{Path, PathBuf};

use global_grid::Change;
use hierarchy::Metrics;
use local_grid::FuzzyGrid;
use serde_json::{Value, json};

use crate::context::Context;
use crate::failure::Failure;
use crate::report::{Counts, Side, comparison};
use crate::{files, finished::map_folder};

/// A finished run to compare.
struct Run {
    name: String,
    gridmap: FuzzyGrid,
    metrics: Option<Metrics>,
}

/// Whether several folders are named: then they are runs to be held against each other, not the files of a log.
pub(super) fn are_runs(paths: &[PathBuf]) -> bool {
    paths.len() > 1 && paths.iter().all(|path| path.is_dir())
}

/// Draws the page that shows the runs' maps upon each other, and says what changed from the first to each of the others.
pub(super) fn compare(paths: &[PathBuf], out: Option<&Path>, force: bool, context: &Context) -> Result<(), Failure> {
    let runs: Vec<Run> = paths.iter().map(|path| Run::read(path)).collect::<Result<_, Failure>>()?;
    let sides: Vec<Side<'_>> = runs.iter().map(Run::side).collect();
    let (page, counts) = comparison(&sides)?;
    let out = out.unwrap_or(Path::new("compare.html"));
    files::write(out, force, |file| file.write_all(page.as_bytes())).map_err(|error| Failure::writing(out, &error))?;
    if context.json {
        let others: Vec<Value> = runs[1..]
            .iter()
            .zip(&counts)
            .map(|(run, counts)| json!({ "run": run.name, "cells": counted(counts) }))
            .collect();
        return context.print_json(&json!({
            "schema": "topogrid/compare-runs/1", "first": runs[0].name, "others": others, "out": out.display().to_string(),
        }));
    }
    let lines: String =
        runs[1..].iter().zip(&counts).map(|(run, counts)| line(&runs[0].name, &run.name, counts)).collect();
    context.print(&format!("{lines}{}\n", out.display()))
}

impl Run {
    fn side(&self) -> Side<'_> {
        Side { name: &self.name, gridmap: &self.gridmap, metrics: self.metrics.as_ref() }
    }

    fn read(path: &Path) -> Result<Self, Failure> {
        let gridmap = map_folder::read(path)?.grid;
        let metrics = std::fs::read(path.join("metrics.json")).ok();
        let name = path.canonicalize().ok().and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
        Ok(Self {
            name: name.unwrap_or_else(|| path.display().to_string()),
            gridmap,
            metrics: metrics.and_then(|bytes| serde_json::from_slice(&bytes).ok()),
        })
    }
}

fn counted(counts: &Counts) -> Value {
    counts.iter().map(|(change, count)| (format!("{change:?}").to_lowercase(), json!(count))).collect()
}

fn line(first: &str, other: &str, counts: &Counts) -> String {
    let of = |wanted: Change| counts.iter().find(|(change, _)| *change == wanted).map_or(0, |(_, count)| *count);
    format!(
        "{first} → {other}: {} cells free, then occupied; {} occupied, then free; {} found; {} lost; {} the same\n",
        of(Change::Appeared),
        of(Change::Vanished),
        of(Change::Found),
        of(Change::Lost),
        of(Change::Free) + of(Change::Occupied)
    )
}

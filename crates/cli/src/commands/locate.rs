mod summary;
mod track;

use std::path::PathBuf;

use clap::Args;
use hierarchy::{FinderError, Whereabouts};
use serde_json::json;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::input::{self, ReadingArgs, session};

/// Where the robot of a log is in a finished map, wherever it was switched on
///
/// The map stays as it is. What is printed fits on a screen: how much of the way was known, where the robot was when each
/// tenth of the way was driven, and where it is at the end. All places that it left are in `--out` and `--json`.
///
/// Examples:
///   topogrid locate runs/office tuesday.log
///   topogrid locate runs/office tuesday.log -o tuesday.csv
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct LocateArgs {
    /// The map: a run folder, or its session.hmap
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// What the robot sensed: CARMEN, CSV or libRSF text, plain or gzip; `-` reads standard input
    #[arg(value_name = "LOG", required = true)]
    logs: Vec<PathBuf>,
    /// Write every place that the robot left into this file, as CSV
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace the file where it exists
    #[arg(long, requires = "out")]
    force: bool,
    /// Print a line for every place that the robot leaves
    #[arg(long)]
    every: bool,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// Follows the log through the map and prints where the robot is.
pub(crate) fn run(args: &LocateArgs, context: &Context) -> Result<(), Failure> {
    if let Some(path) = args.out.as_ref().filter(|path| !args.force && path.exists()) {
        let message = format!("could not write {}: the file exists", path.display());
        return Err(Failure::new(Exit::Usage, "output.exists", message).help("use --force to replace it"));
    }
    let map = session::load(&args.run)?;
    let mut finder = map.finder().map_err(rejected)?;
    let mut seen: Vec<Whereabouts> = Vec::new();
    for entry in input::open(&args.logs, &args.reading)? {
        seen.extend(finder.push(&entry?).map_err(rejected)?);
    }
    seen.extend(finder.finish().map_err(rejected)?);
    if let Some(path) = &args.out {
        let written = files::write(path, args.force, |out| track::write(out, &seen));
        written.map_err(|error| Failure::writing(path, &error))?;
    }
    if context.json {
        let views: Vec<_> = seen.iter().map(track::document).collect();
        let summary = summary::document(&seen);
        return context.print_json(&json!({ "schema": "topogrid/locate/1", "summary": summary, "views": views }));
    }
    if args.every {
        context.print(&summary::lines(seen.iter()))?;
    }
    context.print(&summary::text(&seen, !args.every))
}

fn rejected(error: FinderError) -> Failure {
    Failure::new(Exit::Rejected, "locate", error.to_string())
}

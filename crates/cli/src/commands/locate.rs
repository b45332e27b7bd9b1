use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use hierarchy::topo_map::Recognition;
use hierarchy::{FinderError, Whereabouts};
use serde_json::{Value, json};

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::input::{self, ReadingArgs, session};

/// Where the robot of a log is in a finished map, wherever it was switched on
///
/// The map stays as it is. Each line tells of a place at which the robot became sure, or lost itself.
///
/// Example: topogrid locate runs/office tuesday.log
#[derive(Debug, Args)]
pub(crate) struct LocateArgs {
    /// The map: a run folder, or its session.hmap
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// What the robot sensed: CARMEN, CSV or libRSF text, plain or gzip; `-` reads standard input
    #[arg(value_name = "LOG", required = true)]
    logs: Vec<PathBuf>,
    /// Tell of every place that the robot leaves
    #[arg(long)]
    every: bool,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// Follows the log through the map and prints where the robot is.
pub(crate) fn run(args: &LocateArgs, context: &Context) -> Result<(), Failure> {
    let map = session::load(&args.run)?;
    let mut finder = map.finder().map_err(rejected)?;
    let mut seen: Vec<Whereabouts> = Vec::new();
    for entry in input::open(&args.logs, &args.reading)? {
        seen.extend(finder.push(&entry?).map_err(rejected)?);
    }
    seen.extend(finder.finish().map_err(rejected)?);
    if context.json {
        let views: Vec<Value> = seen.iter().map(document).collect();
        return context.print_json(&json!({ "schema": "topogrid/locate/1", "views": views }));
    }
    context.print(&text(&seen, args.every))
}

fn rejected(error: FinderError) -> Failure {
    Failure::new(Exit::Rejected, "locate", error.to_string())
}

fn document(seen: &Whereabouts) -> Value {
    let (state, best) = match seen.recognition {
        Recognition::Known(best) => ("known", Some(best)),
        Recognition::New { .. } => ("uncharted", None),
        Recognition::Unsure { best, .. } => ("unsure", best),
    };
    let pose = seen.map_from_robot.map(
        |pose| json!({ "x_m": pose.translation.x, "y_m": pose.translation.y, "heading_rad": pose.rotation.angle() }),
    );
    json!({
        "stamp_s": seen.stamp, "driven_m": seen.driven, "state": state, "pose": pose,
        "place": best.map(|best| best.place.0), "probability": best.map(|best| best.probability),
    })
}

/// What was found, a line for each change or for each view, and the sum of it. Writing to a string cannot fail.
fn text(seen: &[Whereabouts], every: bool) -> String {
    let mut text = String::new();
    let mut was_known = None;
    for view in seen {
        let is_known = view.map_from_robot.is_some();
        if every || was_known != Some(is_known) {
            let _ = writeln!(text, "{:>8.1} s {:>7.1} m  {}", view.stamp, view.driven, told(view));
        }
        was_known = Some(is_known);
    }
    let known = seen.iter().filter(|view| view.map_from_robot.is_some()).count();
    let first = seen.iter().find(|view| view.map_from_robot.is_some());
    let first = first.map_or_else(String::new, |view| format!(", the first after {:.1} m", view.driven));
    let _ = writeln!(text, "known at {known} of {} places{first}", seen.len());
    if let Some(last) = seen.last() {
        let _ = writeln!(text, "at the end: {}", told(last));
    }
    text
}

fn told(view: &Whereabouts) -> String {
    match (view.recognition, view.map_from_robot) {
        (Recognition::Known(best), Some(pose)) => format!(
            "{} at {:.2}, {:.2} m, facing {:.0}° (probability {:.2})",
            best.place,
            pose.translation.x,
            pose.translation.y,
            pose.rotation.angle().to_degrees(),
            best.probability
        ),
        (Recognition::New { probability }, _) => format!("outside of the map (probability {probability:.2})"),
        (Recognition::Unsure { reason, .. }, _) => format!("unsure: {reason}"),
        (Recognition::Known(best), None) => best.place.to_string(),
    }
}

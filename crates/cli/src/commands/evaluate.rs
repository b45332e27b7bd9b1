use std::path::PathBuf;

use clap::Args;
use hierarchy::evaluate::{Alignment, seen_again};
use serde::Serialize;

use crate::context::Context;
use crate::failure::Failure;
use crate::gate::{self, Gate};
use crate::input::ReadingArgs;

mod judge;
mod subject;
mod table;

use judge::{Judge, RecognitionScores, Scores};
use subject::Subject;

/// How good a run is: against the truth, with the names and values that evo prints, or without one
///
/// Examples:
///   topogrid evaluate runs/office --truth office.log
///   topogrid evaluate runs/intel --relations intel.relations --json
///   topogrid evaluate runs/sonar --reference runs/laser
///   topogrid evaluate runs/office --truth true_map.yaml --fail-on 'map.free_iou<0.8'
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct EvaluateArgs {
    /// What is judged: a run folder, a trajectory (.tum), or a log (its odometry)
    #[arg(value_name = "RUN")]
    subject: PathBuf,
    /// What is true: a trajectory (.tum), a log (its true poses, else its odometry), another run folder (its trajectory),
    /// or a map (.yaml); may be given twice
    #[arg(long, visible_alias = "reference", value_name = "FILE|RUN")]
    truth: Vec<PathBuf>,
    /// True relations between stamps: `stamp stamp x y z roll pitch yaw` per line
    #[arg(long, value_name = "FILE")]
    relations: Option<PathBuf>,
    /// The raw odometry to show beside, a trajectory or a log [default: odometry.tum of the run folder]
    #[arg(long, value_name = "FILE")]
    odometry: Option<PathBuf>,
    /// Carry poses between those of the trajectory by the odometry, for trajectories of few poses
    #[arg(long)]
    carry: bool,
    /// How the path is laid onto the true one first
    #[arg(long, value_name = "HOW", default_value = "rigid")]
    align: AlignChoice,
    /// At which stamps: those of the nearest poses, as evo does, or interpolated ones; `auto` interpolates where fewer
    /// than nine of ten find a partner
    #[arg(long, value_name = "HOW", default_value = "auto")]
    pair: PairChoice,
    /// Stamps so many seconds apart are still the same
    #[arg(long, value_name = "S", default_value_t = 0.01)]
    apart: f64,
    /// Length of the stretches of the relative error, in metres of the true path
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    stretch: f64,
    /// Edge of the cells of floor for which it is asked whether the robot knows in which one it is, in metres
    #[arg(long, value_name = "M", default_value_t = 1.0, value_parser = crate::input::positive)]
    cell: f64,
    /// End with exit code 4 where this holds, such as 'rmse>0.3' or 'relations.far.translation_mean_m>0.1'; may be repeated
    #[arg(long, value_name = "EXPR")]
    fail_on: Vec<Gate>,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// How a path is laid onto the true one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum AlignChoice {
    Rigid,
    Origin,
    None,
}

impl From<AlignChoice> for Alignment {
    fn from(choice: AlignChoice) -> Self {
        match choice {
            AlignChoice::Rigid => Self::Rigid,
            AlignChoice::Origin => Self::Origin,
            AlignChoice::None => Self::None,
        }
    }
}

/// At which stamps paths are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum PairChoice {
    Auto,
    Nearest,
    Interpolate,
}

/// What is printed, as JSON or as a table.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    file: String,
    poses: usize,
    path_length_m: f64,
    #[serde(flatten)]
    estimate: Scores,
    odometry: Option<Scores>,
    recognition: Option<RecognitionScores>,
}

/// Judges the run and prints the scores.
pub(crate) fn run(args: &EvaluateArgs, context: &Context) -> Result<(), Failure> {
    let subject = Subject::read(&args.subject, args.odometry.as_deref(), &args.reading)?;
    let judge = Judge::read(args)?;
    let carrier = subject.odometry.as_ref().filter(|_| args.carry);
    let estimate = judge.scores(&subject.path, carrier, subject.map.as_ref());
    judge.check(&estimate)?;
    let raw_map = subject.odometry_map();
    let [entropy_bits, raw_entropy_bits] = subject.entropies();
    let again = subject.run.as_ref().and_then(seen_again);
    let raw = |path| Scores {
        entropy_bits: raw_entropy_bits,
        seen_again_m: again.map(|again| again.odometry_m),
        ..judge.scores(path, None, raw_map.as_ref())
    };
    let report = Report {
        schema: "topogrid/evaluate/1",
        file: args.subject.display().to_string(),
        poses: subject.path.len(),
        path_length_m: subject.path.length(),
        odometry: subject.odometry.as_ref().map(raw),
        recognition: subject.run.as_ref().and_then(|run| judge.recognition(run)),
        estimate: Scores { entropy_bits, seen_again_m: again.map(|again| again.mapped_m), ..estimate },
    };
    if context.json {
        context.print_json(&report)?;
    } else {
        context.print(&table::render(&report))?;
    }
    gate::check(&args.fail_on, &report)
}

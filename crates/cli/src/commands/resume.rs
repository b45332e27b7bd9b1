use std::path::{Path, PathBuf};

use clap::{Args, Parser};

use crate::command_line::Cli;
use crate::commands::run::{Job, OutputArgs, go_on};
use crate::commands::{Command, demo};
use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::gate;
use crate::input::{self, ReadingArgs};
use crate::run_folder::RunFolder;
use crate::run_folder::run_record::RunRecord;
use crate::{finished::summary, input::edits, input::session};

/// Go on with an interrupted run, or extend a finished one with more log
///
/// Examples:
///   topogrid resume runs/office
///   topogrid resume runs/office afternoon.log.gz -o runs/office-all
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ResumeArgs {
    /// The run to go on with: its folder, or its session.hmap
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// More log [default: the rest of the log that the run was interrupted in]
    #[arg(value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Reads the session and feeds it more log.
pub(crate) fn run(args: &ResumeArgs, context: &Context) -> Result<(), Failure> {
    if !args.output.is_default() {
        let message = "a run goes on with the configuration that it began with";
        return Err(Failure::new(Exit::Usage, "resume.config", message).help("its config.toml says which"));
    }
    let mapper = session::recorded(&args.run)?;
    let name = session::name(&args.run);
    let entries = mapper.tally().entries;
    if args.logs.is_empty() {
        return rest(args, &name, context, |job, folder| go_on(job, mapper, folder, entries, context));
    }
    let interrupted = RunRecord::read(&args.run).is_ok_and(|record| !record.complete);
    let open = || input::open(&args.logs, &args.reading);
    let job = Job { name: name.clone(), inputs: &args.logs, open: &open, args: &args.output };
    let folder = RunFolder::choose(args.output.out.as_deref(), &name, args.output.force)?;
    edits::copy(&args.run, folder.path())?;
    // The log of an interrupted run, named again, goes on where it was left.
    let metrics = go_on(&job, mapper, &folder, if interrupted { entries } else { 0 }, context)?;
    tell(&job, &folder, &metrics, context)
}

/// Goes on in the folder of an interrupted run, with the log that its record names.
fn rest(
    args: &ResumeArgs,
    name: &str,
    context: &Context,
    work: impl FnOnce(&Job, &RunFolder) -> Result<hierarchy::Metrics, Failure>,
) -> Result<(), Failure> {
    let record = RunRecord::read(&args.run)?;
    if record.complete {
        let message = format!("{} is complete: its log was read to its end", args.run.display());
        return Err(Failure::new(Exit::Usage, "resume.complete", message).help("name more log to extend it with"));
    }
    let typed = std::iter::once("topogrid").chain(record.command.iter().map(String::as_str));
    let before = Cli::try_parse_from(typed).map_err(|_| lost(&args.run))?.command;
    let (logs, reading) = match &before {
        Command::Run(run) => (run.log.logs.clone(), &run.log.reading),
        Command::Resume(resume) if !resume.logs.is_empty() => (resume.logs.clone(), &resume.reading),
        Command::Demo(_) => (Vec::new(), &args.reading),
        _ => return Err(lost(&args.run)),
    };
    if logs.iter().any(|path| path.as_os_str() == "-") {
        let message = "the run was interrupted while it read standard input, which is gone";
        return Err(Failure::new(Exit::Usage, "resume.input", message).help("name the log: topogrid resume RUN LOG"));
    }
    let logs: Vec<PathBuf> = logs.iter().map(|path| record.folder.join(path)).collect();
    let open = || if logs.is_empty() { demo::open() } else { input::open(&logs, reading) };
    let output = match &before {
        Command::Run(run) => &run.output,
        Command::Demo(demo) => &demo.output,
        _ => &args.output,
    };
    let job = Job { name: name.to_owned(), inputs: &logs, open: &open, args: output };
    let folder = RunFolder::existing(&args.run);
    let metrics = work(&job, &folder)?;
    tell(&job, &folder, &metrics, context)
}

fn tell(job: &Job, folder: &RunFolder, metrics: &hierarchy::Metrics, context: &Context) -> Result<(), Failure> {
    if context.json {
        context.print_json(metrics)?;
    } else {
        context.sum_up(&summary::text(&job.name, folder, metrics, job.args.seed, None))?;
    }
    gate::check(&job.args.fail_on, metrics)
}

fn lost(run: &Path) -> Failure {
    let message = format!("the record of {} does not tell which log it was interrupted in", run.display());
    Failure::new(Exit::Rejected, "resume.record", message).help("name the log: topogrid resume RUN LOG")
}

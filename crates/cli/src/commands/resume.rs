use std::path::PathBuf;

use clap::Args;
use hierarchy::Mapper;

use crate::commands::run::{OutputArgs, go_on};
use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::input::LogArgs;
use crate::run_folder::RunFolder;

/// Go on with a finished or interrupted run: more log, the same map
///
/// Example: topogrid resume runs/office afternoon.log.gz -o runs/office-all
#[derive(Debug, Args)]
pub(crate) struct ResumeArgs {
    /// The run to go on with: its folder, or its session.hmap
    #[arg(value_name = "RUN")]
    run: PathBuf,
    #[command(flatten)]
    log: LogArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Reads the session and feeds it more log.
pub(crate) fn run(args: &ResumeArgs, context: &Context) -> Result<(), Failure> {
    if !args.output.is_default() {
        let message = "a run goes on with the configuration that it began with";
        return Err(Failure::new(Exit::Usage, "resume.config", message).help("its config.toml says which"));
    }
    let session = if args.run.is_dir() { args.run.join("session.hmap") } else { args.run.clone() };
    let rejected =
        |error| Failure::new(Exit::Rejected, "session", format!("could not read {}: {error}", session.display()));
    let mapper = Mapper::load(&mut files::open(&session)?).map_err(rejected)?;
    let name = args.run.file_stem().map_or_else(|| "run".to_owned(), |name| name.to_string_lossy().into_owned());
    let folder = RunFolder::choose(args.output.out.as_deref(), &name, args.output.force)?;
    go_on(&name, mapper, args.log.open()?, folder, context)
}

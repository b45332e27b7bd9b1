use clap::Args;

use crate::commands::run::{Job, OutputArgs, map_log};
use crate::context::Context;
use crate::failure::Failure;
use crate::input::Log;

/// The bundled experiment, no input needed: a robot with sonars drives a loop through an office
///
/// Example: topogrid demo
#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// The log that the program carries with it; see fixtures/README.md for how it was made.
const LOG: &[u8] = include_bytes!("../../../../fixtures/logs/office_loop.log");

/// Maps the bundled log.
pub(crate) fn run(args: &DemoArgs, context: &Context) -> Result<(), Failure> {
    map_log(&Job { name: "demo".into(), inputs: &[], open: &open, args: &args.output }, context)
}

/// Opens the bundled log.
pub(crate) fn open() -> Result<Log, Failure> {
    Log::bundled("office_loop.log (bundled)", LOG)
}

use clap::Subcommand;

use crate::context::Context;
use crate::failure::Failure;

pub(crate) mod convert;
pub(crate) mod inspect;
pub(crate) mod run;

/// One command each: its arguments, declared in its own file.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Run(run::RunArgs),
    Inspect(inspect::InspectArgs),
    Convert(convert::ConvertArgs),
}

impl Command {
    /// Does what the command says.
    pub(crate) fn run(&self, context: &Context) -> Result<(), Failure> {
        match self {
            Self::Run(args) => run::run(args, context),
            Self::Inspect(args) => inspect::run(args, context),
            Self::Convert(args) => convert::run(args, context),
        }
    }
}

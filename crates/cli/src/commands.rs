use clap::Subcommand;

use crate::context::Context;
use crate::failure::Failure;

pub(crate) mod convert;
pub(crate) mod inspect;

/// One command each: its arguments, declared in its own file.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Inspect(inspect::InspectArgs),
    Convert(convert::ConvertArgs),
}

impl Command {
    /// Does what the command says.
    pub(crate) fn run(&self, context: &Context) -> Result<(), Failure> {
        match self {
            Self::Inspect(args) => inspect::run(args, context),
            Self::Convert(args) => convert::run(args, context),
        }
    }
}

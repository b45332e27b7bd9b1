use std::path::PathBuf;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::command_line::Cli;
use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;

/// Completions for a shell, on standard output
///
/// Example: topogrid completions bash > ~/.local/share/bash-completion/completions/topogrid
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// Manual pages, one for each command
///
/// Example: topogrid man ~/.local/share/man/man1
#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// The folder for the pages
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Prints the completions.
pub(crate) fn run(args: &CompletionsArgs, context: &Context) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "topogrid", &mut script);
    context.print(&String::from_utf8_lossy(&script))
}

/// Writes the manual pages.
pub(crate) fn man(args: &ManArgs, context: &Context) -> Result<(), Failure> {
    let failed = |error: std::io::Error| Failure::writing(&args.folder, &error);
    std::fs::create_dir_all(&args.folder).map_err(failed)?;
    clap_mangen::generate_to(Cli::command(), &args.folder).map_err(failed)?;
    let pages = std::fs::read_dir(&args.folder).map_err(failed)?.count();
    if pages == 0 {
        return Err(Failure::new(Exit::Failed, "man.empty", "no page was written"));
    }
    context.say(&format!("wrote {pages} pages into {}", args.folder.display()));
    Ok(())
}

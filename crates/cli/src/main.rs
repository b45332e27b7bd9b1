//! `topogrid`: from a robot's log to a topological map and a consistent gridmap, on the command line.

mod args;
mod commands;
mod context;
mod exit;
mod failure;
mod files;
mod input;
mod map_folder;
mod memory;
mod output;
mod posed;
mod progress;
mod render;
mod run_folder;
mod summary;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let cli = args::Cli::parse(); // wrong usage ends here with exit code 2
    let context = context::Context::new(&cli.global);
    match cli.command.run(&context) {
        Ok(()) => exit::Exit::Done.into(),
        Err(failure) => {
            context.show(&failure);
            failure.exit.into()
        }
    }
}

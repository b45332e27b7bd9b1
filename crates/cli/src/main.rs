//! `topogrid`: from a robot's log to a topological map and a consistent gridmap, on the command line.

mod args;
mod calendar;
mod commands;
mod context;
mod edits;
mod exit;
mod expedition;
mod export;
mod failure;
mod files;
mod finished;
mod gate;
mod hash;
mod input;
mod live;
mod loops_csv;
mod map_folder;
mod mapping;
mod memory;
mod nearest;
mod output;
mod overview;
mod place_name;
mod posed;
mod progress;
mod render;
mod report;
mod run_folder;
mod run_record;
mod session;
mod settings;
mod summary;
mod verify;

use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = match args::parse() {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    let context = context::Context::new(&cli.global);
    match cli.command.run(&context) {
        Ok(()) => exit::Exit::Done.into(),
        Err(failure) => {
            context.show(&failure);
            failure.exit.into()
        }
    }
}

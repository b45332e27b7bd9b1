//! `topogrid`: from a robot's log to a topological map and a consistent gridmap, on the command line.

mod args;
mod command_line;
mod commands;
mod context;
mod exit;
mod expedition;
mod export;
mod failure;
mod files;
mod finished;
mod gate;
mod input;
mod live;
mod mapping;
mod nearest;
mod render;
mod report;
mod run_folder;
mod settings;

use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = match command_line::parse() {
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

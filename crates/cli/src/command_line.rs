pub(crate) mod overview;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

use crate::args::Global;
use crate::commands::Command;
use crate::exit::Exit;
use crate::failure::Failure;

/// The command line.
#[derive(Debug, Parser)]
#[command(name = "topogrid", version, about, long_about = None, arg_required_else_help = true, max_term_width = 100)]
#[command(about = "From a robot's log to a topological map and a globally consistent gridmap")]
#[command(
    after_help = "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 input rejected, 4 a gate failed, 130 interrupted"
)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The command line as it was typed; wrong usage ends the program with exit code 2.
///
/// # Errors
///
/// Nothing was asked for but help: it is printed, and the program ends.
pub(crate) fn parse() -> Result<Cli, ExitCode> {
    let mut typed = std::env::args_os().skip(1);
    match (typed.next(), typed.next()) {
        (None, _) => {
            eprint!("{}", overview::text());
            Err(Exit::Usage.into())
        }
        (Some(only), None) if only == "-h" => {
            // A reader that has left is no failure.
            let _ = std::io::stdout().write_all(overview::text().as_bytes());
            Err(Exit::Done.into())
        }
        _ => Cli::try_parse().map_err(|error| refuse(&error)),
    }
}

/// Ends the program as clap would, but tells programs of wrong usage as JSON.
fn refuse(error: &clap::Error) -> ExitCode {
    let asked_for = std::env::args_os().any(|word| word == "--json");
    if !(asked_for && error.use_stderr()) {
        error.exit();
    }
    let message = error.render().to_string();
    let message = message.trim_start_matches("error: ").trim_end();
    let failure = Failure::new(Exit::Usage, "usage", message);
    if let Some(text) = failure.to_json() {
        eprintln!("{text}");
    }
    Exit::Usage.into()
}

pub(crate) mod progress;

use std::cell::RefCell;
use std::io::{self, IsTerminal, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;
use tracing_subscriber::EnvFilter;

use crate::args::{ColorChoice, Global, ProgressStyle};
use crate::context::progress::Progress;
use crate::exit::Exit;
use crate::failure::Failure;

/// How a command talks: results to standard output, everything else to standard error.
#[derive(Debug)]
pub(crate) struct Context {
    /// Whether results are one JSON document.
    pub(crate) json: bool,
    quiet: bool,
    color: bool,
    /// Whether results may be painted.
    paints: bool,
    progress: Progress,
    /// What the user was warned of, also where it was not shown.
    warnings: RefCell<Vec<String>>,
}

impl Context {
    /// The manners that the arguments ask for; starts the log of the program itself.
    pub(crate) fn new(global: &Global) -> Self {
        let terminal = io::stderr().is_terminal();
        let colored = |terminal: bool| match global.color {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => terminal && colors_wanted(),
        };
        let (color, paints) = (colored(terminal), colored(io::stdout().is_terminal()));
        let style = match global.progress {
            _ if global.quiet => ProgressStyle::None,
            ProgressStyle::Auto if !terminal => ProgressStyle::None,
            style => style,
        };
        start_log(global.verbose, color);
        Self {
            json: global.json,
            quiet: global.quiet,
            color,
            paints,
            progress: Progress::new(style),
            warnings: RefCell::default(),
        }
    }

    /// Prints results; a reader that has left ends the program quietly.
    pub(crate) fn print(&self, text: &str) -> Result<(), Failure> {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(Failure::stdout)
    }

    /// Prints the last screen of a command whose results are files, unless the user wants silence.
    pub(crate) fn sum_up(&self, text: &str) -> Result<(), Failure> {
        if self.quiet { Ok(()) } else { self.print(text) }
    }

    /// Prints the one JSON document of the command.
    pub(crate) fn print_json(&self, document: &impl Serialize) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(document)
            .map_err(|error| Failure::new(Exit::Failed, "internal.json", format!("could not write JSON: {error}")))?;
        self.print(&(text + "\n"))
    }

    /// Tells the user something that is no result, unless the user wants silence.
    pub(crate) fn say(&self, text: &str) {
        if !self.quiet {
            self.progress.line(text);
        }
    }

    /// Warns the user, unless the user wants silence.
    pub(crate) fn warn(&self, text: &str) {
        self.warnings.borrow_mut().push(text.to_owned());
        if !self.quiet {
            let label = if self.color { "\u{1b}[1;33mwarning\u{1b}[0m" } else { "warning" };
            self.progress.line(&format!("{label}: {text}"));
        }
    }

    /// Everything the user was warned of so far.
    pub(crate) fn warnings(&self) -> Vec<String> {
        self.warnings.borrow().clone()
    }

    /// Whether pictures on standard output may have colors.
    pub(crate) fn paints(&self) -> bool {
        self.paints
    }

    /// Whether somebody sits at the terminal.
    pub(crate) fn is_watched(&self) -> bool {
        io::stdout().is_terminal() && io::stderr().is_terminal()
    }

    /// The same manners, but silent: for work that is done a second time.
    pub(crate) fn silent(&self) -> Self {
        let progress = Progress::new(ProgressStyle::None);
        Self { json: self.json, quiet: true, color: self.color, paints: false, progress, warnings: RefCell::default() }
    }

    /// Shows why the command ended.
    pub(crate) fn show(&self, failure: &Failure) {
        let text = if self.json { failure.to_json() } else { failure.render(self.color) };
        if let Some(text) = text {
            self.progress.line(&text);
        }
    }

    /// Where the stages of the work are shown.
    pub(crate) fn progress(&self) -> &Progress {
        &self.progress
    }
}

/// Whether the user's environment allows color.
fn colors_wanted() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// The program's own log goes to standard error, as `TOPOGRID_LOG` or the number of `-v` asks for.
fn start_log(verbose: u8, color: bool) {
    let level = match verbose {
        0 => "error",
        1 => "info",
        2 => "debug",
        _ => "trace",
    };
    let filter = EnvFilter::try_from_env("TOPOGRID_LOG").unwrap_or_else(|_| EnvFilter::new(level));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr).with_ansi(color).init();
}

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Makes Ctrl-C ask instead of kill: the first sets [`interrupted`], the second ends the program at once.
pub(crate) fn catch_interrupts() {
    static CAUGHT: OnceLock<()> = OnceLock::new();
    CAUGHT.get_or_init(|| {
        let handler = || {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(Exit::Interrupted as i32);
            }
        };
        // Without a handler Ctrl-C still ends the program, only less politely.
        let _ = ctrlc::set_handler(handler);
    });
}

/// Whether the user pressed Ctrl-C since [`catch_interrupts`].
pub(crate) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::render::blocks;
use crate::{finished::map_folder, input::session};

/// Look at a run: its report in the browser, or its map in the terminal
///
/// Examples:
///   topogrid view runs/office
///   topogrid view runs/office --term
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ViewArgs {
    /// The folder of the run
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Draw the map with its places as text: it fits the terminal, and works where there is no browser
    #[arg(long)]
    term: bool,
}

/// Shows the run.
pub(crate) fn run(args: &ViewArgs, context: &Context) -> Result<(), Failure> {
    if args.term { in_terminal(&args.run, context) } else { in_browser(&args.run, context) }
}

fn in_terminal(run: &Path, context: &Context) -> Result<(), Failure> {
    let mapper = session::load(run)?;
    let grid = map_folder::read(run)?.grid;
    let visited = mapper.topology().places().iter().filter(|place| place.is_visited());
    let places: Vec<_> =
        visited.map(|place| mapper.coordinates().map_from_place(place.id).translation.vector.into()).collect();
    // Two lines are left for the prompt; a larger window than usual is for those who asked for it by making it.
    let (rows, columns) = console::Term::stdout().size_checked().unwrap_or((24, 80));
    let size = (usize::from(columns).max(20), usize::from(rows.saturating_sub(3)).max(5));
    let legend = if context.paints() { "" } else { "# occupied  . free  ? contradictory  o place\n" };
    context.print(&(blocks::picture(&grid, &places, size, context.paints()) + legend))
}

fn in_browser(run: &Path, context: &Context) -> Result<(), Failure> {
    let page = run.join("report.html");
    if !page.exists() {
        let message = format!("{} holds no report.html", run.display());
        return Err(Failure::new(Exit::Rejected, "view.report", message)
            .help(format!("topogrid report {} writes it; --term needs none", run.display())));
    }
    if context.json {
        return context.print_json(&serde_json::json!({ "schema": "topogrid/view/1", "report": page }));
    }
    let opener = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let opened = context.is_watched()
        && Command::new(opener)
            .arg(&page)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .is_ok();
    if context.is_watched() && !opened {
        context.say("no browser was found to open it; --term draws the map here");
    }
    context.print(&format!("{}\n", page.display()))
}

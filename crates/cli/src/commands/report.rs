use std::path::{Path, PathBuf};

use clap::Args;
use hierarchy::Metrics;

use crate::context::Context;
use crate::failure::Failure;
use crate::finished::Finished;
use crate::{files, input::session, report};

/// The page that shows a run whole: report.html, again
///
/// `topogrid run` and `edit` write it already; this draws it anew from the run's session and its edits.
///
/// Example: topogrid report runs/office
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// The run: its folder, or its session.hmap
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// The page [default: report.html in the run's folder]
    #[arg(short, long, value_name = "FILE.html")]
    out: Option<PathBuf>,
}

/// Draws the page.
pub(crate) fn run(args: &ReportArgs, context: &Context) -> Result<(), Failure> {
    let file = session::file(&args.run);
    let folder = file.parent().unwrap_or(Path::new("."));
    let mut finished = Finished::draw(session::load(&args.run)?, context)?;
    recall(&mut finished.metrics, &folder.join("metrics.json"));
    let page = report::draw(&session::name(&args.run), &finished)?.with(&finished.metrics);
    let out = args.out.clone().unwrap_or_else(|| folder.join("report.html"));
    files::write(&out, true, |file| file.write_all(page.as_bytes())).map_err(|error| Failure::writing(&out, &error))?;
    if context.json {
        let bytes = page.len();
        return context.print_json(&serde_json::json!({ "schema": "topogrid/report/1", "out": out, "bytes": bytes }));
    }
    context.print(&format!("{}\n", out.display()))
}

/// What only the run itself knew: how long it took, and how far from the truth it is. A run without it has a report as well.
fn recall(metrics: &mut Metrics, path: &Path) {
    let read = std::fs::read(path).ok().and_then(|bytes| serde_json::from_slice::<Metrics>(&bytes).ok());
    if let Some(then) = read {
        metrics.timings_s = then.timings_s;
        metrics.peak_memory_mib = then.peak_memory_mib;
        metrics.truth = then.truth;
        metrics.log.skipped = then.log.skipped;
    }
}

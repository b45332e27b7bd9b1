//! What came of the experiment as tables in Markdown.

use std::fmt::Write;

use hierarchy::evaluate::Statistics;

use super::Series;
use super::trial::{COLUMNS, GRIDS, Trial};

/// The paper's figures: Duckett & Saffiotti (2000).
const PAPER: [(&str, f64); 4] = [("places", 137.0), ("readings", 6600.0), ("columns", 450.0), ("rows", 350.0)];

/// All tables of all series.
pub(super) fn markdown(all: &[Series]) -> String {
    let mut text = String::new();
    for series in all {
        let Series { world, robot, trials } = series;
        let _ = writeln!(text, "## {world}, robot `{robot}`, {} seeds\n", trials.len());
        if !trials.is_empty() {
            text += &overview(trials);
            text += &errors(trials);
            text += &grids(trials);
            text += &each(trials);
        }
    }
    text
}

fn median(trials: &[Trial], value: impl Fn(&Trial) -> f64) -> f64 {
    Statistics::of(&trials.iter().map(value).collect::<Vec<_>>()).map_or(f64::NAN, |figures| figures.median)
}

#[expect(clippy::cast_precision_loss, reason = "places and readings are far fewer than 2⁵³")]
fn overview(trials: &[Trial]) -> String {
    let n = trials.len();
    let count = |holds: &dyn Fn(&Trial) -> bool| trials.iter().filter(|trial| holds(trial)).count();
    let sum = |value: fn(&Trial) -> usize| trials.iter().map(value).sum::<usize>();
    let mut text = String::from("| | paper | here, median |\n|---|---:|---:|\n");
    let ours: [fn(&Trial) -> f64; 4] =
        [|t| t.places as f64, |t| t.readings as f64, |t| t.columns as f64, |t| t.rows as f64];
    for ((name, paper), ours) in PAPER.iter().zip(ours) {
        let _ = writeln!(text, "| {name} | {paper:.0} | {:.0} |", median(trials, ours));
    }
    let _ = writeln!(text, "| one sweep of relaxation | 20 ms | {:.1} µs |", 1e6 * median(trials, |t| t.sweep_s));
    let _ = writeln!(text, "| the whole gridmap | 36 s | {:.0} ms |", 1e3 * median(trials, |t| t.gridmap_s));
    let _ = writeln!(text, "| coverage of the reachable floor | | {:.3} |", median(trials, |t| t.coverage));
    let _ = writeln!(text, "| runs with coverage ≥ 0.95 | | {} of {n} |", count(&|t| t.coverage >= 0.95));
    let kept = median(trials, |t| t.coverage_with_margin);
    let _ = writeln!(text, "| coverage of floor behind ways that leave the explorer's margin | | {kept:.3} |");
    let kept = count(&|t| t.coverage_with_margin >= 0.95);
    let _ = writeln!(text, "| runs with that ≥ 0.95 | | {kept} of {n} |");
    let _ = writeln!(text, "| runs that end by themselves | | {} of {n} |", count(&|t| t.ended_by_itself));
    let _ = writeln!(text, "| runs without collision | | {} of {n} |", count(&|t| t.clearance_m >= 0.0));
    let _ = writeln!(text, "| runs without false link | | {} of {n} |", count(&|t| t.false_links == 0));
    let _ = writeln!(text, "| false links among all | | {} of {} |", sum(|t| t.false_links), sum(|t| t.links));
    let share = 100.0 * sum(|t| t.duplicates) as f64 / sum(|t| t.places).max(1) as f64;
    let _ = writeln!(text, "| places that double another | | {share:.1} % |");
    let _ = writeln!(text, "| driven | | {:.0} m |\n", median(trials, |t| t.path_length_m));
    text
}

fn errors(trials: &[Trial]) -> String {
    let mut text =
        String::from("Position error of the places, rigidly aligned, in metres (medians over the seeds):\n\n");
    text += "| | odometry alone | with compass | one sweep per place | optimum, compass | optimum, all fused |\n";
    text += "|---|---:|---:|---:|---:|---:|\n";
    for (name, of) in [("mean", 0), ("maximum", 1)] {
        let _ = write!(text, "| {name} |");
        for column in 0..COLUMNS.len() {
            let value = median(trials, |t| if of == 0 { t.errors[column].mean_m } else { t.errors[column].max_m });
            let _ = write!(text, " {value:.2} |");
        }
        text.push('\n');
    }
    text + "\n"
}

fn grids(trials: &[Trial]) -> String {
    let mut text = String::from("The gridmap against the true one (medians):\n\n");
    text +=
        "| poses | walls within 0.2 m: precision | recall | free space IoU | conflict |\n|---|---:|---:|---:|---:|\n";
    for (row, name) in GRIDS.iter().enumerate() {
        let of = |value: fn(&super::trial::GridScore) -> f64| median(trials, |t| t.grids.get(row).map_or(0.0, value));
        let (precision, recall) = (of(|g| g.precision), of(|g| g.recall));
        let (iou, conflict) = (of(|g| g.free_iou), of(|g| g.conflict));
        let _ = writeln!(text, "| {name} | {precision:.2} | {recall:.2} | {iou:.2} | {conflict:.4} |");
    }
    text + "\n"
}

fn each(trials: &[Trial]) -> String {
    let mut text =
        String::from("| seed | places | links | readings | grid | coverage | driven | false links | doubled |");
    for column in COLUMNS {
        let _ = write!(text, " {column} |");
    }
    text += "\n|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    for t in trials {
        let _ = write!(
            text,
            "| {} | {} | {} | {} | {} × {} | {:.3} | {:.0} m | {} | {} |",
            t.seed,
            t.places,
            t.links,
            t.readings,
            t.columns,
            t.rows,
            t.coverage,
            t.path_length_m,
            t.false_links,
            t.duplicates
        );
        for error in &t.errors {
            let _ = write!(text, " {:.2} / {:.2} |", error.mean_m, error.max_m);
        }
        text.push('\n');
    }
    text + "\n"
}

use std::fmt::Write;

use hierarchy::Metrics;

use crate::run_folder::RunFolder;

/// The last screen of a run, 80 columns by 24 lines: what was made, what changed, what to worry about and which command
/// explains it, where it is. Every number is one of `metrics.json`; writing to a string cannot fail.
pub(crate) fn text(name: &str, folder: &RunFolder, metrics: &Metrics, seed: u64, verified: Option<&str>) -> String {
    let run = folder.path().display().to_string();
    let mut text = made(name, metrics);
    text.push_str(&changed(metrics));
    text.push_str(&worries(metrics, &run));
    let _ = writeln!(text, "\n {}", files(folder));
    let timings = &metrics.timings_s;
    let _ = write!(
        text,
        " {:.1} s (read {:.1} · map {:.1} · grid {:.1} · write {:.1}), {:.0} MiB, seed {seed}",
        timings.total,
        timings.read,
        timings.local + timings.recognize + timings.relax,
        timings.grid + timings.regions,
        timings.write,
        metrics.peak_memory_mib
    );
    if let Some(verified) = verified {
        let _ = write!(text, "\n {verified}");
    }
    text + "\n"
}

/// What was made of what.
fn made(name: &str, metrics: &Metrics) -> String {
    let Metrics { log, links, grid, .. } = metrics;
    #[expect(clippy::cast_precision_loss, reason = "cells of a map that fits into memory")]
    let metres = |cells: usize| cells as f64 * grid.resolution_m;
    let (columns, rows) = (metres(grid.columns), metres(grid.rows));
    let mut text = format!(
        "{name}: {}, {}, {} · {columns:.1} × {rows:.1} m\n",
        count(metrics.places, "place"),
        count(links.traveled + links.recognized, "link"),
        count(links.recognized, "loop"),
    );
    let _ = writeln!(
        text,
        " {:.1} m driven in {}, {} scans, heading from {}",
        log.path_length_m,
        duration(log.duration_s),
        log.scans,
        log.heading_source
    );
    let _ = write!(text, " {} × {} cells at {} m", grid.rows, grid.columns, grid.resolution_m);
    if let Some(regions) = &metrics.regions {
        let (rooms, corridors) = (count(regions.rooms, "room"), count(regions.corridors, "corridor"));
        let _ = write!(text, ", {rooms}, {corridors}, {}", count(regions.gateways, "gateway"));
    }
    text + "\n\n"
}

/// What relaxation changed.
fn changed(metrics: &Metrics) -> String {
    let (trust, relaxation) = (&metrics.trust, &metrics.relaxation);
    let mut text = String::from("                dead reckoning   relaxed\n");
    if metrics.links.recognized > 0 {
        let _ = writeln!(
            text,
            " loops miss by (rms)   {:>6.2} m  {:>6.2} m   worst {:.1} σ",
            trust.loop_residual_before_m, trust.loop_residual_after_m, trust.loop_residual_worst_sigma
        );
    }
    if has_loops(metrics) {
        let _ = writeln!(
            text,
            " energy              {:>8.1}   {:>7.1}     optimum {:.1}",
            relaxation.energy_before, relaxation.energy_after, relaxation.energy_optimum
        );
    }
    if let Some(truth) = &metrics.truth {
        let (before, after, raw) = (truth.before_m, truth.after_m, truth.odometry_m);
        let _ = writeln!(text, " error of places       {before:>6.2} m  {after:>6.2} m   raw odometry {raw:.2} m");
    }
    let _ = write!(text, " place σ (median)           –    {:>6.2} m", trust.place_sigma_median_m);
    if let Some(place) = trust.worst_place {
        let held = if trust.worst_place_links == 1 { " (single link)" } else { "" };
        let _ = write!(text, "   worst P{place} {:.2} m{held}", trust.place_sigma_worst_m);
    }
    text.push('\n');
    let grid = &metrics.grid;
    let seen = grid.occupied + grid.empty + grid.contradictory;
    #[expect(clippy::cast_precision_loss, reason = "cells of a map that fits into memory")]
    let share = if seen > 0 { 100.0 * grid.contradictory as f64 / seen as f64 } else { 0.0 };
    let _ = writeln!(text, " contradicting cells        –    {share:>6.1} %");
    text
}

/// Whether the links close loops, by recognition or because the robot came back to a place that it knew.
fn has_loops(metrics: &Metrics) -> bool {
    metrics.links.traveled + metrics.links.recognized >= metrics.places
}

/// What deserves a look, each with the command that explains it.
fn worries(metrics: &Metrics, run: &str) -> String {
    let trust = &metrics.trust;
    let mut text = String::new();
    let refused = metrics.links.rejected;
    if metrics.places == 1 {
        let driven = metrics.log.path_length_m;
        let _ = writeln!(text, "\n the odometry moves by {driven:.1} m: everything is drawn at one place");
        let _ = writeln!(text, "   topogrid inspect LOG tells what the log holds");
    } else if !has_loops(metrics) {
        let _ = writeln!(text, "\n no loop was closed: nothing checks this map");
        let _ = writeln!(text, "   topogrid explain {run} --loops");
    } else if refused > 0 {
        let named = trust.refused.iter().take(2);
        let named = named.map(|story| format!("P{}→P{} {:.1} σ", story.place, story.known, story.residual_sigma));
        let named: Vec<String> = named.collect();
        let more = if refused > named.len() { ", …" } else { "" };
        let _ = writeln!(text, "\n {} refused ({}{more})", count(refused, "loop"), named.join(", "));
        let _ = writeln!(text, "   topogrid explain {run} --loops");
    }
    if let Some(link) = trust.weakest_link.as_ref().filter(|_| has_loops(metrics)) {
        let _ = writeln!(text, "\n P{}–P{} alone holds {} to the rest", link.from, link.to, count(link.holds, "place"));
        let _ = writeln!(text, "   topogrid explain {run} --link {}-{}", link.from, link.to);
    }
    if metrics.links.carried > 0 {
        let (times, pieces) = (count(metrics.links.carried, "time"), metrics.links.pieces);
        let found = if pieces > 1 { format!("the map is in {pieces} pieces") } else { "it was found again".to_owned() };
        let _ = writeln!(text, "\n the robot was carried {times}; {found}");
    }
    if metrics.log.skipped > 0 {
        let _ = writeln!(
            text,
            "\n {} of the log left out: see the warnings in run.json",
            count(metrics.log.skipped, "line")
        );
    }
    text
}

/// What to open, and how much there is.
fn files(folder: &RunFolder) -> String {
    let first = ["report.html", "map.yaml", "map.png", "topology.svg", "nav2_route.geojson"];
    let mut names = first.iter().filter(|name| folder.path().join(name).exists());
    let opened = names.next().map_or_else(|| folder.path().to_owned(), |name| folder.path().join(name));
    let (files, bytes) = folder.size();
    let others: Vec<&str> = names.take(2).copied().collect();
    #[expect(clippy::cast_precision_loss, reason = "a folder of fewer than 2^52 bytes")]
    let megabytes = bytes as f64 / 1e6;
    format!("{}  {}  … {files} files, {megabytes:.1} MB", opened.display(), others.join("  "))
}

fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

fn duration(seconds: f64) -> String {
    if seconds < 120.0 { format!("{seconds:.0} s") } else { format!("{:.0} min", seconds / 60.0) }
}

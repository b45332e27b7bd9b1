use std::fmt::Write;

use hierarchy::Metrics;

use crate::run_folder::RunFolder;

/// The last screen of a run: what was made, what changed, where it is, and what to type next.
pub(crate) fn text(name: &str, folder: &RunFolder, metrics: &Metrics) -> String {
    let Metrics { log, links, relaxation, grid, timings_s: timings, .. } = metrics;
    let mut text = format!(
        "{name}: {} places, {} links, {} loops closed · {:.1} m driven · {} × {} cells of {} m\n\n",
        metrics.places,
        links.traveled + links.recognized,
        links.recognized,
        log.path_length_m,
        grid.rows,
        grid.columns,
        grid.resolution_m
    );
    // Writing to a string cannot fail.
    let _ = writeln!(text, " heading from      {}", log.heading_source);
    let _ = writeln!(
        text,
        " energy            {:.4} → {:.4}, optimum {:.4}, relative gap {:.1e}",
        relaxation.energy_before, relaxation.energy_after, relaxation.energy_optimum, relaxation.relative_gap
    );
    let _ = writeln!(text, " largest shift     {:.2} m", relaxation.max_shift_m);
    if let Some(truth) = &metrics.truth {
        let _ = writeln!(
            text,
            " error of places   {:.2} m before, {:.2} m after relaxation (raw odometry {:.2} m), mean of {}",
            truth.before_m, truth.after_m, truth.odometry_m, truth.places
        );
    }
    let _ = writeln!(
        text,
        " cells             {} empty, {} occupied, {} contradictory, {} unexplored",
        grid.empty, grid.occupied, grid.contradictory, grid.unexplored
    );
    if let Some(regions) = &metrics.regions {
        let (rooms, corridors, gateways) = (regions.rooms, regions.corridors, regions.gateways);
        let _ = writeln!(text, " regions           {rooms} rooms, {corridors} corridors, {gateways} gateways");
    }
    let _ = writeln!(text, " loops refused     {}, with reasons in loops.csv\n", links.rejected);
    for file in folder.written() {
        let _ = writeln!(text, " {:<34} {}", folder.path().join(file.name).display(), file.holds);
    }
    let _ = writeln!(
        text,
        "\n {:.2} s (read {:.2} · map {:.2} · grid {:.2} · write {:.2}), {:.0} MiB",
        timings.total, timings.read, timings.local, timings.grid, timings.write, metrics.peak_memory_mib
    );
    text
}

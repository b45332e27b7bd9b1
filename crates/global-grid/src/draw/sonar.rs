use local_grid::{Scan, SensorModel};
use nalgebra::Isometry2;

use crate::draw::Direction;
use crate::draw::cone::{CHUNK, Cone, Opening};
use crate::draw::counts::Counts;
use crate::draw::window::Window;
use crate::{SharedEcho, options::GridOptions};

/// Counts the cones of a sonar scan, each up to just before its reading.
pub(crate) fn sweep(
    counts: &mut Counts,
    (window, opening): (&mut Window, &mut Opening),
    (model, resolution): (&SharedEcho, f64),
    (map_from_robot, scan): (&Isometry2<f64>, &Scan),
    direction: Direction,
) {
    let half_width = opening.of(model.half_width_of(scan.sensor()));
    for beam in scan.beams() {
        let Some(sounding) = model.sounding(scan.sensor(), beam.reading) else { continue };
        let radius = cells(sounding.range - model.margin, resolution);
        if radius > 0.0 {
            let cone = Cone::new(&(map_from_robot * beam.robot_from_sensor), half_width, resolution);
            sweep_cone(counts, window, &cone, radius, direction);
        }
    }
}

/// Counts the cells of a cone.
fn sweep_cone(counts: &mut Counts, window: &mut Window, cone: &Cone, radius: f32, direction: Direction) {
    let (rows, _) = open(window, cone, (0.0, radius));
    let mut row = rows.0;
    while row < rows.1 {
        let spans = cone.spans(row, radius);
        let spans = &spans[..CHUNK.min(row.abs_diff(rows.1) as usize)];
        let (line, column) = (cone.cell.0 + row, cone.cell.1);
        // Where a row is missed, both ends fall on one cell and cancel.
        counts.add_upward(window, line, spans.iter().map(|span| column + span.0), direction.one());
        counts.add_upward(window, line, spans.iter().map(|span| column + span.1.max(span.0)), -direction.one());
        row += step();
    }
}

/// Opens the window around the part of a cone between two radii, and returns its rows `[first, last)` and its first and
/// last column of tiles.
pub(crate) fn open(window: &mut Window, cone: &Cone, (inner, outer): (f32, f32)) -> ((i32, i32), (usize, usize)) {
    let (rows, columns) = (cone.rows(inner, outer), cone.columns(inner, outer));
    let (row, column) = cone.cell;
    // A cell to spare: where a cone misses a row's middles, rounding may put both ends of nothing beside it.
    window.open_near((row + rows.0, column + columns.0 - 1), (row + rows.1, column + columns.1 + 1));
    (rows, (window.tile_column(column + columns.0), window.tile_column(column + columns.1)))
}

#[expect(clippy::cast_possible_truncation, reason = "lengths of a few thousand cells")]
pub(crate) fn cells(length: f64, resolution: f64) -> f32 {
    (length / resolution) as f32
}

pub(crate) fn step() -> i32 {
    i32::try_from(CHUNK).expect("a small number")
}

/// What a scan's options need to draw sonar readings.
pub(crate) fn model_of(options: &GridOptions) -> Option<&SharedEcho> {
    match &options.sonar {
        crate::SonarModel::Shared(model) => Some(model),
        crate::SonarModel::Cone(_) | crate::SonarModel::Regions(_) => None,
    }
}

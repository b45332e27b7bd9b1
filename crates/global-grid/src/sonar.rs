use local_grid::{Scan, SensorModel};
use nalgebra::Isometry2;

use crate::cone::{CHUNK, Cone, Opening};
use crate::plane::{Plane, Window};
use crate::{SharedEcho, options::GridOptions};

/// Adds the empty evidence of a sonar scan: one value all over each cone, up to just before the reading.
pub(crate) fn sweep(
    plane: &mut Plane,
    (window, opening): (&mut Window, &mut Opening),
    (model, resolution): (&SharedEcho, f64),
    (map_from_robot, scan): (&Isometry2<f64>, &Scan),
    units: u32,
) {
    let half_width = opening.of(model.half_width_of(scan.sensor()));
    for beam in scan.beams() {
        let Some(sounding) = model.sounding(scan.sensor(), beam.reading) else { continue };
        let radius = cells(sounding.range - model.margin, resolution);
        if radius > 0.0 {
            let cone = Cone::new(&(map_from_robot * beam.robot_from_sensor), half_width, resolution);
            sweep_cone(plane, window, &cone, radius, units);
        }
    }
}

/// Adds `units` to the cells of a cone.
fn sweep_cone(plane: &mut Plane, window: &mut Window, cone: &Cone, radius: f32, units: u32) {
    let (rows, tiles) = open(window, cone, (0.0, radius));
    let mut row = rows.0;
    while row < rows.1 {
        let spans = cone.spans(row, radius).map(|span| (cone.cell.1 + span.0, cone.cell.1 + span.1));
        let count = CHUNK.min(row.abs_diff(rows.1) as usize);
        for tile_column in tiles.0..=tiles.1 {
            window.add_spans(plane, cone.cell.0 + row, tile_column, &spans[..count], units);
        }
        row += step();
    }
}

/// Opens the window around the part of a cone between two radii, and returns its rows `[first, last)` and its first and
/// last column of tiles.
pub(crate) fn open(window: &mut Window, cone: &Cone, (inner, outer): (f32, f32)) -> ((i32, i32), (usize, usize)) {
    let (rows, columns) = (cone.rows(inner, outer), cone.columns(inner, outer));
    let (row, column) = cone.cell;
    window.open_near((row + rows.0, column + columns.0), (row + rows.1, column + columns.1));
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

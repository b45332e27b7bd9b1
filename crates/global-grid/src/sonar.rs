use local_grid::{Reading, Scan, SensorModel, Sounding};
use nalgebra::Isometry2;

use crate::cone::{CHUNK, Cone};
use crate::plane::{Plane, SHIFT, Window, left_in_tile};
use crate::{SharedEcho, options::GridOptions};

/// Adds the empty evidence of a sonar scan: one value all over each cone, up to just before the reading.
pub(crate) fn sweep(
    plane: &mut Plane,
    window: &mut Window,
    (model, resolution): (&SharedEcho, f64),
    (map_from_robot, scan): (&Isometry2<f64>, &Scan),
    units: u32,
) {
    let half_width = model.half_width_of(scan.sensor()).sin_cos();
    for beam in scan.beams() {
        let Some(sounding) = model.sounding(scan.sensor(), beam.reading) else { continue };
        let radius = cells(sounding.range - model.margin, resolution);
        if radius <= 0.0 {
            continue;
        }
        let cone = Cone::new(&(map_from_robot * beam.robot_from_sensor), half_width, resolution);
        let rows = open(window, &cone, radius);
        let mut row = rows.0;
        while row < rows.1 {
            for (row, span) in (row..rows.1).zip(cone.spans(row, radius)) {
                if span.0 < span.1 {
                    let columns = (cone.cell.1 + span.0, cone.cell.1 + span.1);
                    window.add_span(plane, cone.cell.0 + row, columns, units);
                }
            }
            row += step();
        }
    }
}

/// The cells in which the causes of echoes may lie, reading by reading.
#[derive(Debug, Default)]
pub(crate) struct Arcs {
    /// Slot and place of a cell, and its weight in the ring.
    pub(crate) cells: Vec<(u32, f32)>,
    /// Where in `cells` each reading ends.
    pub(crate) ends: Vec<usize>,
}

impl Arcs {
    /// The arcs of one reading after the other.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &[(u32, f32)]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.cells[start..end])
    }

    /// Appends the ring of every echo of a scan. The tiles it lies in are made in `plane`.
    pub(crate) fn push(
        &mut self,
        plane: &mut Plane,
        window: &mut Window,
        (model, resolution): (&SharedEcho, f64),
        (map_from_robot, scan): (&Isometry2<f64>, &Scan),
    ) {
        let half_width = model.half_width_of(scan.sensor()).sin_cos();
        for beam in scan.beams() {
            let Some(sounding) = echo(model, scan, beam.reading) else { continue };
            let cone = Cone::new(&(map_from_robot * beam.robot_from_sensor), half_width, resolution);
            self.ring(plane, window, &cone, sounding.range / resolution, model.depth / resolution);
            self.ends.push(self.cells.len());
        }
    }

    fn ring(&mut self, plane: &mut Plane, window: &mut Window, cone: &Cone, range: f64, depth: f64) {
        let (range, depth) = (cells(range, 1.0), cells(depth, 1.0));
        let (outer, inner) = (range + depth, (range - depth).max(0.0));
        let rows = open(window, cone, outer);
        let mut row = rows.0;
        while row < rows.1 {
            let (outer, inner) = (cone.spans(row, outer), cone.spans(row, inner));
            for (row, (outer, inner)) in (row..rows.1).zip(outer.into_iter().zip(inner)) {
                let hole = if inner.0 < inner.1 { inner } else { (outer.1, outer.1) };
                for span in [(outer.0, hole.0), (hole.1, outer.1)] {
                    self.run(plane, window, cone, row, span, (range, depth));
                }
            }
            row += step();
        }
    }

    /// Appends the cells of one row of a ring, tile by tile. Those that rounding puts outside weigh nothing.
    #[inline]
    fn run(
        &mut self,
        plane: &mut Plane,
        window: &mut Window,
        cone: &Cone,
        row: i32,
        (mut first, last): (i32, i32),
        (range, depth): (f32, f32),
    ) {
        let (dy, per_depth) = (cone.northing(row), depth.recip());
        while first < last {
            let (slot, place) = window.cell(plane, cone.cell.0 + row, cone.cell.1 + first);
            let end = last.min(first + left_in_tile(cone.cell.1 + first));
            let start = slot << (2 * SHIFT) | u32::try_from(place).expect("a tile has 4096 cells");
            self.cells.extend((first..end).map(|column| {
                let dx = cone.easting(column);
                let off = ((dx * dx + dy * dy).sqrt() - range) * per_depth;
                let weight = 1.0 - off * off;
                (start + column.abs_diff(first), if weight > 0.0 { weight } else { 0.0 })
            }));
            first = end;
        }
    }
}

/// What a reading heard, if it heard anything.
fn echo(model: &SharedEcho, scan: &Scan, reading: Reading) -> Option<Sounding> {
    model.sounding(scan.sensor(), reading).filter(|sounding| sounding.echo)
}

/// Whether a scan holds any echo that can be shared out.
pub(crate) fn count_echoes(model: &SharedEcho, scan: &Scan) -> usize {
    scan.readings().iter().filter(|&&reading| echo(model, scan, reading).is_some()).count()
}

/// Opens the window around a cone and returns its rows.
fn open(window: &mut Window, cone: &Cone, radius: f32) -> (i32, i32) {
    let rows = cone.rows(radius);
    let columns = cone.columns(radius);
    let (row, column) = cone.cell;
    window.open_near((row + rows.0, column + columns.0), (row + rows.1, column + columns.1));
    rows
}

#[expect(clippy::cast_possible_truncation, reason = "lengths of a few thousand cells")]
fn cells(length: f64, resolution: f64) -> f32 {
    (length / resolution) as f32
}

fn step() -> i32 {
    i32::try_from(CHUNK).expect("a small number")
}

/// What a scan's options need to draw sonar readings.
pub(crate) fn model_of(options: &GridOptions) -> Option<&SharedEcho> {
    match &options.sonar {
        crate::SonarModel::Shared(model) => Some(model),
        crate::SonarModel::Cone(_) | crate::SonarModel::Regions(_) => None,
    }
}

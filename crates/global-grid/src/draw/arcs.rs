use local_grid::{Reading, Scan, SensorModel, Sounding};
use nalgebra::Isometry2;

use crate::SharedEcho;
use crate::draw::cone::{Cone, Opening};
use crate::draw::sonar::{cells, open, step};
use crate::draw::window::Window;
use crate::plane::{Plane, SHIFT, TILE};

/// The cells in which the causes of echoes may lie, reading by reading.
#[derive(Debug, Default)]
pub(crate) struct Arcs {
    /// Slot and place of a cell, and its weight in the ring.
    pub(crate) cells: Vec<(u32, f32)>,
    /// Where in `cells` each reading ends.
    pub(crate) ends: Vec<usize>,
    opening: Opening,
    ring: Ring,
}

impl Arcs {
    /// Forgets all arcs.
    pub(crate) fn clear(&mut self) {
        self.cells.clear();
        self.ends.clear();
    }

    /// Appends the arcs of other readings.
    pub(crate) fn append(&mut self, more: &Self) {
        let start = self.cells.len();
        self.cells.extend_from_slice(&more.cells);
        self.ends.extend(more.ends.iter().map(|end| start + end));
    }

    /// Appends the ring of every echo of a scan. The tiles it lies in are made in `plane`.
    pub(crate) fn push(
        &mut self,
        plane: &mut Plane,
        window: &mut Window,
        (model, resolution): (&SharedEcho, f64),
        (map_from_robot, scan): (&Isometry2<f64>, &Scan),
    ) {
        let half_width = self.opening.of(model.half_width_of(scan.sensor()));
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
        let (rows, tiles) = open(window, cone, (inner, outer));
        let mut row = rows.0;
        while row < rows.1 {
            let [outer, inner] = cone.nested_spans(row, [outer, inner]);
            for (row, (outer, inner)) in (row..rows.1).zip(outer.into_iter().zip(inner)) {
                let hole = if inner.0 < inner.1 { inner } else { (outer.1, outer.1) };
                let square = cone.northing(row).powi(2);
                for tile_column in tiles.0..=tiles.1 {
                    let (left, slot) = window.line(plane, cone.cell.0 + row, tile_column);
                    for span in [(outer.0, hole.0), (hole.1, outer.1)] {
                        let columns = (span.0.max(left - cone.cell.1), span.1.min(left - cone.cell.1 + edge()));
                        if columns.0 < columns.1 {
                            let start = slot + (cone.cell.1 + columns.0).abs_diff(left);
                            self.ring.put(
                                start,
                                columns.0.abs_diff(columns.1) as usize,
                                cone.easting(columns.0),
                                square,
                            );
                        }
                    }
                }
            }
            row += step();
        }
        let per_depth = depth.recip();
        let weight = |square: f32| {
            let off = (square.sqrt() - range) * per_depth;
            let weight = 1.0 - off * off;
            if weight > 0.0 { weight } else { 0.0 } // rounding may put a cell outside
        };
        self.cells.extend(self.ring.take().map(|(place, square)| (place, weight(square))));
    }
}

/// Cells on the edge of a tile.
fn edge() -> i32 {
    1 << SHIFT
}

/// Cells while they are gathered: where they are kept, and the squares of their distances from the apex.
#[derive(Debug, Default)]
struct Ring {
    places: Vec<u32>,
    squares: Vec<f32>,
    len: usize,
}

impl Ring {
    /// Adds `count` cells side by side, the first `dx` east of the apex.
    ///
    /// Four are written at a time, whether they are wanted or not: a row of a ring is short, and loops of changing length
    /// cost more than what they do.
    #[inline]
    fn put(&mut self, start: u32, count: usize, dx: f32, square: f32) {
        if self.places.len() < self.len + TILE + 4 {
            self.places.resize(2 * (self.len + TILE + 4), 0);
            self.squares.resize(2 * (self.len + TILE + 4), 0.0);
        }
        let room = self.len..self.len + TILE;
        let (places, _) = self.places[room.clone()].as_chunks_mut::<4>();
        let (squares, _) = self.squares[room].as_chunks_mut::<4>();
        let (mut place, mut dx) = ([0, 1, 2, 3].map(|k| start + k), [0.0, 1.0, 2.0, 3.0].map(|k| dx + k));
        for (places, squares) in places.iter_mut().zip(squares).take(count.div_ceil(4)) {
            *places = place;
            *squares = dx.map(|dx| dx * dx + square);
            place = place.map(|place| place + 4);
            dx = dx.map(|dx| dx + 4.0);
        }
        self.len += count;
    }

    /// The cells gathered, which are then forgotten.
    fn take(&mut self) -> impl Iterator<Item = (u32, f32)> {
        let len = std::mem::take(&mut self.len);
        self.places[..len].iter().copied().zip(self.squares[..len].iter().copied())
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

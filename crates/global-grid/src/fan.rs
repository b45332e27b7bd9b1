use local_grid::{LaserRay, RangeSensor, Reading, Scan, SensorKind, SensorModel};
use nalgebra::{Isometry2, Vector2};

use crate::cone::nearest;
use crate::plane::{Plane, SHIFT, TILE, Window, left_in_tile, place};

/// How much nearer than its echo a laser's beam clears, in cells: half a diagonal, so that it spares the cell of the echo.
const SPARED: f64 = 0.75;

/// The geometry of a laser whose beams start at one point and stand side by side: it sees one star-shaped area.
#[derive(Debug, Clone)]
pub(crate) struct Fan {
    /// Whether the beams run clockwise.
    clockwise: bool,
    /// `robot_from_sensor` of the point they start at, unturned.
    apex: Vector2<f64>,
    /// Unit vectors along the beams, counter-clockwise, in the robot's frame.
    beams: Vec<[f32; 2]>,
    /// Unit vectors between the beams, one more than beams.
    borders: Vec<[f32; 2]>,
}

impl Fan {
    /// The fan of a sensor, or `None` when its beams do not stand side by side.
    pub(crate) fn new(sensor: &RangeSensor) -> Option<Self> {
        let mounts = sensor.mounts();
        let apex = mounts.first()?.translation.vector;
        let together = mounts.iter().all(|mount| (mount.translation.vector - apex).norm() < 1e-6);
        if sensor.kind() != SensorKind::Laser || !together || mounts.len() < 3 {
            return None;
        }
        let steps: Vec<f64> = mounts.windows(2).map(|pair| pair[0].rotation.angle_to(&pair[1].rotation)).collect();
        let clockwise = steps[0] < 0.0;
        let widest = 1.5 * sensor.beam_width().max(1e-9);
        let side_by_side = |step: &f64| (step.is_sign_negative() == clockwise) && step.abs() <= widest && *step != 0.0;
        let turn: f64 = steps.iter().sum::<f64>().abs() + 0.5 * (steps[0] + steps[steps.len() - 1]).abs();
        if !steps.iter().all(side_by_side) || turn > std::f64::consts::TAU + 1e-6 {
            return None;
        }
        let mut bearings: Vec<f64> = mounts.iter().map(|mount| mount.rotation.angle()).collect();
        for k in 1..bearings.len() {
            bearings[k] = bearings[k - 1] + steps[k - 1]; // without the jump at π
        }
        if clockwise {
            bearings.reverse();
        }
        let borders = borders(&bearings).into_iter().map(unit).collect();
        let beams = bearings.into_iter().map(unit).collect();
        Some(Self { clockwise, apex, beams, borders })
    }
}

/// The bearings halfway between neighbours, and half a step beyond the outer two.
fn borders(bearings: &[f64]) -> Vec<f64> {
    let last = bearings.len() - 1;
    let mut borders = vec![1.5 * bearings[0] - 0.5 * bearings[1]];
    borders.extend(bearings.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])));
    borders.push(1.5 * bearings[last] - 0.5 * bearings[last - 1]);
    borders
}

#[expect(clippy::cast_possible_truncation, reason = "single precision resolves a micrometre at ten metres")]
fn unit(bearing: f64) -> [f32; 2] {
    [bearing.cos() as f32, bearing.sin() as f32]
}

/// What is needed to draw fans, kept from scan to scan.
#[derive(Debug, Clone, Default)]
pub(crate) struct FanPen {
    corners: Vec<[f32; 2]>,
    echoes: Vec<[f32; 2]>,
    /// Row by row and tile by tile, how much more of the inside goes on into the tile; all zeros between scans.
    carries: Vec<i32>,
    /// Row of tiles by row of tiles, the first and the last tile that the outline crosses.
    crossed: Vec<(usize, usize)>,
}

/// What one scan adds to the cells that it clears and to those that it hits, in units (wrapping).
#[derive(Debug, Clone, Copy)]
pub(crate) struct FanSteps {
    pub(crate) empty: u32,
    pub(crate) occupied: u32,
}

impl FanPen {
    /// Draws a scan of a fan: each cell that it sees through is cleared once, each cell that ends beams side by side is
    /// hit once.
    ///
    /// A cell is seen through if its centre lies in the sector of a beam (half a step to either side), nearer than the
    /// beam's echo by [`SPARED`] cells. The sectors make up one polygon, and only where its edges cross the middles of rows
    /// is anything written: evidence is held as differences along rows.
    pub(crate) fn draw(
        &mut self,
        (empty, occupied): (&mut Plane, &mut Plane),
        window: &mut Window,
        fan: &Fan,
        (model, resolution): (&LaserRay, f64),
        (map_from_robot, scan): (&Isometry2<f64>, &Scan),
        steps: FanSteps,
    ) {
        let apex = (map_from_robot * nalgebra::Point2::from(fan.apex)).coords / resolution;
        let corner = apex.map(f64::floor);
        let cell = (whole(corner.y), whole(corner.x));
        self.trace(fan, (model, resolution), map_from_robot.rotation.into_inner(), apex - corner, scan);
        self.clear(empty, window, cell, steps.empty);
        self.hit(occupied, window, cell, steps.occupied);
    }

    /// Works out the corners of the polygon and the points of the echoes, in cells relative to the apex' cell.
    fn trace(
        &mut self,
        fan: &Fan,
        (model, resolution): (&LaserRay, f64),
        turn: nalgebra::Complex<f64>,
        within: Vector2<f64>,
        scan: &Scan,
    ) {
        let (re, im) = (single(turn.re), single(turn.im));
        let (x, y) = (single(within.x), single(within.y));
        let at = |[dx, dy]: [f32; 2], radius: f32| [x + radius * (re * dx - im * dy), y + radius * (im * dx + re * dy)];
        self.corners.clear();
        self.echoes.clear();
        self.corners.push([x, y]);
        let n = fan.beams.len();
        let readings = scan.readings();
        for (k, (beam, borders)) in fan.beams.iter().zip(fan.borders.windows(2)).enumerate() {
            let reading = readings[if fan.clockwise { n - 1 - k } else { k }];
            let (radius, echo) = reach(model, scan.sensor(), reading, resolution);
            self.corners.push(at(borders[0], radius));
            self.corners.push(at(borders[1], radius));
            if let Some(radius) = echo {
                self.echoes.push(at(*beam, radius));
            }
        }
    }

    /// Clears the inside of the polygon.
    fn clear(&mut self, plane: &mut Plane, window: &mut Window, cell: (i32, i32), units: u32) {
        let (low, high) = bounds(&self.corners);
        if units == 0 || low[1] == high[1] {
            return;
        }
        window.open((cell.0 + low[1], cell.1 + low[0]), (cell.0 + high[1], cell.1 + high[0]));
        let outline = Outline { low, columns: window.columns() + 1, cell, units };
        let rows = index(high[1] - low[1] + 1);
        self.carries.resize(self.carries.len().max(rows * outline.columns), 0);
        self.crossed.clear();
        self.crossed.resize(rows.div_ceil(TILE) + 1, (usize::MAX, 0));
        let mut from = self.corners[self.corners.len() - 1];
        for corner in 0..self.corners.len() {
            let to = self.corners[corner];
            let (first, last) = (nearest(from[1]), nearest(to[1]));
            if first != last {
                let slope = (to[0] - from[0]) / (to[1] - from[1]);
                // Going up, the inside lies to the left and ends here; going down, it begins.
                let (rows, sign) = if first < last { ((first, last), -1) } else { ((last, first), 1) };
                let mut row = rows.0;
                while row < rows.1 {
                    let end = rows.1.min(row + left_in_tile(cell.0 + row));
                    self.cross(plane, window, &outline, (row, end), (from, slope), sign);
                    row = end;
                }
            }
            from = to;
        }
        self.carry_over(plane, window, &outline, rows);
    }

    /// Writes where an edge crosses rows of one row of tiles: where the inside begins, with a sign of 1, or ends, with −1.
    fn cross(
        &mut self,
        plane: &mut Plane,
        window: &mut Window,
        outline: &Outline,
        (row, end): (i32, i32),
        (from, slope): ([f32; 2], f32),
        sign: i32,
    ) {
        let column = |row: i32| outline.cell.1 + nearest(from[0] + (middle(row) - from[1]) * slope);
        let units = if sign < 0 { outline.units.wrapping_neg() } else { outline.units };
        let ends = [row, end - 1].map(|row| window.tile_column(column(row)));
        let crossed = &mut self.crossed[outline.band(row)];
        *crossed = (crossed.0.min(ends[0]).min(ends[1]), crossed.1.max(ends[0]).max(ends[1]));
        let line = index(row - outline.low[1]);
        let carries = self.carries[line * outline.columns..].chunks_exact_mut(outline.columns);
        if ends[0] == ends[1] {
            let tile = window.tile(plane, outline.cell.0 + row, ends[0]);
            for (row, carries) in (row..end).zip(carries) {
                let sum = &mut tile[place(outline.cell.0 + row, column(row))];
                *sum = sum.wrapping_add(units);
                carries[ends[0] + 1] += sign;
            }
        } else {
            for (row, carries) in (row..end).zip(carries) {
                let (column, row) = (column(row), outline.cell.0 + row);
                let tile_column = window.tile_column(column);
                let sum = &mut window.tile(plane, row, tile_column)[place(row, column)];
                *sum = sum.wrapping_add(units);
                carries[tile_column + 1] += sign;
            }
        }
    }

    /// Goes on in the tiles to the right of those in which the inside begins.
    fn carry_over(&mut self, plane: &mut Plane, window: &mut Window, outline: &Outline, rows: usize) {
        let lines = (outline.low[1]..).zip(self.carries.chunks_exact_mut(outline.columns).take(rows));
        for (row, carries) in lines {
            let (left, right) = self.crossed[outline.band(row)];
            if left > right {
                continue;
            }
            let (mut inside, row) = (0i32, outline.cell.0 + row);
            for (tile_column, carry) in carries.iter_mut().enumerate().take(right + 1).skip(left) {
                inside += std::mem::take(carry);
                if inside != 0 {
                    let sum = &mut window.tile(plane, row, tile_column)[place(row, 0)];
                    *sum = sum.wrapping_add(outline.units.wrapping_mul(inside.cast_unsigned()));
                }
            }
            carries[right + 1] = 0; // what ends there ends
        }
    }

    /// Hits the cells of the echoes, those of neighbours in one cell once.
    fn hit(&mut self, plane: &mut Plane, window: &mut Window, cell: (i32, i32), units: u32) {
        if self.echoes.is_empty() || units == 0 {
            return;
        }
        let (low, high) = bounds(&self.echoes);
        window.open((cell.0 + low[1], cell.1 + low[0]), (cell.0 + high[1], cell.1 + high[0]));
        let mut last = None;
        for [x, y] in &self.echoes {
            let (column, row) = (cell.1 + nearest(x - 0.5), cell.0 + nearest(y - 0.5));
            if last.replace((row, column)) != Some((row, column)) {
                let (slot, place) = window.cell(plane, row, column);
                let sum = &mut plane.tile_mut(slot)[place];
                *sum = sum.wrapping_add(units);
            }
        }
    }
}

/// Where the outline of a scan lies.
struct Outline {
    /// The lowest cell (column, row) around it, relative to the apex' cell.
    low: [i32; 2],
    /// Tiles side by side, and one.
    columns: usize,
    /// The apex' cell: row, column.
    cell: (i32, i32),
    /// What each cell inside gets.
    units: u32,
}

impl Outline {
    /// Which row of tiles holds a row of cells, counted from the lowest.
    fn band(&self, row: i32) -> usize {
        index(((self.cell.0 + row) >> SHIFT) - ((self.cell.0 + self.low[1]) >> SHIFT))
    }
}

/// How far a beam clears, and how far off its echo is, in cells.
fn reach(model: &LaserRay, sensor: &RangeSensor, reading: Reading, resolution: f64) -> (f32, Option<f32>) {
    match model.sounding(sensor, reading) {
        Some(sounding) if sounding.echo => {
            let range = sounding.range / resolution;
            (single((range - SPARED).max(0.0)), Some(single(range)))
        }
        Some(sounding) => (single(sounding.range / resolution), None),
        None => (0.0, None),
    }
}

/// The lowest and highest cells (column, row) around points, with one to spare.
fn bounds(points: &[[f32; 2]]) -> ([i32; 2], [i32; 2]) {
    let (mut low, mut high) = (points[0], points[0]);
    for point in points {
        for axis in 0..2 {
            low[axis] = if point[axis] < low[axis] { point[axis] } else { low[axis] };
            high[axis] = if point[axis] > high[axis] { point[axis] } else { high[axis] };
        }
    }
    (low.map(|at| nearest(at) - 1), high.map(|at| nearest(at) + 1))
}

#[expect(clippy::cast_precision_loss, reason = "a footprint is a few thousand cells")]
fn middle(row: i32) -> f32 {
    row as f32 + 0.5
}

#[expect(clippy::cast_sign_loss, reason = "rows lie within the bounds")]
fn index(row: i32) -> usize {
    row as usize
}

#[expect(clippy::cast_possible_truncation, reason = "single precision resolves a micrometre at ten metres")]
fn single(x: f64) -> f32 {
    x as f32
}

#[expect(clippy::cast_possible_truncation, reason = "poses are checked at the door")]
fn whole(x: f64) -> i32 {
    x as i32
}

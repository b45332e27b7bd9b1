use local_grid::{LaserRay, RangeSensor, Reading, Scan, SensorKind, SensorModel};
use nalgebra::{Isometry2, Vector2};

use crate::cone::nearest;
use crate::counts::Counts;
use crate::draw::Direction;
use crate::window::Window;

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
    cleared: Window,
    hit: Window,
}

impl FanPen {
    /// Forgets where tiles are kept, after some were released.
    pub(crate) fn forget_tiles(&mut self) {
        self.cleared = Window::default();
        self.hit = Window::default();
    }

    /// Draws a scan of a fan: each cell that it sees through is cleared once, each cell that ends beams side by side is
    /// hit once.
    ///
    /// A cell is seen through if its centre lies in the sector of a beam (half a step to either side), nearer than the
    /// beam's echo by [`SPARED`] cells. The sectors make up one polygon, and only where its edges cross the middles of rows
    /// is anything written: evidence is held as differences along rows.
    pub(crate) fn draw(
        &mut self,
        (cleared, hit): (&mut Counts, &mut Counts),
        fan: &Fan,
        (model, resolution): (&LaserRay, f64),
        (map_from_robot, scan): (&Isometry2<f64>, &Scan),
        direction: Direction,
    ) {
        let apex = (map_from_robot * nalgebra::Point2::from(fan.apex)).coords / resolution;
        let corner = apex.map(f64::floor);
        let cell = (whole(corner.y), whole(corner.x));
        self.trace(fan, (model, resolution), map_from_robot.rotation.into_inner(), apex - corner, scan);
        self.clear(cleared, cell, direction.one());
        self.hit(hit, cell, direction.one());
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

    /// Clears the inside of the polygon, `one` being what a scan counts.
    fn clear(&mut self, cleared: &mut Counts, cell: (i32, i32), one: i8) {
        let (low, high) = bounds(&self.corners);
        self.cleared.open_near((cell.0 + low[1], cell.1 + low[0]), (cell.0 + high[1], cell.1 + high[0]));
        let mut from = self.corners[self.corners.len() - 1];
        for &to in &self.corners {
            let (first, last) = (nearest(from[1]), nearest(to[1]));
            // Going up, the inside lies to the left and ends here; going down, it begins.
            if first < last {
                let edge = Edge::new(from, to, (first, cell.1)).take(index(last - first));
                cleared.add_upward(&mut self.cleared, cell.0 + first, edge, -one);
            } else if last < first {
                let edge = Edge::new(from, to, (last, cell.1)).take(index(first - last));
                cleared.add_upward(&mut self.cleared, cell.0 + last, edge, one);
            }
            from = to;
        }
    }

    /// Hits the cells of the echoes, those of neighbours in one cell once.
    fn hit(&mut self, hit: &mut Counts, cell: (i32, i32), one: i8) {
        if self.echoes.is_empty() {
            return;
        }
        let (low, high) = bounds(&self.echoes);
        self.hit.open_near((cell.0 + low[1], cell.1 + low[0]), (cell.0 + high[1], cell.1 + high[0]));
        let mut last = None;
        for [x, y] in &self.echoes {
            let (column, row) = (cell.1 + nearest(x - 0.5), cell.0 + nearest(y - 0.5));
            if last.replace((row, column)) != Some((row, column)) {
                hit.add(&mut self.hit, (row, column), one);
            }
        }
    }
}

/// The first columns whose middles lie to the right of an edge, row by row upward: numbers with 32 binary places.
struct Edge {
    column: i64,
    slope: i64,
}

impl Edge {
    /// The edge between two points; `row` is where it starts, and `column` is added to all columns.
    fn new(from: [f32; 2], to: [f32; 2], (row, column): (i32, i32)) -> Self {
        let slope = (to[0] - from[0]) / (to[1] - from[1]);
        let start = from[0] + (middle(row) - from[1]) * slope;
        Self { column: (i64::from(column) << 32) + fixed(start + 0.5), slope: fixed(slope) }
    }
}

impl Iterator for Edge {
    type Item = i32;

    #[inline]
    fn next(&mut self) -> Option<i32> {
        let column = (self.column >> 32) as i32;
        self.column = self.column.wrapping_add(self.slope);
        Some(column)
    }
}

/// A number with 32 binary places.
#[expect(
    clippy::cast_possible_truncation,
    reason = "saturates; an edge of more than one row is no flatter than a beam"
)]
fn fixed(x: f32) -> i64 {
    (x * 4_294_967_296.0) as i64
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

use local_grid::{LaserRay, RangeSensor, Reading, Scan, SensorKind, SensorModel};
use nalgebra::{Isometry2, Vector2};

use crate::draw::Direction;
use crate::draw::cone::nearest;
use crate::draw::counts::{Counts, Line};
use crate::draw::window::Window;

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
    /// The farthest of them, in cells from the apex.
    reach: f32,
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
        let turned = |[dx, dy]: [f32; 2]| [re * dx - im * dy, im * dx + re * dy];
        let (x, y) = (single(within.x), single(within.y));
        let at = |[dx, dy]: [f32; 2], radius: f32| [x + radius * dx, y + radius * dy];
        self.corners.clear();
        self.echoes.clear();
        self.reach = 0.0;
        self.corners.push([x, y]);
        let n = fan.beams.len();
        let readings = scan.readings();
        let mut right = turned(fan.borders[0]);
        for (k, (beam, left)) in fan.beams.iter().zip(&fan.borders[1..]).enumerate() {
            let reading = readings[if fan.clockwise { n - 1 - k } else { k }];
            let (radius, echo) = reach(model, scan.sensor(), reading, resolution);
            let left = turned(*left);
            self.corners.extend([at(right, radius), at(left, radius)]);
            right = left;
            if let Some(range) = echo {
                self.echoes.push(at(turned(*beam), range));
            }
            let farthest = echo.unwrap_or(radius);
            self.reach = if farthest > self.reach { farthest } else { self.reach };
        }
    }

    /// Cells around all that a scan of the apex' cell can touch.
    fn around(&self, cell: (i32, i32)) -> ((i32, i32), (i32, i32)) {
        let reach = nearest(self.reach) + 2;
        ((cell.0 - reach, cell.1 - reach), (cell.0 + reach, cell.1 + reach))
    }

    /// Clears the inside of the polygon, `one` being what a scan counts.
    fn clear(&mut self, cleared: &mut Counts, cell: (i32, i32), one: i8) {
        let (low, high) = self.around(cell);
        self.cleared.open_near(low, high);
        let mut from = self.corners[self.corners.len() - 1];
        for &to in &self.corners {
            let (first, last) = (nearest(from[1]), nearest(to[1]));
            // Going up, the inside lies to the left and ends here; going down, it begins.
            let (rows, one) = if first < last { ((first, last), -one) } else { ((last, first), one) };
            if rows.0 < rows.1 {
                let slope = (to[0] - from[0]) / (to[1] - from[1]);
                let start = from[0] + (middle(rows.0) - from[1]) * slope + 0.5; // cells from there on lie to the right
                let line = Line::new(cell.1, start, slope);
                cleared.add_line(&mut self.cleared, (cell.0 + rows.0, index(rows.1 - rows.0)), line, one);
            }
            from = to;
        }
    }

    /// Hits the cells of the echoes, those of neighbours in one cell once.
    fn hit(&mut self, hit: &mut Counts, cell: (i32, i32), one: i8) {
        if self.echoes.is_empty() {
            return;
        }
        let (low, high) = self.around(cell);
        self.hit.open_near(low, high);
        let mut last = None;
        for [x, y] in &self.echoes {
            let (column, row) = (cell.1 + nearest(x - 0.5), cell.0 + nearest(y - 0.5));
            if last.replace((row, column)) != Some((row, column)) {
                hit.add(&mut self.hit, (row, column), one);
            }
        }
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

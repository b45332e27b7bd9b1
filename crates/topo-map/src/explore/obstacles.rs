use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use local_grid::{
    AngularProfile, Bayes, FrameError, GridFrame, LaserRay, Reading, Scan, SensorKind, SonarCone, WorkingGrid,
    WorkingGridOptions,
};
use nalgebra::{Isometry2, Point2, Vector2};

use super::ExploreError;

/// The body of the robot, and how it keeps away from things.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct ObstacleOptions {
    /// Radius of the body in metres.
    pub radius: f64,
    /// Metres that stay between the body and what is known to be an obstacle.
    pub margin: f64,
    /// Within so many metres of an obstacle the way is dearer, so that the robot keeps to the middle of a door.
    pub comfort: f64,
    /// A cell is an obstacle from this probability on.
    pub occupied: f32,
}

impl Default for ObstacleOptions {
    /// A Nomad 200.
    fn default() -> Self {
        Self { radius: 0.225, margin: 0.035, comfort: 0.5, occupied: 0.75 }
    }
}

impl ObstacleOptions {
    pub(super) fn check(&self) -> Result<(), ExploreError> {
        let lengths = [("obstacles.radius", self.radius), ("obstacles.comfort", self.comfort)];
        for (name, value) in lengths {
            if !(value > 0.0 && value < 2.0) {
                return Err(ExploreError::Option { name, range: "(0, 2) metres", value });
            }
        }
        if !(0.0..1.0).contains(&self.margin) {
            return Err(ExploreError::Option { name: "obstacles.margin", range: "[0, 1)", value: self.margin });
        }
        let occupied = f64::from(self.occupied);
        if !(0.5..1.0).contains(&occupied) {
            return Err(ExploreError::Option { name: "obstacles.occupied", range: "[0.5, 1)", value: occupied });
        }
        Ok(())
    }
}

/// What is in the robot's way: a small window of log-odds around it, and the ways through it.
///
/// It is apart from the grid that places are recognised by, because it asks another question: not "what is known", but
/// "where would I hit something". Beams are drawn narrower than they are, so that a door stays open; what later beams
/// pass through is no obstacle any more.
#[derive(Debug)]
pub(super) struct Obstacles {
    options: ObstacleOptions,
    window: WorkingGrid<Bayes>,
    /// Where the robot ran into something, the latest last.
    touched: VecDeque<Point2<f64>>,
    /// Where its centre has been of late, the latest last.
    trodden: VecDeque<Trodden>,
    sonar: SonarCone,
    laser: LaserRay,
}

/// Where the robot's centre has been.
#[derive(Debug, Clone, Copy)]
struct Trodden {
    at: Point2<f64>,
    /// Whether the robot has touched something since that would be in its way there.
    doubtful: bool,
    /// What a step there costs at most beyond its length.
    cost: f64,
}

/// The side of the window in metres, and of its cells.
const WINDOW: WorkingGridOptions = WorkingGridOptions { size: 6.4, resolution: 0.1 };
/// How many bumps are remembered.
const REMEMBERED: usize = 32;
/// The steps in which the robot's track is remembered, in metres...
const STEP: f64 = 0.05;
/// ...and how many of them: 12 m, over which dead reckoning tells where it was to about a cell. A robot that looks for a way
/// out of a nook still knows the one by which it came in.
const TRACK: usize = 240;
/// What a step through a cell costs beyond its length, where nothing is known of the cell.
const UNKNOWN: f64 = 0.3;
/// The same at an obstacle's very border, falling to nothing at the comfortable distance.
const CLOSE: f64 = 4.0;
/// The same where the body overlaps an obstacle, which is allowed only right where the robot stands.
const OVERLAP: f64 = 20.0;
/// How far from where it stands the robot may plan through overlaps, in metres: out of a false echo, not through a wall.
const ESCAPE: f64 = 0.3;

impl Obstacles {
    /// A window in which nothing is known.
    pub(super) fn new(options: ObstacleOptions) -> Self {
        let window = WorkingGrid::new(&WINDOW, Point2::origin()).expect("a window of 64 by 64 cells");
        let sonar = SonarCone {
            empty: 0.3,
            occupied: 0.5,
            depth: 0.1,
            visibility: 2.0,
            half_width: 7.5_f64.to_radians(),
            profile: AngularProfile::Parabola,
            ..SonarCone::default()
        };
        let (touched, trodden) = (VecDeque::new(), VecDeque::new());
        Self { options, window, touched, trodden, sonar, laser: LaserRay::default() }
    }

    /// Draws a scan taken where `track_from_robot` puts the robot.
    ///
    /// A sonar's shortest reading only says that something is nearer than it can measure, so it is left out.
    ///
    /// # Errors
    ///
    /// A pose that is not finite.
    pub(super) fn integrate(&mut self, track_from_robot: &Isometry2<f64>, scan: &Scan) -> Result<(), FrameError> {
        if scan.sensor().kind() != SensorKind::Sonar {
            return self.window.integrate(&self.laser, track_from_robot, scan);
        }
        let shortest = scan.sensor().min_range() * 1.02;
        let trusted = |reading: &Reading| match *reading {
            Reading::Echo(range) if f64::from(range) <= shortest => Reading::Invalid,
            reading => reading,
        };
        let readings = scan.readings().iter().map(trusted).collect::<Vec<_>>();
        let scan = Scan::new(scan.sensor().clone(), readings).expect("readings of a scan, or none");
        self.window.integrate(&self.sonar, track_from_robot, &scan)
    }

    /// All that was seen and touched is forgotten, but not where the robot has been: there it can go once more, and should
    /// before it tries ways that it does not know.
    pub(super) fn forget(&mut self) {
        let mut trodden = std::mem::take(&mut self.trodden);
        trodden.iter_mut().for_each(|trodden| (trodden.doubtful, trodden.cost) = (false, 0.0));
        *self = Self { trodden, ..Self::new(self.options) };
    }

    /// The robot's centre is at `point`: so its body fits there, whatever the echoes of a narrow gap say, until it bumps.
    pub(super) fn tread(&mut self, point: Point2<f64>) {
        if self.trodden.back().is_none_or(|last| (last.at - point).norm() >= STEP) {
            self.trodden.push_back(Trodden { at: point, doubtful: false, cost: CLOSE });
            if self.trodden.len() > TRACK {
                self.trodden.pop_front();
            }
        }
    }

    /// The robot touched something: `point` is an obstacle from now on, whatever the sensors say.
    pub(super) fn mark(&mut self, point: Point2<f64>) {
        let body = self.options.radius + self.options.margin;
        for trodden in &mut self.trodden {
            trodden.doubtful |= (trodden.at - point).norm() <= body + STEP;
        }
        self.touched.push_back(point);
        if self.touched.len() > REMEMBERED {
            self.touched.pop_front();
        }
    }

    /// A way for the robot's centre from `from` to within `tolerance` metres of `to`, or as near to it as obstacles allow,
    /// as points at most a cell apart; `None` if the robot cannot move at all.
    pub(super) fn way(&self, from: Point2<f64>, to: Point2<f64>, tolerance: f64) -> Option<Vec<Point2<f64>>> {
        let field = Field::new(self, from);
        field.way(to, tolerance)
    }

    /// The spot within `reach` metres of `around` that is farthest from all obstacles: the middle of a corridor, or of a
    /// door. Room beyond the comfortable distance counts for nothing, and of equal spots the nearest is taken.
    pub(super) fn roomiest(&self, from: Point2<f64>, around: Point2<f64>, reach: f64) -> Point2<f64> {
        let field = Field::new(self, from);
        let near = (0..field.cost.len()).map(|index| (field.center(index), field.cost[index]));
        let priced = near.filter(|(center, _)| (center - around).norm() <= reach).map(|(center, cost)| {
            let room = if cost.is_finite() { cost } else { OVERLAP };
            (room + (center - around).norm(), center)
        });
        let best = priced.min_by(|a, b| a.0.total_cmp(&b.0));
        let here = field.cost_at(around).unwrap_or(0.0);
        best.filter(|(price, _)| *price < here).map_or(around, |(_, center)| center)
    }

    /// The farthest point of `way`, at most `stride` metres off, to which the robot can go straight.
    pub(super) fn straight(&self, from: Point2<f64>, way: &[Point2<f64>], stride: f64) -> Option<Point2<f64>> {
        let field = Field::new(self, from);
        let reachable = |to: &&Point2<f64>| (**to - from).norm() <= stride && field.is_straight(**to);
        way.iter().rev().find(reachable).or(way.get(1)).or(way.first()).copied()
    }
}

/// What stepping into each cell costs per metre beyond the metre itself; infinite where the robot must not be.
struct Field {
    frame: GridFrame,
    cost: Vec<f64>,
    from: Point2<f64>,
}

/// A cell on the border of the search, cheapest first; costs in whole micrometres, so that they can be ordered.
type Reached = Reverse<(u64, usize)>;

impl Field {
    fn new(obstacles: &Obstacles, from: Point2<f64>) -> Self {
        let (grid, options) = (obstacles.window.grid(), obstacles.options);
        let frame = *grid.frame();
        let mut cost: Vec<f64> =
            grid.cells().iter().map(|cell| if cell.log_odds < -0.2 { 0.0 } else { UNKNOWN }).collect();
        let limit = (options.occupied / (1.0 - options.occupied)).ln();
        for (index, cell) in grid.cells().iter().enumerate() {
            if cell.log_odds >= limit {
                inflate(&frame, index, &options, &mut cost);
            }
        }
        for (row, column) in obstacles.touched.iter().filter_map(|&point| frame.cell_at(point)) {
            inflate(&frame, row * frame.columns() + column, &options, &mut cost);
        }
        for trodden in obstacles.trodden.iter().filter(|trodden| !trodden.doubtful) {
            if let Some((row, column)) = frame.cell_at(trodden.at) {
                let cost = &mut cost[row * frame.columns() + column];
                *cost = cost.min(trodden.cost);
            }
        }
        let mut field = Self { frame, cost, from };
        field.allow_escape();
        field
    }

    /// Right around the robot overlaps are dear, not forbidden.
    fn allow_escape(&mut self) {
        for index in 0..self.cost.len() {
            let center = self.center(index);
            let near = (center - self.from).norm() <= ESCAPE;
            if self.cost[index].is_infinite() && near {
                self.cost[index] = OVERLAP;
            }
        }
    }

    fn cost_at(&self, point: Point2<f64>) -> Option<f64> {
        self.frame.cell_at(point).map(|(row, column)| self.cost[row * self.frame.columns() + column])
    }

    fn center(&self, index: usize) -> Point2<f64> {
        self.frame.center(index / self.frame.columns(), index % self.frame.columns())
    }

    /// The cheapest way to within `tolerance` of `to`, or else to the reachable spot nearest to it.
    fn way(&self, to: Point2<f64>, tolerance: f64) -> Option<Vec<Point2<f64>>> {
        let (row, column) = self.frame.cell_at(self.from)?;
        let start = row * self.frame.columns() + column;
        let mut best = vec![u64::MAX; self.cost.len()];
        let mut came = vec![usize::MAX; self.cost.len()];
        let mut border: BinaryHeap<Reached> = BinaryHeap::from([Reverse((0, start))]);
        best[start] = 0;
        let mut nearest = (f64::INFINITY, start);
        // Half a cell's diagonal more, because cells have centres.
        let reach = tolerance.max(0.75 * self.frame.resolution());
        while let Some(Reverse((so_far, index))) = border.pop() {
            if so_far > best[index] {
                continue;
            }
            let left = (self.center(index) - to).norm();
            if self.cost[index] < OVERLAP && left < nearest.0 {
                nearest = (left, index);
                if left <= reach {
                    break;
                }
            }
            for (next, length) in self.neighbors(index) {
                let price = length * (1.0 + self.cost[next]);
                if !price.is_finite() {
                    continue;
                }
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "metres in a window")]
                let total = so_far + (price * 1e6) as u64;
                if total < best[next] {
                    best[next] = total;
                    came[next] = index;
                    border.push(Reverse((total, next)));
                }
            }
        }
        nearest.0.is_finite().then(|| self.retrace(start, nearest.1, &came))
    }

    fn neighbors(&self, index: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (rows, columns, edge) = (self.frame.rows(), self.frame.columns(), self.frame.resolution());
        let (row, column) = (index / columns, index % columns);
        const AROUND: [(isize, isize); 8] = [(0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)];
        AROUND.into_iter().filter_map(move |(up, right)| {
            let (row, column) = (row.checked_add_signed(up)?, column.checked_add_signed(right)?);
            let length = if up != 0 && right != 0 { edge * std::f64::consts::SQRT_2 } else { edge };
            (row < rows && column < columns).then_some((row * columns + column, length))
        })
    }

    fn retrace(&self, start: usize, goal: usize, came: &[usize]) -> Vec<Point2<f64>> {
        let (mut way, mut at) = (vec![self.center(goal)], goal);
        while at != start && came[at] != usize::MAX {
            at = came[at];
            way.push(self.center(at));
        }
        way.reverse();
        way[0] = self.from;
        way
    }

    /// Whether the straight line leads through cells that are no worse than close to something.
    fn is_straight(&self, to: Point2<f64>) -> bool {
        let way: Vector2<f64> = to - self.from;
        let mut along = 0.0;
        while along <= way.norm() {
            let point = self.from + way * (along / way.norm().max(1e-9));
            if self.cost_at(point).is_none_or(|cost| cost.is_infinite() || cost >= OVERLAP && along > ESCAPE) {
                return false;
            }
            along += 0.5 * self.frame.resolution();
        }
        true
    }
}

/// Makes the cells around an obstacle dear, and those where the body would overlap it impossible.
fn inflate(frame: &GridFrame, index: usize, options: &ObstacleOptions, cost: &mut [f64]) {
    let columns = frame.columns();
    let (row, column) = (index / columns, index % columns);
    let body = options.radius + options.margin;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be below 2 m")]
    let reach = (options.comfort.max(body) / frame.resolution()).ceil() as usize;
    for r in row.saturating_sub(reach)..(row + reach + 1).min(frame.rows()) {
        for c in column.saturating_sub(reach)..(column + reach + 1).min(columns) {
            let distance = (frame.center(r, c) - frame.center(row, column)).norm();
            let price = if distance < body {
                f64::INFINITY
            } else {
                CLOSE * ((options.comfort - distance) / (options.comfort - body).max(1e-6)).clamp(0.0, 1.0)
            };
            let known = &mut cost[r * columns + c];
            *known = known.max(price);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How near to the beginning of its track a robot can come, and how far beside it, that drove 2 m and then touched a wall
    /// across it, 3.2 m wide.
    fn left_after(touched: bool, forgotten: bool) -> (f64, f64) {
        let mut obstacles = Obstacles::new(ObstacleOptions::default());
        (0..=40).for_each(|step| obstacles.tread(Point2::new(0.05 * f64::from(step), 0.0)));
        if touched {
            (-8..=8).for_each(|step| obstacles.mark(Point2::new(1.0, 0.2 * f64::from(step))));
        }
        if forgotten {
            obstacles.forget();
        }
        let way = obstacles.way(Point2::new(2.0, 0.0), Point2::origin(), 0.0).unwrap();
        let astray = way.iter().map(|point| point.y.abs()).fold(0.0, f64::max);
        (way.last().unwrap().coords.norm(), astray)
    }

    #[test]
    fn a_robot_that_forgets_what_it_touched_goes_back_as_it_came() {
        assert!(left_after(false, false).0 < 0.1);
        let (left, astray) = left_after(true, false);
        assert!(left > 1.0 || astray > 1.5, "what it touched is in its way: {left} {astray}");
        let (left, astray) = left_after(true, true);
        assert!(left < 0.1 && astray < 0.1, "{left} {astray}");
    }
}

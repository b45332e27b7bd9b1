use std::cmp::Ordering;
use std::collections::BinaryHeap;

use local_grid::Grid;
use local_grid::nalgebra::Point2;

use super::{Path, PlanError, PlanOptions};

/// A cell to look at, and the least that a path over it can cost.
struct Candidate {
    bound: f64,
    cost: f64,
    cell: usize,
}

impl Ord for Candidate {
    /// The cheapest first; of equal ones that which has come farther, then the one that lies first, so that the result
    /// does not depend on chance.
    fn cmp(&self, other: &Self) -> Ordering {
        let cheaper = other.bound.total_cmp(&self.bound);
        cheaper.then(self.cost.total_cmp(&other.cost)).then(other.cell.cmp(&self.cell))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

/// The cells around a cell: rows up, columns right, and the length of the step in cells.
const NEIGHBOURS: [(isize, isize, f64); 8] = {
    const DIAGONAL: f64 = std::f64::consts::SQRT_2;
    [
        (0, 1, 1.0),
        (1, 0, 1.0),
        (0, -1, 1.0),
        (-1, 0, 1.0),
        (1, 1, DIAGONAL),
        (1, -1, DIAGONAL),
        (-1, -1, DIAGONAL),
        (-1, 1, DIAGONAL),
    ]
};

/// The cheapest ways from a cell to others (Dijkstra).
pub(super) struct Flood {
    start: usize,
    pub(super) costs: Grid<f64>,
    came_from: Vec<u32>,
}

impl Flood {
    /// Floods from a cell, until `enough` says so of a cell whose cheapest way is found; what lies farther keeps no cost, or
    /// one that is too high.
    pub(super) fn from(
        unsafety: &Grid<f32>,
        from: (usize, usize),
        options: &PlanOptions,
        mut enough: impl FnMut(usize) -> bool,
    ) -> Self {
        let frame = unsafety.frame();
        let start = from.0 * frame.columns() + from.1;
        let mut flood =
            Self { start, costs: unsafety.map(|_| f64::INFINITY), came_from: vec![u32::MAX; frame.n_cells()] };
        let mut open = BinaryHeap::new();
        flood.costs.cells_mut()[start] = 0.0;
        open.push(Candidate { bound: 0.0, cost: 0.0, cell: start });
        while let Some(Candidate { cost, cell, .. }) = open.pop() {
            if cost > flood.costs.cells()[cell] {
                continue; // a cheaper way was found meanwhile
            }
            if enough(cell) {
                break;
            }
            for (next, length) in steps(unsafety, cell, options) {
                let cost = cost + step_cost(unsafety, next, length, options);
                if cost < flood.costs.cells()[next] {
                    flood.costs.cells_mut()[next] = cost;
                    flood.came_from[next] = narrow(cell);
                    open.push(Candidate { bound: cost, cost, cell: next });
                }
            }
        }
        flood
    }

    /// The way to a cell, if the flood came so far.
    pub(super) fn way(&self, unsafety: &Grid<f32>, to: usize, options: &PlanOptions) -> Option<Path> {
        let reached = self.costs.cells()[to].is_finite();
        reached.then(|| trace(unsafety, &self.came_from, (self.start, to), options))
    }
}

/// What it costs to enter a cell by a step of so many cells.
fn step_cost(unsafety: &Grid<f32>, next: usize, length: f64, options: &PlanOptions) -> f64 {
    length * unsafety.frame().resolution() * (1.0 + options.risk_weight * f64::from(unsafety.cells()[next]))
}

fn narrow(cell: usize) -> u32 {
    u32::try_from(cell).expect("a grid has at most 2³² cells")
}

/// A* from cell to cell over an unsafety map.
pub(super) fn search(
    unsafety: &Grid<f32>,
    from: (usize, usize),
    to: (usize, usize),
    options: &PlanOptions,
) -> Result<Path, PlanError> {
    let frame = unsafety.frame();
    let (resolution, columns) = (frame.resolution(), frame.columns());
    let (start, goal) = (from.0 * columns + from.1, to.0 * columns + to.1);
    let mut costs = vec![f64::INFINITY; frame.n_cells()];
    let mut came_from = vec![u32::MAX; frame.n_cells()];
    let mut open = BinaryHeap::new();
    let left = |cell: usize| distance((cell / columns, cell % columns), to) * resolution;
    costs[start] = 0.0;
    open.push(Candidate { bound: left(start), cost: 0.0, cell: start });
    while let Some(Candidate { cost, cell, .. }) = open.pop() {
        if cell == goal {
            return Ok(trace(unsafety, &came_from, (start, goal), options));
        }
        if cost > costs[cell] {
            continue; // a cheaper way was found meanwhile
        }
        for (next, length) in steps(unsafety, cell, options) {
            let cost = cost + step_cost(unsafety, next, length, options);
            if cost < costs[next] {
                costs[next] = cost;
                came_from[next] = narrow(cell);
                open.push(Candidate { bound: cost + left(next), cost, cell: next });
            }
        }
    }
    let reached = costs.iter().filter(|cost| cost.is_finite()).count();
    let near = (0..costs.len()).filter(|&cell| costs[cell].is_finite()).map(left).fold(f64::INFINITY, f64::min);
    Err(PlanError::Unreachable { reached, nearest: near })
}

/// The cells that can be entered from a cell, and the lengths of the steps in cells. Corners are not cut.
fn steps(unsafety: &Grid<f32>, cell: usize, options: &PlanOptions) -> impl Iterator<Item = (usize, f64)> {
    let columns = unsafety.frame().columns();
    let (row, column) = (cell / columns, cell % columns);
    let allowed = move |dy: isize, dx: isize| -> Option<usize> {
        let (row, column) = (row.checked_add_signed(dy)?, column.checked_add_signed(dx)?);
        let risk = unsafety.get(row, column)?;
        (f64::from(*risk) <= options.forbidden + 1e-6).then_some(row * columns + column)
    };
    NEIGHBOURS.into_iter().filter_map(move |(dy, dx, length)| {
        let next = allowed(dy, dx)?;
        let straight = dy == 0 || dx == 0;
        (straight || (allowed(dy, 0).is_some() && allowed(0, dx).is_some())).then_some((next, length))
    })
}

/// The straight distance between cells, in cells.
fn distance(a: (usize, usize), b: (usize, usize)) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "rows and columns of a grid")]
    let (dy, dx) = (a.0.abs_diff(b.0) as f64, a.1.abs_diff(b.1) as f64);
    dy.hypot(dx)
}

/// Follows the way back from the goal.
fn trace(unsafety: &Grid<f32>, came_from: &[u32], (start, goal): (usize, usize), options: &PlanOptions) -> Path {
    let frame = unsafety.frame();
    let mut cells = vec![goal];
    while let Some(&cell) = cells.last().filter(|&&cell| cell != start) {
        cells.push(came_from[cell] as usize);
    }
    cells.reverse();
    let points = cells.iter().map(|cell| frame.center(cell / frame.columns(), cell % frame.columns())).collect();
    Path::along(unsafety, points, options)
}

impl Path {
    /// What a way from cell to cell costs: `points` are the centres of its cells, each next to the one before.
    #[must_use]
    pub fn along(unsafety: &Grid<f32>, points: Vec<Point2<f64>>, options: &PlanOptions) -> Self {
        let risk_at = |point: &Point2<f64>| unsafety.at(*point).map_or(1.0, |risk| f64::from(*risk));
        let (mut length, mut cost) = (0.0, 0.0);
        for pair in points.windows(2) {
            let step = (pair[1] - pair[0]).norm();
            length += step;
            cost += step * (1.0 + options.risk_weight * risk_at(&pair[1]));
        }
        let risk = points.iter().map(risk_at).fold(0.0, f64::max);
        Self { points, length, cost, risk }
    }
}

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use local_grid::Grid;

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

/// The cost of the cheapest way from a cell to every cell, infinite where none leads (Dijkstra).
pub(super) fn costs(unsafety: &Grid<f32>, from: (usize, usize), options: &PlanOptions) -> Grid<f64> {
    let frame = unsafety.frame();
    let start = from.0 * frame.columns() + from.1;
    let mut costs = unsafety.map(|_| f64::INFINITY);
    let mut open = BinaryHeap::new();
    costs.cells_mut()[start] = 0.0;
    open.push(Candidate { bound: 0.0, cost: 0.0, cell: start });
    while let Some(Candidate { cost, cell, .. }) = open.pop() {
        if cost > costs.cells()[cell] {
            continue; // a cheaper way was found meanwhile
        }
        for (next, length) in steps(unsafety, cell, options) {
            let risk = f64::from(unsafety.cells()[next]);
            let cost = cost + length * frame.resolution() * (1.0 + options.risk_weight * risk);
            if cost < costs.cells()[next] {
                costs.cells_mut()[next] = cost;
                open.push(Candidate { bound: cost, cost, cell: next });
            }
        }
    }
    costs
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
            return Ok(trace(unsafety, &came_from, (start, goal), cost));
        }
        if cost > costs[cell] {
            continue; // a cheaper way was found meanwhile
        }
        for (next, length) in steps(unsafety, cell, options) {
            let risk = f64::from(unsafety.cells()[next]);
            let cost = cost + length * resolution * (1.0 + options.risk_weight * risk);
            if cost < costs[next] {
                costs[next] = cost;
                came_from[next] = u32::try_from(cell).expect("a grid has at most 2³² cells");
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
fn trace(unsafety: &Grid<f32>, came_from: &[u32], (start, goal): (usize, usize), cost: f64) -> Path {
    let frame = unsafety.frame();
    let mut cells = vec![goal];
    while let Some(&cell) = cells.last().filter(|&&cell| cell != start) {
        cells.push(came_from[cell] as usize);
    }
    cells.reverse();
    let points: Vec<_> =
        cells.iter().map(|cell| frame.center(cell / frame.columns(), cell % frame.columns())).collect();
    let length = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let risk = cells.iter().map(|&cell| f64::from(unsafety.cells()[cell])).fold(0.0, f64::max);
    Path { points, length, cost, risk }
}

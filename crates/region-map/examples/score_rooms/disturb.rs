//! Plans as another drawer, sensor or resolution would have them.

use region_map::{
    local_grid::{Grid, GridFrame},
    nalgebra::{Isometry2, Point2, Vector2},
};

/// A plan and its rooms: membership in "free", and the number of the room of each cell, 0 for none.
#[derive(Clone)]
pub(crate) struct Plan {
    pub(crate) free: Grid<f32>,
    pub(crate) truth: Vec<u32>,
}

/// A way to disturb a plan.
pub(crate) type Disturbance = fn(&Plan) -> Plan;

/// All of them, by what they are called.
pub(crate) const DISTURBANCES: [(&str, Disturbance); 7] = [
    ("as drawn", Plan::clone),
    ("turned by 33°", |plan| turned(plan, 33.0)),
    ("2 % salt", |plan| salted(plan, 0.02)),
    ("0.1 m cells", |plan| coarser(plan, 2)),
    ("0.15 m cells", |plan| coarser(plan, 3)),
    ("0.2 m cells", |plan| coarser(plan, 4)),
    ("blurred by 0.15 m, ± 0.2", blurred),
];

/// The plan turned about its middle, in a frame that holds all of it; each cell is what lies under its middle.
fn turned(plan: &Plan, degrees: f64) -> Plan {
    let from = *plan.free.frame();
    let size = Vector2::new(from.columns() as f64, from.rows() as f64) * from.resolution();
    let middle = from.origin() + size / 2.0;
    let half = Vector2::repeat(size.norm() / 2.0);
    let frame = GridFrame::covering(middle - half, middle + half, from.resolution()).expect("hardly larger");
    let turn = Isometry2::rotation(degrees.to_radians()).inverse();
    let under = |index: usize| {
        let at = frame.center(index / frame.columns(), index % frame.columns());
        let (row, column) = from.cell_at(middle + turn * (at - middle))?;
        from.index(row, column)
    };
    let pick = |index: usize| under(index).map_or((0.0, 0), |cell| (plan.free.cells()[cell], plan.truth[cell]));
    let (free, truth) = (0..frame.n_cells()).map(pick).unzip();
    Plan { free: Grid::from_cells(frame, free).expect("a cell for each"), truth }
}

/// So many of all cells are what they are not, free or wall, scattered without a pattern but always the same.
fn salted(plan: &Plan, share: f32) -> Plan {
    let mut noise = Noise(1);
    let mut salted = plan.clone();
    for cell in salted.free.cells_mut().iter_mut().filter(|_| noise.next() < share) {
        *cell = 1.0 - *cell;
    }
    salted
}

/// Squares of `side` cells become one: wall if a quarter of it is wall, and of the room that most of it is of.
fn coarser(plan: &Plan, side: usize) -> Plan {
    let from = *plan.free.frame();
    let (rows, columns) = (from.rows() / side, from.columns() / side);
    let frame = GridFrame::new(Point2::origin(), from.resolution() * side as f64, rows, columns).expect("coarser");
    let square = |index: usize| {
        let (row, column) = (index / columns * side, index % columns * side);
        let cells = (row..row + side).flat_map(move |row| (column..column + side).map(move |column| (row, column)));
        let cells: Vec<usize> = cells.map(|(row, column)| row * from.columns() + column).collect();
        let wall = cells.iter().filter(|cell| plan.free.cells()[**cell] < 0.5).count();
        let room = cells.iter().map(|cell| plan.truth[*cell]);
        let most = room.clone().max_by_key(|room| cells.iter().filter(|cell| plan.truth[**cell] == *room).count());
        (f32::from(u8::from(4 * wall < cells.len())), most.unwrap_or(0))
    };
    let (free, truth) = (0..rows * columns).map(square).unzip();
    Plan { free: Grid::from_cells(frame, free).expect("a cell for each"), truth }
}

/// The mean of 3 × 3 cells and a little noise: degrees, as a robot's map holds them.
fn blurred(plan: &Plan) -> Plan {
    let (columns, mut noise) = (plan.free.frame().columns(), Noise(1));
    let cells = plan.free.cells();
    let mut blurred = plan.clone();
    for (index, cell) in blurred.free.cells_mut().iter_mut().enumerate() {
        let around = [0, columns, 2 * columns].into_iter().flat_map(|down| (0..3).map(move |right| down + right));
        let around = around.filter_map(|step| cells.get((index + step).checked_sub(columns + 1)?));
        let mean = around.clone().sum::<f32>() / around.count().max(1) as f32;
        *cell = (mean + 0.4 * (noise.next() - 0.5)).clamp(0.0, 1.0);
    }
    blurred
}

/// Numbers in [0, 1) without a pattern that matters here (a linear congruence, Knuth 1998).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f32::from(u16::try_from(self.0 >> 48).unwrap_or(u16::MAX)) / 65536.0
    }
}

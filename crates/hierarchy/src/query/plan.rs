use std::cmp::Reverse;
use std::collections::BinaryHeap;

use global_grid::plan::{Path, PlanError, PlanOptions, costs_from, plan, plan_over, unsafety};
use nalgebra::{Point2, Vector2};
use region_map::{Gateway, RegionMap};
use robot_log::local_grid::{FuzzyGrid, Grid, GridFrame};
use topo_map::PlaceId;

use crate::mapper::Mapper;

/// Plans from the top down: through which regions, then through which cells of these.
///
/// What ways through a region cost, from gateway to gateway, is computed once. A plan then searches the graph of gateways,
/// and the cells of the regions on the way alone: far fewer than those of the map.
#[derive(Debug)]
pub struct Planner<'a> {
    gridmap: &'a FuzzyGrid,
    map: &'a RegionMap,
    options: PlanOptions,
    unsafety: Grid<f32>,
    windows: Vec<Window>,
    /// Where each gateway is passed best; `None` where nobody can pass.
    doors: Vec<Option<Point2<f64>>>,
    /// For each gateway those that can be reached from it through one region, that region, and the cost.
    legs: Vec<Vec<(usize, u16, f64)>>,
}

/// A way over all levels.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Labels of the regions in order; empty where the way does not keep to regions.
    pub regions: Vec<u16>,
    /// Indices of the gateways between them.
    pub gateways: Vec<usize>,
    /// The way over the cells.
    pub path: Path,
}

/// Why there is no way.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RouteError {
    /// There is none over the cells.
    #[error(transparent)]
    Cells(#[from] PlanError),
    /// Every way leads through a closed gateway.
    #[error("every way from the start to the goal leads through a closed gateway; closed are {0:?}")]
    Closed(Vec<usize>),
}

/// The cells that hold a region: rows and columns, first and one past the last.
#[derive(Debug, Clone, Copy)]
struct Window {
    rows: [usize; 2],
    columns: [usize; 2],
}

impl Window {
    const EMPTY: Self = Self { rows: [usize::MAX, 0], columns: [usize::MAX, 0] };

    fn join(self, other: Self) -> Self {
        let join = |a: [usize; 2], b: [usize; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self { rows: join(self.rows, other.rows), columns: join(self.columns, other.columns) }
    }
}

/// A closed gateway is shut this far to both sides of its line, in metres; a gateway belongs to both of its regions as far.
const SILL: f64 = 0.3;

impl<'a> Planner<'a> {
    /// Prepares plans over a gridmap and its regions.
    ///
    /// # Errors
    ///
    /// Options that make no sense.
    pub fn new(gridmap: &'a FuzzyGrid, map: &'a RegionMap, options: &PlanOptions) -> Result<Self, PlanError> {
        let mut unsafety = unsafety(gridmap, options)?;
        map.gateways.iter().filter(|gateway| gateway.blocked).for_each(|gateway| shut(&mut unsafety, gateway));
        let passable = |gateway: &Gateway| (!gateway.blocked).then(|| door(&unsafety, gateway, options)).flatten();
        let doors = map.gateways.iter().map(passable).collect();
        let legs = vec![Vec::new(); map.gateways.len()];
        let windows = windows(map);
        let mut planner = Self { gridmap, map, options: options.clone(), unsafety, windows, doors, legs };
        planner.legs = (0..map.gateways.len()).map(|gateway| planner.legs_from(gateway)).collect();
        Ok(planner)
    }

    /// The way from a start to a goal.
    ///
    /// Where start and goal lie in regions and a chain of open gateways joins them, the way keeps to the regions of the
    /// cheapest chain; else it is searched over all cells.
    ///
    /// # Errors
    ///
    /// No way, and why.
    pub fn plan(&self, start: Point2<f64>, goal: Point2<f64>) -> Result<Plan, RouteError> {
        if let Some((regions, gateways)) = self.chain(start, goal) {
            let cells = self.part(&regions);
            if let Some(path) = plan_over(&cells, start, goal, &self.options) {
                return Ok(Plan { regions, gateways, path });
            }
        }
        match plan_over(&self.unsafety, start, goal, &self.options) {
            Some(path) => Ok(Plan { regions: Vec::new(), gateways: Vec::new(), path }),
            None => {
                plan(self.gridmap, start, goal, &self.options)?; // says why, if it is not for a closed gateway
                let closed = self.map.gateways.iter().enumerate().filter(|(_, gateway)| gateway.blocked);
                Err(RouteError::Closed(closed.map(|(index, _)| index).collect()))
            }
        }
    }

    /// The cheapest chain of regions and gateways (Dijkstra over the gateways).
    fn chain(&self, start: Point2<f64>, goal: Point2<f64>) -> Option<(Vec<u16>, Vec<usize>)> {
        let (from, to) = (self.map.region_at(start)?.label, self.map.region_at(goal)?.label);
        if from == to {
            return Some((vec![from], Vec::new()));
        }
        let (first, last) = (self.to_exits(start, from)?, self.to_exits(goal, to)?);
        let mut costs = vec![f64::INFINITY; self.doors.len()];
        let mut came: Vec<Option<(usize, u16)>> = vec![None; self.doors.len()];
        let mut open = BinaryHeap::new();
        for (gateway, cost) in first {
            costs[gateway] = cost;
            open.push(Reverse((Ordered(cost), gateway)));
        }
        while let Some(Reverse((Ordered(cost), gateway))) = open.pop() {
            if cost > costs[gateway] {
                continue;
            }
            for &(next, region, leg) in &self.legs[gateway] {
                if cost + leg < costs[next] {
                    costs[next] = cost + leg;
                    came[next] = Some((gateway, region));
                    open.push(Reverse((Ordered(cost + leg), next)));
                }
            }
        }
        let total = |(gateway, cost): &(usize, f64)| costs[*gateway] + cost;
        let best = last.iter().min_by(|a, b| total(a).total_cmp(&total(b))).filter(|best| total(best).is_finite())?;
        let (mut regions, mut gateways) = (vec![to], vec![best.0]);
        while let Some((before, region)) = came[gateways[gateways.len() - 1]] {
            regions.push(region);
            gateways.push(before);
        }
        regions.push(from);
        regions.reverse();
        gateways.reverse();
        Some((regions, gateways))
    }

    /// What it costs from a point to the gateways of its region.
    fn to_exits(&self, point: Point2<f64>, region: u16) -> Option<Vec<(usize, f64)>> {
        let costs = costs_from(&self.part(&[region]), point, &self.options)?;
        let cost = |(gateway, _): (usize, u16)| Some((gateway, *costs.at(self.doors[gateway]?)?));
        Some(self.map.exits(region).filter_map(cost).filter(|(_, cost)| cost.is_finite()).collect())
    }

    fn legs_from(&self, gateway: usize) -> Vec<(usize, u16, f64)> {
        let Some(door) = self.doors[gateway] else { return Vec::new() };
        let legs = self.map.gateways[gateway].regions.into_iter().flat_map(|region| {
            let exits = self.to_exits(door, region).unwrap_or_default();
            exits.into_iter().map(move |(next, cost)| (next, region, cost))
        });
        legs.filter(|(next, ..)| *next != gateway).collect()
    }

    /// The unsafety of the cells of some regions and of their gateways; all else is out of bounds.
    fn part(&self, regions: &[u16]) -> Grid<f32> {
        let frame = self.unsafety.frame();
        let window = regions.iter().map(|label| self.windows[usize::from(*label)]).fold(Window::EMPTY, Window::join);
        let sill = cells(2.0 * SILL, frame.resolution());
        let grown = |[first, last]: [usize; 2], most: usize| [first.saturating_sub(sill), (last + sill).min(most)];
        let [rows, columns] = [grown(window.rows, frame.rows()), grown(window.columns, frame.columns())];
        #[expect(clippy::cast_precision_loss, reason = "rows and columns of a grid")]
        let corner = Vector2::new(columns[0] as f64, rows[0] as f64) * frame.resolution();
        let part =
            GridFrame::new(frame.origin() + corner, frame.resolution(), rows[1] - rows[0], columns[1] - columns[0])
                .expect("a part of a grid is a grid");
        let mut part_of = Grid::<f32>::new(part);
        for row in rows[0]..rows[1] {
            for column in columns[0]..columns[1] {
                let index = row * frame.columns() + column;
                let inside = regions.contains(&self.map.labels.cells()[index]);
                part_of.cells_mut()[(row - rows[0]) * part.columns() + column - columns[0]] =
                    if inside { self.unsafety.cells()[index] } else { 1.0 };
            }
        }
        for (index, gateway) in self.map.gateways.iter().enumerate() {
            if let Some(door) = self.doors[index].filter(|_| gateway.regions.iter().any(|side| regions.contains(side)))
            {
                self.open(&mut part_of, door);
            }
        }
        part_of
    }

    /// Opens the cells around a door, whichever region they were given to.
    fn open(&self, cells: &mut Grid<f32>, door: Point2<f64>) {
        around(*cells.frame(), door, SILL, |row, column, point| {
            if let (Some(cell), Some(unsafety)) = (cells.get_mut(row, column), self.unsafety.at(point)) {
                *cell = *unsafety;
            }
        });
    }
}

/// So many cells are at least this long.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and saturating")]
fn cells(length: f64, resolution: f64) -> usize {
    (length / resolution).ceil() as usize
}

/// A cost that can be compared.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ordered(f64);

impl Eq for Ordered {}

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// The windows of all labels, 0 included.
fn windows(map: &RegionMap) -> Vec<Window> {
    let columns = map.labels.frame().columns();
    let mut windows = vec![Window::EMPTY; map.regions.len() + 1];
    for (index, &label) in map.labels.cells().iter().enumerate().filter(|(_, label)| **label > 0) {
        let (row, column) = (index / columns, index % columns);
        let cell = Window { rows: [row, row + 1], columns: [column, column + 1] };
        windows[usize::from(label)] = windows[usize::from(label)].join(cell);
    }
    windows
}

/// Points along a gateway, a quarter of a cell apart.
fn along(gateway: &Gateway, resolution: f64) -> impl Iterator<Item = Point2<f64>> {
    let [a, b] = gateway.ends;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and saturating")]
    let steps = ((b - a).norm() / resolution * 4.0).ceil().max(1.0) as u32;
    (0..=steps).map(move |step| a + (b - a) * (f64::from(step) / f64::from(steps)))
}

/// The safest point of a gateway, nearest to its middle; `None` where nobody can pass.
fn door(unsafety: &Grid<f32>, gateway: &Gateway, options: &PlanOptions) -> Option<Point2<f64>> {
    let risk = |point: &Point2<f64>| unsafety.at(*point).copied().map_or(f64::INFINITY, f64::from);
    let key = |point: &Point2<f64>| (Ordered(risk(point)), Ordered((point - gateway.center).norm()));
    let best = along(gateway, unsafety.frame().resolution()).min_by_key(key)?;
    (risk(&best) <= options.forbidden).then_some(best)
}

/// Makes a gateway impassable.
fn shut(unsafety: &mut Grid<f32>, gateway: &Gateway) {
    let frame = *unsafety.frame();
    for point in along(gateway, frame.resolution()) {
        around(frame, point, (0.5 * SILL).max(frame.resolution()), |row, column, _| {
            if let Some(cell) = unsafety.get_mut(row, column) {
                *cell = 1.0;
            }
        });
    }
}

/// Visits the cells whose centres are within `reach` of a point.
fn around(frame: GridFrame, point: Point2<f64>, reach: f64, mut visit: impl FnMut(usize, usize, Point2<f64>)) {
    let Some((row, column)) = frame.cell_at(point) else { return };
    let cells = cells(reach, frame.resolution());
    for row in row.saturating_sub(cells)..(row + cells + 1).min(frame.rows()) {
        for column in column.saturating_sub(cells)..(column + cells + 1).min(frame.columns()) {
            let center = frame.center(row, column);
            if (center - point).norm() <= reach {
                visit(row, column, center);
            }
        }
    }
}

/// A place belongs to a way that passes it within this distance, in metres.
const PASSED: f64 = 1.0;

impl Mapper {
    /// The visited places that a way passes, in order: the nearest one to each of its points.
    #[must_use]
    pub fn places_along(&self, path: &[Point2<f64>]) -> Vec<PlaceId> {
        let places = self.visited_poses();
        let mut passed = Vec::new();
        for point in path {
            let apart = |pose: &nalgebra::Isometry2<f64>| (pose.translation.vector - point.coords).norm();
            let nearest = places.iter().min_by(|a, b| apart(&a.1).total_cmp(&apart(&b.1)));
            if let Some((place, _)) = nearest.filter(|(_, pose)| apart(pose) <= PASSED)
                && passed.last() != Some(place)
            {
                passed.push(*place);
            }
        }
        passed
    }
}

//! Plans from the top down.

mod crossings;
mod doors;
mod legs;
mod pieces;
mod places;
mod prepare;
mod straighten;
mod way;

use global_grid::plan::{Path, PlanError, PlanOptions, plan, plan_over, unsafety, ways_from};
use nalgebra::Point2;
use region_map::RegionMap;
use robot_log::local_grid::{FuzzyGrid, Grid};

use crossings::crossings;
use doors::{Door, gateways, shut};
use legs::{Chain, Leg};
use pieces::Pieces;
use straighten::Ground;
use way::{Way, cells_of, centers};

/// Plans from the top down: through which regions, then over which cells of these.
///
/// The cheapest ways through a region, from gateway to gateway, are found once. A plan then searches the graph of gateways,
/// and the cells around start and goal alone: far fewer than those of the map. Large regions are cut into pieces with
/// crossings between them, which count as gateways within; where the ways through gateways and crossings join they are made
/// straight, if that is as safe. (Hierarchical path finding after Botea, Müller and Schaeffer 2004, over rooms instead of
/// squares.)
#[derive(Debug)]
pub struct Planner<'a> {
    gridmap: &'a FuzzyGrid,
    map: &'a RegionMap,
    options: PlanOptions,
    unsafety: Grid<f32>,
    pieces: Pieces,
    doors: Vec<Door>,
    /// The doors of each piece.
    exits: Vec<Vec<usize>>,
    /// What leads on from each door.
    legs: Vec<Vec<Leg>>,
    ways: Vec<Way>,
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

/// Ways shorter than this, in metres, are searched again over the cells: a detour of half a metre is 5 % of it.
const SHORT: f64 = 12.0;

/// A point, the piece of a region in which it lies, and the ways from there to the doors of that piece.
struct End {
    region: u16,
    ways: Vec<(usize, Path)>,
}

impl End {
    fn costs(&self) -> Vec<(usize, f64)> {
        self.ways.iter().map(|(door, path)| (*door, path.cost)).collect()
    }

    fn way(&self, door: usize) -> &[Point2<f64>] {
        self.ways.iter().find(|(to, _)| *to == door).map_or(&[], |(_, path)| &path.points)
    }
}

impl<'a> Planner<'a> {
    /// Prepares plans over a gridmap and its regions.
    ///
    /// # Errors
    ///
    /// Options that make no sense.
    pub fn new(gridmap: &'a FuzzyGrid, map: &'a RegionMap, options: &PlanOptions) -> Result<Self, PlanError> {
        let mut unsafety = unsafety(gridmap, options)?;
        map.gateways.iter().filter(|gateway| gateway.blocked).for_each(|gateway| shut(&mut unsafety, gateway));
        let pieces = Pieces::of(map);
        let mut doors = gateways(&unsafety, map, options);
        doors.extend(crossings(&unsafety, map, &pieces, options));
        let (exits, legs, ways) = (Vec::new(), Vec::new(), Vec::new());
        let mut planner = Self { gridmap, map, options: options.clone(), unsafety, pieces, doors, exits, legs, ways };
        planner.prepare();
        Ok(planner)
    }

    /// The way from a start to a goal.
    ///
    /// Where start and goal lie in regions and a chain of open gateways joins them, the way keeps to the regions of the
    /// cheapest chain, but for corners that are cut where it is made straight; else it is searched over all cells. The first
    /// may be a few hundredths longer than the cheapest way over all cells, unless it is short.
    ///
    /// # Errors
    ///
    /// No way, and why.
    pub fn plan(&self, start: Point2<f64>, goal: Point2<f64>) -> Result<Plan, RouteError> {
        if let Some(plan) = self.within(start, goal) {
            return Ok(plan);
        }
        if let Some(plan) = self.through(start, goal) {
            return Ok(self.shortened(plan, start, goal));
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

    /// The way between two points of one region, over all its cells.
    fn within(&self, start: Point2<f64>, goal: Point2<f64>) -> Option<Plan> {
        let region = self.map.region_at(start)?.label;
        if region != self.map.region_at(goal)?.label {
            return None;
        }
        let exits = (0..self.doors.len()).filter(|&door| self.doors[door].regions.contains(&region));
        let cells = self.part(self.pieces.region(region), &exits.collect::<Vec<_>>());
        let path = plan_over(&cells, self.centered(start)?, self.centered(goal)?, &self.options)?;
        // Centres of the part's cells differ in the last digit.
        let points = centers(&cells_of(&path.points, self.unsafety.frame()), self.unsafety.frame());
        let path = Path::along(&self.unsafety, points, &self.options);
        Some(Plan { regions: vec![region], gateways: Vec::new(), path })
    }

    /// The way through the cheapest chain of doors between two regions.
    fn through(&self, start: Point2<f64>, goal: Point2<f64>) -> Option<Plan> {
        let (from, to) = (self.end(start)?, self.end(goal)?);
        let chain = Chain::cheapest((&self.doors, &self.legs), &from.costs(), &to.costs(), goal)?;
        let (regions, gateways) = self.regions_of(&chain, &from, &to);
        Some(Plan { regions, gateways, path: self.join(&chain, &from, &to) })
    }

    /// A short plan as cheap as the cells of its regions allow: there the half metre counts that a door's or a crossing's fixed
    /// cell may lie aside, and a search over all cells looks at few of them.
    fn shortened(&self, mut plan: Plan, start: Point2<f64>, goal: Point2<f64>) -> Plan {
        if plan.path.length < SHORT {
            let keeps = |point: &Point2<f64>| {
                self.map.region_at(*point).is_none_or(|region| plan.regions.contains(&region.label))
            };
            let least = plan_over(&self.unsafety, start, goal, &self.options);
            let cheaper = least.filter(|least| least.cost < plan.path.cost && least.points.iter().all(keeps));
            plan.path = cheaper.unwrap_or(plan.path);
        }
        plan
    }

    /// The ways from a point to the doors of its piece.
    fn end(&self, point: Point2<f64>) -> Option<End> {
        let region = self.map.region_at(point)?.label;
        let (row, column) = self.unsafety.frame().cell_at(point)?;
        let piece = self.pieces.at(region, row, column);
        let exits = &self.exits[piece];
        let points: Vec<Point2<f64>> = exits.iter().map(|&exit| self.doors[exit].point).collect();
        let cells = self.part(self.pieces.pieces[piece], exits);
        let ways = ways_from(&cells, self.centered(point)?, &points, &self.options);
        let found = exits.iter().zip(ways).filter_map(|(&exit, way)| Some((exit, way?)));
        Some(End { region, ways: found.collect() })
    }

    /// The centre of a point's cell: a point on the border of two cells may be rounded to the other one in a part of the map.
    fn centered(&self, point: Point2<f64>) -> Option<Point2<f64>> {
        let frame = self.unsafety.frame();
        frame.cell_at(point).map(|(row, column)| frame.center(row, column))
    }

    /// The regions of a chain, and the gateways between them.
    fn regions_of(&self, chain: &Chain, from: &End, to: &End) -> (Vec<u16>, Vec<usize>) {
        let (mut regions, mut gateways, mut door) = (vec![from.region], Vec::new(), chain.first);
        let last = (to.region, usize::MAX);
        for (region, next) in chain.legs.iter().map(|leg| (leg.region, leg.to)).chain([last]) {
            // A door that is merely passed on the way joins nothing.
            if let Some(gateway) = self.doors[door].gateway.filter(|_| regions.last() != Some(&region)) {
                regions.push(region);
                gateways.push(gateway);
            }
            door = next;
        }
        (regions, gateways)
    }

    /// The way over the cells of a chain.
    fn join(&self, chain: &Chain, from: &End, to: &End) -> Path {
        let frame = self.unsafety.frame();
        let mut cells = cells_of(from.way(chain.first), frame);
        let mut joints = vec![cells.len().saturating_sub(1)];
        for &Leg { way: (way, backwards), .. } in &chain.legs {
            let mut leg = self.ways[way].cells();
            if backwards {
                leg.reverse();
            }
            cells.extend(leg.into_iter().skip(1));
            joints.push(cells.len() - 1);
        }
        cells.extend(cells_of(to.way(chain.last()), frame).into_iter().rev().skip(1));
        let ground = Ground { unsafety: &self.unsafety, options: &self.options };
        let cells = ground.straighten(cells, &joints);
        Path::along(&self.unsafety, centers(&cells, frame), &self.options)
    }
}

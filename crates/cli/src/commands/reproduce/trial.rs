//! One exploration, judged against the truth.

use std::time::Instant;

use global_grid::{CrispOptions, GridMap, GridOptions, Occupancy, SonarModel, occupancy};
use hierarchy::evaluate::{MapMatch, Statistics, align, compare_maps};
use hierarchy::local_grid::nalgebra::{Isometry2, Point2, UnitComplex};
use hierarchy::local_grid::{FuzzyGrid, Grid, GridFrame, Reading, SonarCone};
use hierarchy::topo_map::ObstacleOptions;
use hierarchy::{Anchor, Mapper};
use robot_log::EntryKind;
use serde::Serialize;
use simulator::{Ground, Robot, RobotDescription, World};

use super::retrace::{Measured, Path, Paths, Positions, first_visits};
use crate::exit::Exit;
use crate::expedition::{self, Expedition, Halt};
use crate::failure::Failure;

/// What came of one seed.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Trial {
    pub(super) seed: u64,
    pub(super) places: usize,
    pub(super) links: usize,
    /// Readings that describe places: those that the gridmap is drawn from.
    pub(super) readings: usize,
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// The share of the reachable floor within a metre of a place.
    pub(super) coverage: f64,
    /// The same of the floor to which ways lead that are as wide as the explorer wants them: with its own margin beside the
    /// body instead of the bumper's.
    pub(super) coverage_with_margin: f64,
    pub(super) ended_by_itself: bool,
    pub(super) path_length_m: f64,
    /// How often the bumper stopped the robot before it touched something.
    pub(super) stopped_short: usize,
    /// The least distance between the robot's skin and anything, in metres: a collision would be less than 0.
    pub(super) clearance_m: f64,
    pub(super) false_links: usize,
    pub(super) duplicates: usize,
    /// Position errors of the places, rigidly aligned, in the order of [`COLUMNS`].
    pub(super) errors: Vec<Error>,
    /// The gridmap against the true one, in the order of [`GRIDS`].
    pub(super) grids: Vec<GridScore>,
    /// Seconds of the wall clock: one sweep over all places, the gridmap of `readings`, and the whole exploration.
    pub(super) sweep_s: f64,
    pub(super) gridmap_s: f64,
    pub(super) exploration_s: f64,
}

/// The ways to say where the places are, from the least informed to the best.
pub(super) const COLUMNS: [&str; 5] = ["odometry", "compass", "one sweep", "optimum", "fused"];
/// The poses from which the gridmap is drawn.
pub(super) const GRIDS: [&str; 5] = ["raw", "one sweep", "optimum", "fused", "true poses"];

/// Mean and largest distance of the places from the truth, in metres.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub(super) struct Error {
    pub(super) mean_m: f64,
    pub(super) max_m: f64,
}

/// How a gridmap compares with the true one.
#[derive(Debug, Clone, Serialize)]
pub(super) struct GridScore {
    /// Walls within 0.2 m.
    pub(super) precision: f64,
    pub(super) recall: f64,
    pub(super) free_iou: f64,
    /// Mean of `empty · occupied` over the cells of which anything is known.
    pub(super) conflict: f64,
}

/// A trial with what is needed to draw it.
pub(super) struct Outcome {
    pub(super) trial: Trial,
    /// The gridmap of the readings that describe places, at the fused poses.
    pub(super) gridmap: FuzzyGrid,
    /// Where dead reckoning by compass has the places, laid onto the true map; by their index.
    pub(super) before: Positions,
    /// Where the map has them, laid onto the true map.
    pub(super) after: Positions,
    /// The links that hold, by their places.
    pub(super) links: Vec<(usize, usize)>,
}

/// A link is false if it is wrong by more than this, in metres, about the spacing of places: it leads to another place.
const FALSE_LINK: f64 = 1.0;
/// A place that truly lies within so many metres of an older one doubles it.
const DOUBLED: f64 = 0.5;
/// Sweeps over which the time of one is measured.
const SWEEPS: u32 = 1000;

/// Explores `world` and judges what came of it.
pub(super) fn run(
    world: &World,
    description: &RobotDescription,
    seed: u64,
    mut watch: impl FnMut(&Halt<'_, '_>),
) -> Result<Outcome, Failure> {
    let begun = Instant::now();
    let mut robot = Robot::new(world, description.clone(), seed).map_err(|error| failed(&error))?;
    let mut clearance = f64::INFINITY;
    let expedition = expedition::explore(&mut robot, None, |halt| {
        let at = Point2::from(halt.robot.map_from_robot().translation.vector);
        clearance = clearance.min(world.at(halt.robot.time()).clearance(at, 1.0) - description.radius);
        watch(halt);
        Ok(())
    })?;
    let exploration_s = begun.elapsed().as_secs_f64();
    let evidence = Evidence::of(&expedition);
    let mapper = expedition.exploration.mapper();
    let places = evidence.true_places();
    let coverage = world.coverage(&places, description.radius + description.margin, 1.0);
    let ObstacleOptions { radius, margin, .. } = expedition.exploration.options().obstacles;
    let coverage_with_margin = world.coverage(&places, radius + margin, 1.0);
    let (errors, measured) = evidence.errors().map_err(|error| failed(&error))?;
    let [swept, optimum] = &measured;
    let sweep_s = time_of_sweep(&evidence).map_err(|error| failed(&error))?;
    let begun = Instant::now();
    let gridmap = draw(mapper, &evidence.scans(&mapper.poses()))?;
    let gridmap_s = begun.elapsed().as_secs_f64();
    let grids = evidence.grids(world, [swept, optimum])?;
    let links: Vec<(usize, usize)> = mapper
        .topology()
        .links()
        .iter()
        .filter(|link| link.is_measured())
        .map(|link| (link.from.index(), link.to.index()))
        .collect();
    let trial = Trial {
        seed,
        places: mapper.topology().n_visited(),
        links: links.len(),
        readings: evidence.readings(),
        rows: gridmap.frame().rows(),
        columns: gridmap.frame().columns(),
        coverage,
        coverage_with_margin,
        ended_by_itself: expedition.complete,
        path_length_m: robot.path_length(),
        stopped_short: robot.bumps(),
        clearance_m: clearance,
        false_links: evidence.false_links(),
        duplicates: evidence.duplicates(),
        errors,
        grids,
        sweep_s,
        gridmap_s,
        exploration_s,
    };
    let [before, after] = evidence.drawn();
    Ok(Outcome { trial, gridmap, before, after, links })
}

/// What an expedition left behind, beside the truth.
struct Evidence<'a> {
    mapper: &'a Mapper,
    described: Vec<usize>,
    anchors: &'a [Anchor],
    paths: Paths,
    /// Where each place really is, by its index.
    truth: Positions,
    /// Whether headings are those of a compass, so that the map's axes are the world's.
    has_compass: bool,
}

impl<'a> Evidence<'a> {
    fn of(expedition: &'a Expedition) -> Self {
        let mapper = expedition.exploration.mapper();
        let anchors = mapper.trajectory().anchors();
        let paths = Paths::of(&expedition.entries);
        let truth = first_visits(anchors, &paths.truth, mapper.topology().places().len());
        let has_compass = expedition.entries.iter().any(|entry| matches!(entry.kind, EntryKind::Heading { .. }));
        Self { mapper, described: expedition.exploration.descriptions(), anchors, paths, truth, has_compass }
    }

    fn places(&self) -> usize {
        self.mapper.topology().places().len()
    }

    /// Where the visited places really are.
    fn true_places(&self) -> Vec<Point2<f64>> {
        let visited = self.mapper.topology().places().iter().filter(|place| place.is_visited());
        visited.filter_map(|place| self.truth[place.id.index()]).collect()
    }

    fn duplicates(&self) -> usize {
        let all = self.true_places();
        let doubled = |k: &usize| all[..*k].iter().any(|before| (before - all[*k]).norm() < DOUBLED);
        (0..all.len()).filter(doubled).count()
    }

    /// The links that are wrong by too much; without a compass, in the axes that lay the map onto the truth.
    fn false_links(&self) -> usize {
        let (found, truth) = self.pairs(&self.fused());
        let fit = align(&found, &truth).filter(|_| !self.has_compass);
        let turn = fit.map_or_else(UnitComplex::identity, |fit| fit.reference_from_estimate.rotation);
        let links = self.mapper.topology().links().iter().filter(|link| link.is_measured());
        let wrong = links.filter(|link| {
            let ends = self.truth[link.from.index()].zip(self.truth[link.to.index()]);
            ends.is_some_and(|(from, to)| (turn * link.displacement.vector - (to - from)).norm() > FALSE_LINK)
        });
        wrong.count()
    }

    /// The errors by column, and what is measured by compass alone: swept once per place, and at its optimum.
    fn errors(&self) -> Result<(Vec<Error>, [Positions; 2]), hierarchy::RelaxationError> {
        let visits = |path: &Path| first_visits(self.anchors, path, self.places());
        let swept = Measured::along(self.anchors, &self.paths.compass, self.places(), |map, coordinates| {
            coordinates.sweep(map).map(|_| ())
        })?;
        let mut optimum = Measured::along(self.anchors, &self.paths.compass, self.places(), |_, _| Ok(()))?;
        optimum.relax()?;
        let fused = self.fused();
        let measured = [swept.positions(), optimum.positions()];
        let columns = [
            visits(&self.paths.odometry),
            visits(&self.paths.compass),
            measured[0].clone(),
            measured[1].clone(),
            fused,
        ];
        Ok((columns.iter().map(|column| self.error(column)).collect(), measured))
    }

    fn error(&self, column: &[Option<Point2<f64>>]) -> Error {
        let (found, truth) = self.pairs(column);
        let Some(fit) = align(&found, &truth) else { return Error::default() };
        let off = found.iter().zip(&truth).map(|(found, truth)| (fit.reference_from_estimate * found - truth).norm());
        Statistics::of(&off.collect::<Vec<_>>())
            .map_or_else(Error::default, |off| Error { mean_m: off.mean, max_m: off.max })
    }

    /// Dead reckoning by compass and the map, each laid onto the true map.
    fn drawn(&self) -> [Positions; 2] {
        let after = self.fused();
        [first_visits(self.anchors, &self.paths.compass, self.places()), after].map(|column| {
            let (found, truth) = self.pairs(&column);
            let Some(fit) = align(&found, &truth) else { return vec![None; self.places()] };
            let visited = |index: usize| self.mapper.topology().places()[index].is_visited();
            let laid = |(index, at): (usize, &Option<Point2<f64>>)| {
                at.filter(|_| visited(index)).map(|at| fit.reference_from_estimate * at)
            };
            column.iter().enumerate().map(laid).collect()
        })
    }

    /// Where the map has the places.
    fn fused(&self) -> Positions {
        self.mapper.coordinates().positions().into_iter().map(Some).collect()
    }

    fn pairs(&self, column: &[Option<Point2<f64>>]) -> (Vec<Point2<f64>>, Vec<Point2<f64>>) {
        let visited = self.mapper.topology().places().iter().filter(|place| place.is_visited());
        visited.filter_map(|place| column[place.id.index()].zip(self.truth[place.id.index()])).unzip()
    }

    /// The scans that describe places, at given poses of the robot by sample.
    fn scans(&self, poses: &[Isometry2<f64>]) -> Vec<(usize, Isometry2<f64>)> {
        self.described.iter().filter_map(|&index| Some((index, *poses.get(index)?))).collect()
    }

    fn readings(&self) -> usize {
        let samples = self.mapper.trajectory().samples();
        let valid = |index: &usize| samples[*index].scan.readings().iter().filter(|r| **r != Reading::Invalid).count();
        self.described.iter().map(valid).sum()
    }

    /// The four gridmaps against the true one.
    fn grids(&self, world: &World, [swept, optimum]: [&Positions; 2]) -> Result<Vec<GridScore>, Failure> {
        let samples = self.mapper.trajectory().samples();
        let along = |path: &Path| -> Vec<(usize, Isometry2<f64>)> {
            self.described.iter().filter_map(|&index| Some((index, path.at(samples[index].stamp)?))).collect()
        };
        let (raw, truth) = (along(&self.paths.odometry), along(&self.paths.truth));
        let fits = [swept, optimum].map(|positions| self.hung(positions));
        let [swept_scans, optimum_scans] = &fits;
        let fused = self.scans(&self.mapper.poses());
        let mut scores = Vec::new();
        for scans in [&raw, swept_scans, optimum_scans, &fused, &truth] {
            let (from, to): (Vec<_>, Vec<_>) = scans
                .iter()
                .filter_map(|(index, pose)| {
                    let truth = self.paths.truth.at(samples[*index].stamp)?;
                    Some((Point2::from(pose.translation.vector), Point2::from(truth.translation.vector)))
                })
                .unzip();
            let Some(fit) = align(&from, &to) else { continue };
            scores.push(score(&draw(self.mapper, scans)?, world, &fit.reference_from_estimate));
        }
        Ok(scores)
    }

    /// The scans, each where the place at which it was taken now is, turned as the compass said.
    fn hung(&self, positions: &[Option<Point2<f64>>]) -> Vec<(usize, Isometry2<f64>)> {
        let samples = self.mapper.trajectory().samples();
        let hang = |&index: &usize| {
            // A survey is made before its place is known: the place is that of the next anchor.
            let after = self.anchors.partition_point(|anchor| anchor.sample <= index);
            let anchor = self.anchors.get(after).or(self.anchors.last())?;
            let at = positions[anchor.place.index()]? + anchor.place_from_robot.translation.vector;
            let heading = self.paths.compass.at(samples[index].stamp)?.rotation;
            Some((index, Isometry2::from_parts(at.coords.into(), heading)))
        };
        self.described.iter().filter_map(hang).collect()
    }
}

/// Draws scans at given poses into a fuzzy gridmap of the paper's kind.
fn draw(mapper: &Mapper, scans: &[(usize, Isometry2<f64>)]) -> Result<FuzzyGrid, Failure> {
    let sonar = SonarModel::Cone(SonarCone::default());
    let resolution = mapper.config().grid.resolution_m;
    let mut map = GridMap::new(GridOptions { resolution, sonar, ..GridOptions::default() }).map_err(|e| failed(&e))?;
    for (key, (index, pose)) in (0..).zip(scans) {
        map.insert(key, pose, &mapper.trajectory().samples()[*index].scan).map_err(|error| failed(&error))?;
    }
    map.to_grid().map_err(|error| failed(&error))
}

fn score(gridmap: &FuzzyGrid, world: &World, truth_from_map: &Isometry2<f64>) -> GridScore {
    let crisp = occupancy(gridmap, &CrispOptions::for_map(gridmap));
    let MapMatch { walls, free_iou, .. } = compare_maps(&crisp, &true_map(world), truth_from_map);
    let within = walls.iter().find(|walls| walls.tolerance_m == 0.2).copied();
    let known: Vec<f64> = gridmap
        .cells()
        .iter()
        .filter(|cell| cell.empty + cell.occupied > 0.0)
        .map(|cell| f64::from(cell.empty * cell.occupied))
        .collect();
    GridScore {
        precision: within.map_or(0.0, |walls| walls.precision),
        recall: within.map_or(0.0, |walls| walls.recall),
        free_iou: free_iou.unwrap_or(0.0),
        conflict: Statistics::of(&known).map_or(0.0, |conflict| conflict.mean),
    }
}

/// The true map of what the robot can see: the floor, and the surfaces that bound it.
fn true_map(world: &World) -> Grid<Occupancy> {
    const CELL: f64 = 0.1;
    let (low, high) = world.bounds();
    let frame = GridFrame::covering(low, high, CELL).expect("worlds are checked to be of a sensible size");
    let ground = world.ground(frame);
    let mut map = Grid::new(frame);
    for row in 0..frame.rows() {
        for column in 0..frame.columns() {
            let near = |r: usize, c: usize| ground.get(r, c).is_some_and(|cell| *cell == Ground::Open);
            let around = || {
                (row.saturating_sub(1)..=row + 1).any(|r| (column.saturating_sub(1)..=column + 1).any(|c| near(r, c)))
            };
            let cell = match ground.get(row, column) {
                Some(Ground::Open) => Occupancy::Free,
                Some(Ground::Surface) if around() => Occupancy::Occupied,
                _ => Occupancy::Unknown,
            };
            if let Some(known) = map.get_mut(row, column) {
                *known = cell;
            }
        }
    }
    map
}

/// Seconds of one sweep of Gauss-Seidel over the map.
fn time_of_sweep(evidence: &Evidence<'_>) -> Result<f64, hierarchy::RelaxationError> {
    let measured = Measured::along(evidence.anchors, &evidence.paths.compass, evidence.places(), |_, _| Ok(()))?;
    let network = measured.network()?;
    let mut positions = network.dead_reckoning();
    let begun = Instant::now();
    for _ in 0..SWEEPS {
        hierarchy::relaxation::sweep(&network, &mut positions);
    }
    Ok(begun.elapsed().as_secs_f64() / f64::from(SWEEPS))
}

fn failed(error: &dyn std::error::Error) -> Failure {
    Failure::new(Exit::Failed, "reproduce.failed", format!("could not reproduce the experiment: {error}"))
        .because_of(error)
}

//! Paths over the fuzzy map that keep to safe ground.

mod dilate;
mod driven;
mod search;

use std::collections::BTreeSet;

use local_grid::nalgebra::Point2;
use local_grid::{FuzzyGrid, Grid};

use crate::Exposure;
use crate::derived::{Norm, derive};
use dilate::dilate;
pub use driven::LONGEST_STEP;
use search::{Flood, search};

/// How a path is found.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct PlanOptions {
    /// Radius of the robot in metres.
    pub radius: f64,
    /// Distance to keep beyond the robot's radius, in metres.
    pub margin: f64,
    /// How much longer, in times of a cell's length, a path may be to avoid a cell that is wholly unsafe.
    pub risk_weight: f64,
    /// A cell more unsafe than this is never entered, in `[0, 1]`.
    pub forbidden: f64,
    /// How fuzzy sets are intersected.
    pub norm: Norm,
    /// By how much evidence is multiplied first: by [`Exposure::of`] a map of few readings has safe ground as well.
    pub exposure: Exposure,
    /// Whether cells of which next to nothing is known may be entered, at the cost of unsafe ones.
    pub through_unexplored: bool,
    /// Where the centre of a robot no smaller than `radius` has been, in the order in which it drove, in metres.
    ///
    /// What its body swept is safe, whatever lies within the margin and whatever readings say: such cells count as unsafe by
    /// one half at most, unless they are clearly occupied themselves. Sonar blurs the posts of doors, which would be closed
    /// without this. Empty to trust the map alone.
    pub driven: Vec<Point2<f64>>,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self {
            radius: 0.225, // a Nomad 200
            margin: 0.1,
            risk_weight: 3.0,
            forbidden: 0.9,
            norm: Norm::Product,
            exposure: Exposure::default(),
            through_unexplored: false,
            driven: Vec::new(),
        }
    }
}

/// A path over the map.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Path {
    /// Centres of the cells on the way, from start to goal, in the frame of the grid, in metres.
    pub points: Vec<Point2<f64>>,
    /// Length in metres.
    pub length: f64,
    /// `Σ length (1 + risk_weight · M)`, in metres.
    pub cost: f64,
    /// The largest unsafety on the way, for the robot's whole disc.
    pub risk: f64,
}

/// Why there is no path.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// An option makes no sense.
    #[error("`{option}` must be {expected}, got {value}")]
    Option {
        /// The option.
        option: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it was.
        value: f64,
    },
    /// The start or the goal lies beside the map.
    #[error("the {end} ({x}, {y}) lies outside the map, which reaches from ({west}, {south}) to ({east}, {north})")]
    Outside {
        /// Start or goal.
        end: End,
        /// East, in metres.
        x: f64,
        /// North, in metres.
        y: f64,
        /// The map's border.
        west: f64,
        /// The map's border.
        south: f64,
        /// The map's border.
        east: f64,
        /// The map's border.
        north: f64,
    },
    /// The robot cannot stand at the start or at the goal.
    #[error("the {end} ({x}, {y}) is unsafe: {unsafety:.2} is more than {forbidden}, because of a cell that is {why}")]
    Unsafe {
        /// Start or goal.
        end: End,
        /// East, in metres.
        x: f64,
        /// North, in metres.
        y: f64,
        /// How unsafe the worst cell under the robot and its margin is.
        unsafety: f64,
        /// The most that is allowed.
        forbidden: f64,
        /// What that cell is.
        why: Reason,
    },
    /// There is no way between them.
    #[error(
        "no safe way leads from the start to the goal: {reached} cells can be reached, up to {nearest:.2} m from the goal"
    )]
    Unreachable {
        /// Cells that can be reached from the start.
        reached: usize,
        /// How near to the goal they come, in metres.
        nearest: f64,
    },
}

/// One end of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// Where it starts.
    Start,
    /// Where it ends.
    Goal,
}

impl std::fmt::Display for End {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Self::Start => "start",
            Self::Goal => "goal",
        })
    }
}

/// Why a cell is unsafe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// Something is there.
    Occupied,
    /// Readings contradict each other.
    Contradictory,
    /// Too little is known of it, or it lies beyond the map.
    Unexplored,
}

impl std::fmt::Display for Reason {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Self::Occupied => "occupied",
            Self::Contradictory => "contradictory",
            Self::Unexplored => "unexplored",
        })
    }
}

impl PlanOptions {
    fn validate(&self) -> Result<(), PlanError> {
        let check = |option, value: f64, most: f64, expected| {
            if (0.0..=most).contains(&value) { Ok(()) } else { Err(PlanError::Option { option, expected, value }) }
        };
        check("radius", self.radius, 1e3, "between 0 and 1000 metres")?;
        check("margin", self.margin, 1e3, "between 0 and 1000 metres")?;
        check("risk_weight", self.risk_weight, 1e6, "between 0 and a million")?;
        check("forbidden", self.forbidden, 1.0, "in [0, 1]")
    }
}

/// The planner's map: how unsafe it is to have the robot's centre in each cell.
///
/// The unsafe set `M` grown by a disc of the robot's radius and margin: the largest unsafety of any cell whose centre
/// lies within them. What lies beyond the map is unexplored. Where the robot [has been](PlanOptions::driven) it fits.
///
/// # Errors
///
/// Options that make no sense.
pub fn unsafety(grid: &FuzzyGrid, options: &PlanOptions) -> Result<Grid<f32>, PlanError> {
    options.validate()?;
    let floor = unexplored_unsafety(options);
    let own = grid.map(|&cell| {
        let sets = derive(options.exposure.of_cell(cell), options.norm);
        // An unexplored cell may be allowed, but costs as much as anything that is allowed.
        if sets.indeterminate > 0.5 { sets.unsafety.min(floor) } else { sets.unsafety }
    });
    let mut grown = dilate(&own, options.radius + options.margin, floor);
    driven::trust(&mut grown, grid, options);
    Ok(grown)
}

/// How unsafe a cell counts of which nothing is known.
#[expect(clippy::cast_possible_truncation, reason = "a degree")]
fn unexplored_unsafety(options: &PlanOptions) -> f32 {
    if options.through_unexplored { options.forbidden as f32 } else { 1.0 }
}

/// The cheapest way from `start` to `goal` for a round robot: A* over the eight neighbours of each cell.
///
/// A step costs its length times `1 + risk_weight · M`, with `M` the [`unsafety`] of the cell entered, and no cell above
/// `forbidden` is entered, nor a corner between two such cells cut. The straight-line distance never overestimates the
/// cost, so the path is the cheapest there is.
///
/// # Errors
///
/// A start or goal outside the map or unsafe, with what makes it so; or no way between them.
pub fn plan(grid: &FuzzyGrid, start: Point2<f64>, goal: Point2<f64>, options: &PlanOptions) -> Result<Path, PlanError> {
    let unsafety = unsafety(grid, options)?;
    let from = standing(grid, &unsafety, start, End::Start, options)?;
    let to = standing(grid, &unsafety, goal, End::Goal, options)?;
    search(&unsafety, from, to, options)
}

/// As [`plan`], over an [`unsafety`] map that was made before, and perhaps closed in places since: for many plans, or for
/// those that keep to a part of the map.
///
/// `None` where one end lies outside or is unsafe, or no way leads between them; [`plan`] says which.
#[must_use]
pub fn plan_over(unsafety: &Grid<f32>, start: Point2<f64>, goal: Point2<f64>, options: &PlanOptions) -> Option<Path> {
    let (from, to) = (safe_cell(unsafety, start, options)?, safe_cell(unsafety, goal, options)?);
    search(unsafety, from, to, options).ok()
}

/// What the cheapest way from `start` to each cell costs, as [`plan`] counts; infinite where no way leads. `None` where the
/// start lies outside or is unsafe.
#[must_use]
pub fn costs_from(unsafety: &Grid<f32>, start: Point2<f64>, options: &PlanOptions) -> Option<Grid<f64>> {
    Some(Flood::from(unsafety, safe_cell(unsafety, start, options)?, options, |_| false).costs)
}

/// The cheapest ways from `start` to each of several goals, as [`plan`] finds them; `None` for those that cannot be reached.
/// No farther cells are looked at than the farthest goal.
#[must_use]
pub fn ways_from(
    unsafety: &Grid<f32>,
    start: Point2<f64>,
    goals: &[Point2<f64>],
    options: &PlanOptions,
) -> Vec<Option<Path>> {
    let Some(from) = safe_cell(unsafety, start, options) else { return vec![None; goals.len()] };
    let cell =
        |goal: &Point2<f64>| safe_cell(unsafety, *goal, options).map(|(r, c)| r * unsafety.frame().columns() + c);
    let goals: Vec<Option<usize>> = goals.iter().map(cell).collect();
    let mut left: BTreeSet<usize> = goals.iter().flatten().copied().collect();
    let flood = Flood::from(unsafety, from, options, |cell| {
        left.remove(&cell);
        left.is_empty()
    });
    goals.into_iter().map(|goal| flood.way(unsafety, goal?, options)).collect()
}

/// The cell of a point, if the robot may be there.
fn safe_cell(unsafety: &Grid<f32>, point: Point2<f64>, options: &PlanOptions) -> Option<(usize, usize)> {
    let (row, column) = unsafety.frame().cell_at(point)?;
    let risk = f64::from(*unsafety.get(row, column)?);
    (risk <= f64::from(unexplored_unsafety(options)).min(options.forbidden) + 1e-6).then_some((row, column))
}

/// The cell of a point where the robot can stand.
fn standing(
    grid: &FuzzyGrid,
    unsafety: &Grid<f32>,
    point: Point2<f64>,
    end: End,
    options: &PlanOptions,
) -> Result<(usize, usize), PlanError> {
    let frame = grid.frame();
    let (x, y) = (point.x, point.y);
    let Some((row, column)) = frame.cell_at(point) else {
        let corner = frame.center(frame.rows(), frame.columns()).coords.add_scalar(-0.5 * frame.resolution());
        let (west, south) = (frame.origin().x, frame.origin().y);
        return Err(PlanError::Outside { end, x, y, west, south, east: corner.x, north: corner.y });
    };
    let unsafety = f64::from(unsafety.cells()[row * frame.columns() + column]);
    if unsafety > f64::from(unexplored_unsafety(options)).min(options.forbidden) + 1e-6 {
        let why = dilate::worst(grid, (row, column), options);
        return Err(PlanError::Unsafe { end, x, y, unsafety, forbidden: options.forbidden, why });
    }
    Ok((row, column))
}

#[cfg(test)]
mod tests;

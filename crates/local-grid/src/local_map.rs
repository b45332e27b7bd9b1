mod distance;
mod line;
mod patch;

use nalgebra::{Isometry2, Point2, Vector2};

use crate::{Evidence, FrameError, Grid, GridFrame, Reading, Scan};
use distance::is_wall;
use patch::{Cells, Patches};

/// How finely a [`LocalMap`] is cut, how far its field reaches, and which readings enter it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct LocalMapOptions {
    /// Edge of a cell in metres.
    pub resolution: f64,
    /// Distances to walls are known up to here, in metres: how far off a scan may start and still be pulled right.
    pub max_distance: f64,
    /// Echoes from beyond are not drawn, in metres.
    pub max_range: f64,
    /// A cell counts as wall while at least this share of the rays that reached it ended in it.
    pub wall_share: f64,
}

impl Default for LocalMapOptions {
    fn default() -> Self {
        Self { resolution: 0.05, max_distance: 0.5, max_range: 30.0, wall_share: 0.25 }
    }
}

/// A map of walls for a precise sensor that grows without border, with the distance to the nearest wall kept at every cell.
///
/// Its cells count how many rays ended in them and how many passed. Distances are mended around each cell that becomes a wall
/// or ceases to be one (after the dynamic distance maps of Lau, Sprunk & Burgard 2013), so that matching a scan
/// costs a look-up per point, whatever the size of the map. Memory is spent in patches of 32 × 32 cells, only where a ray
/// came by.
#[derive(Debug, Clone)]
pub struct LocalMap {
    options: LocalMapOptions,
    cells_per_metre: f64,
    patches: Patches,
    disc: distance::Disc,
}

/// Why a local map cannot be made or grow.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LocalMapError {
    /// The options must describe a map.
    #[error("local map: `{field}` must be {expected}, got {value}")]
    Option {
        /// The option.
        field: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it was.
        value: f64,
    },
    /// A pose must be finite, and near enough for the map's index.
    #[error("a scan taken at ({x}, {y}) metres is too far from the rest of the local map")]
    TooFar {
        /// East, in metres.
        x: f64,
        /// North, in metres.
        y: f64,
    },
}

impl LocalMap {
    /// An empty map.
    ///
    /// # Errors
    ///
    /// Options that describe no map.
    pub fn new(options: LocalMapOptions) -> Result<Self, LocalMapError> {
        let check = |field, value: f64, allowed: std::ops::RangeInclusive<f64>, expected| {
            if allowed.contains(&value) { Ok(()) } else { Err(LocalMapError::Option { field, expected, value }) }
        };
        check("resolution", options.resolution, 1e-3..=10.0, "in [0.001, 10] metres")?;
        let cells = options.max_distance / options.resolution;
        check("max_distance", cells, 1.0..=100.0, "between 1 and 100 cells")?;
        check("max_range", options.max_range, options.resolution..=1e4, "between a cell and 10 km")?;
        check("wall_share", options.wall_share, 0.0..=1.0, "in [0, 1]")?;
        let disc = distance::Disc::new(options.resolution, options.max_distance);
        let metres = disc.metres(options.resolution, options.max_distance);
        let cells_per_metre = 1.0 / options.resolution;
        Ok(Self { patches: Patches::new(disc.none(), metres), disc, cells_per_metre, options })
    }

    /// How the map is cut.
    #[must_use]
    pub fn options(&self) -> &LocalMapOptions {
        &self.options
    }

    /// Draws a scan taken where `map_from_robot` puts the robot: each echo's cell gains a hit, the cells before it a miss.
    ///
    /// # Errors
    ///
    /// A pose that is not finite, or so far from the rest that the map's index would not fit into memory; then nothing
    /// is drawn.
    pub fn insert(&mut self, map_from_robot: &Isometry2<f64>, scan: &Scan) -> Result<(), LocalMapError> {
        let mut changed = Vec::new();
        self.for_each_ray(map_from_robot, scan, |map, start, end| map.draw(start, end, &mut changed))?;
        self.mend(changed);
        Ok(())
    }

    /// Draws the echoes of a scan alone; what lies before them stays unknown. Less than half of the work of
    /// [`LocalMap::insert`], for a map of few scans that other scans are fitted to: there nothing has had the time to go away.
    ///
    /// # Errors
    ///
    /// As [`LocalMap::insert`].
    pub fn insert_echoes(&mut self, map_from_robot: &Isometry2<f64>, scan: &Scan) -> Result<(), LocalMapError> {
        self.for_each_ray(map_from_robot, scan, |map, _, end| map.hit(end))
    }

    /// Visits the echoes of a scan that are near enough to be drawn: where their rays start and end.
    fn for_each_ray(
        &mut self,
        map_from_robot: &Isometry2<f64>,
        scan: &Scan,
        mut visit: impl FnMut(&mut Self, Vector2<f64>, Vector2<f64>),
    ) -> Result<(), LocalMapError> {
        let at = map_from_robot.translation.vector;
        let reach = self.options.max_range.min(scan.sensor().max_range());
        if !self.patches.cover(self.cell(at - Vector2::repeat(reach)), self.cell(at + Vector2::repeat(reach))) {
            return Err(LocalMapError::TooFar { x: at.x, y: at.y });
        }
        for beam in scan.beams() {
            let Reading::Echo(range) = beam.reading else { continue };
            let range = f64::from(range);
            if range > self.options.max_range {
                continue;
            }
            let map_from_sensor = map_from_robot * beam.robot_from_sensor;
            let start = map_from_sensor.translation.vector;
            let end = start + map_from_sensor.rotation * Vector2::new(range, 0.0);
            visit(self, start, end);
        }
        Ok(())
    }

    fn cell(&self, point: Vector2<f64>) -> Option<(i32, i32)> {
        patch::cell_of(point * self.cells_per_metre)
    }

    /// Counts a hit in the cell of `end`.
    fn hit(&mut self, end: Vector2<f64>) {
        let Some(cell) = self.cell(end) else { return };
        let Some((cells, index)) = self.patches.at_mut(cell) else { return };
        cells.hits[index] = cells.hits[index].saturating_add(1);
        if !is_wall(cells.nearest[index]) && cells.is_wall(index, self.options.wall_share) {
            self.disc.lower(&mut self.patches, cell);
        }
    }

    /// Counts misses from `start` up to the cell of `end`, and a hit there.
    fn draw(&mut self, start: Vector2<f64>, end: Vector2<f64>, changed: &mut Vec<(i32, i32)>) {
        let share = self.options.wall_share;
        let (from, to) = (start * self.cells_per_metre, end * self.cells_per_metre);
        self.patches.walk(from, to, |cells: &mut Cells, index, corner, count| {
            // Nearly all cells that rays pass were never hit: they are no walls, before as after.
            let was = cells.hits[index] > 0 && cells.is_wall(index, share);
            cells.misses[index] = cells.misses[index].saturating_add(count);
            if was && !cells.is_wall(index, share) {
                changed.push(patch::cell_within(corner, index));
            }
        });
        let Some(cell) = self.cell(end) else { return };
        let Some((cells, index)) = self.patches.at_mut(cell) else { return };
        let was = cells.is_wall(index, share);
        cells.hits[index] = cells.hits[index].saturating_add(1);
        if !was && cells.is_wall(index, share) {
            changed.push(cell);
        }
    }

    /// Brings the distances up to date around cells whose state may have changed.
    fn mend(&mut self, changed: Vec<(i32, i32)>) {
        for cell in changed {
            let wall = self.patches.at(cell).is_some_and(|(cells, at)| cells.is_wall(at, self.options.wall_share));
            let drawn = self.patches.at(cell).is_some_and(|(cells, at)| is_wall(cells.nearest[at]));
            match (wall, drawn) {
                (true, false) => self.disc.lower(&mut self.patches, cell),
                (false, true) => self.disc.raise(&mut self.patches, cell),
                _ => {}
            }
        }
    }

    /// The distance from `point` to the nearest wall in metres, at most [`LocalMapOptions::max_distance`], and its gradient:
    /// bilinear between the centres of cells.
    #[must_use]
    #[inline]
    pub fn distance(&self, point: Point2<f64>) -> (f64, Vector2<f64>) {
        let (distance, gradient) = self.patches.interpolate(point.coords * self.cells_per_metre);
        (distance, gradient * self.cells_per_metre)
    }

    /// The least distance to a wall among the cells in the middle of a square of `edge` metres around `point`, and whether any
    /// of them is known: enough to search with steps of that edge.
    pub(crate) fn nearest(&self, point: Point2<f64>, edge: f64) -> (f64, bool) {
        let quarter = 0.25 * edge;
        let mut best = (self.options.max_distance, false);
        for (dx, dy) in [(-quarter, -quarter), (quarter, -quarter), (-quarter, quarter), (quarter, quarter)] {
            let Some(cell) = self.cell(point.coords + Vector2::new(dx, dy)) else { continue };
            let Some((cells, at)) = self.patches.at(cell) else { continue };
            best = (best.0.min(self.patches.metres(cells.nearest[at])), best.1 || cells.is_known(at));
        }
        best
    }

    /// Whether any ray ended in, or passed, the cell of `point`.
    #[must_use]
    pub fn is_known(&self, point: Point2<f64>) -> bool {
        self.cell(point.coords).and_then(|cell| self.patches.at(cell)).is_some_and(|(cells, at)| cells.is_known(at))
    }

    /// Whether nothing has been drawn yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.patches.is_empty()
    }

    /// The centres of all cells that are walls, patch by patch in the order of their first being seen.
    pub fn walls(&self) -> impl Iterator<Item = Point2<f64>> + '_ {
        let (resolution, share) = (self.options.resolution, self.options.wall_share);
        let center = move |(x, y): (i32, i32)| Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) * resolution;
        let known = self.patches.cells();
        known.filter(move |(cells, at, _)| cells.is_wall(*at, share)).map(move |(_, _, cell)| center(cell))
    }

    /// The map as evidence on a dense grid that just holds it: the share of rays that ended in a cell says how occupied it is.
    ///
    /// # Errors
    ///
    /// A map too large for one dense grid.
    pub fn to_grid(&self) -> Result<Grid<Evidence>, FrameError> {
        let resolution = self.options.resolution;
        let known = || self.patches.cells().filter(|(cells, at, _)| cells.is_known(*at)).map(|(_, _, cell)| cell);
        let (mut low, mut high) = ((i32::MAX, i32::MAX), (i32::MIN, i32::MIN));
        for (x, y) in known() {
            low = (low.0.min(x), low.1.min(y));
            high = (high.0.max(x), high.1.max(y));
        }
        if low.0 > high.0 {
            return Ok(Grid::new(GridFrame::new(Point2::origin(), resolution, 0, 0)?));
        }
        let side = |low: i32, high: i32| usize::try_from(i64::from(high) - i64::from(low) + 1).unwrap_or(usize::MAX);
        let origin = Point2::new(f64::from(low.0), f64::from(low.1)) * resolution;
        let frame = GridFrame::new(origin, resolution, side(low.1, high.1), side(low.0, high.0))?;
        let mut grid = Grid::new(frame);
        for (cells, at, (x, y)) in self.patches.cells().filter(|(cells, at, _)| cells.is_known(*at)) {
            if let Some(cell) = grid.get_mut(side(low.1, y) - 1, side(low.0, x) - 1) {
                *cell = cells.evidence(at);
            }
        }
        Ok(grid)
    }
}

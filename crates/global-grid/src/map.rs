pub(crate) mod assemble;
pub(crate) mod dense;

use std::collections::BTreeMap;
use std::sync::OnceLock;

use local_grid::{FuzzyGrid, Grid, GridFrame, Scan};
use nalgebra::{Isometry2, Point2};

use crate::draw::share::share_echoes;
use crate::draw::sonar::model_of;
use crate::draw::sums::Sums;
use crate::draw::{Direction, Pen, longest_reach, shares_echoes};
use crate::map::assemble::draw_all;
use crate::map::dense::{dense, frame_of};
use crate::plane::{Plane, Tile};
use crate::{GridError, GridOptions, Tally};

/// The most cells that a beam may be long: 16 tiles across a footprint's half.
const MAX_BEAM_CELLS: u32 = 16_384;
/// The farthest cell from the origin that a pose may lie in.
const MAX_POSE_CELLS: f64 = 1e9;

/// A scan where it was taken.
#[derive(Debug, Clone)]
struct Posed {
    map_from_robot: Isometry2<f64>,
    scan: Scan,
}

/// One gridmap in the map frame, fused from scans that can be moved, taken out and put back.
///
/// Scans are held under keys (one per place, say). The map is the sum of what they say, kept in integers: whatever was
/// inserted, moved and removed before, it equals the map built at once from what it holds now, bit for bit.
/// Only squares of 64 × 64 cells that an outline crosses exist: for lasers a byte per cell of emptiness and one of
/// occupancy, 4 more for each where a cell was counted beyond 127; for sonars 1 and 4 bytes; nothing for the open ground between.
#[derive(Debug, Clone)]
pub struct GridMap {
    options: GridOptions,
    sums: Sums,
    pen: Pen,
    contributions: BTreeMap<u64, Vec<Posed>>,
    /// The most that any cell's sums can have grown to: empty, occupied.
    largest: (u32, u32),
    /// Sonar echoes shared out, once they were asked for.
    echoes: OnceLock<Option<Plane>>,
}

impl GridMap {
    /// A map in which nothing is known.
    ///
    /// # Errors
    ///
    /// Options that make no sense.
    pub fn new(options: GridOptions) -> Result<Self, GridError> {
        options.validate()?;
        let pen = Pen::new(&options);
        Ok(Self {
            sums: Sums::new(pen.worth()),
            pen,
            options,
            contributions: BTreeMap::new(),
            largest: (0, 0),
            echoes: OnceLock::new(),
        })
    }

    /// How the map is built.
    #[must_use]
    pub fn options(&self) -> &GridOptions {
        &self.options
    }

    /// Adds a scan to the contribution `key`.
    ///
    /// # Errors
    ///
    /// A pose that is not finite or too far away, or a sensor that reaches too many cells; the map is as before.
    pub fn insert(&mut self, key: u64, map_from_robot: &Isometry2<f64>, scan: &Scan) -> Result<(), GridError> {
        self.check_pose(key, map_from_robot)?;
        self.check_range(key, scan)?;
        self.make_room(key, scan)?;
        self.pen.draw(&mut self.sums, &self.options, (map_from_robot, scan), Direction::In);
        self.echoes.take();
        let posed = Posed { map_from_robot: *map_from_robot, scan: scan.clone() };
        self.contributions.entry(key).or_default().push(posed);
        Ok(())
    }

    /// Adds many scans at once, all of them or none: with the feature `parallel`, on all cores, with the same result.
    ///
    /// # Errors
    ///
    /// As [`GridMap::insert`].
    pub fn insert_all<'a>(
        &mut self,
        scans: impl IntoIterator<Item = (u64, &'a Isometry2<f64>, &'a Scan)>,
    ) -> Result<(), GridError> {
        let scans: Vec<_> = scans.into_iter().collect();
        let largest = self.largest;
        for &(key, map_from_robot, scan) in &scans {
            let checked = self.check_pose(key, map_from_robot).and_then(|()| self.check_range(key, scan));
            if let Err(error) = checked.and_then(|()| self.make_room(key, scan)) {
                self.largest = largest;
                return Err(error);
            }
        }
        let posed: Vec<_> = scans.iter().map(|&(_, map_from_robot, scan)| (map_from_robot, scan)).collect();
        draw_all(&mut self.sums, &mut self.pen, &self.options, &posed);
        self.echoes.take();
        for (key, map_from_robot, scan) in scans {
            let posed = Posed { map_from_robot: *map_from_robot, scan: scan.clone() };
            self.contributions.entry(key).or_default().push(posed);
        }
        Ok(())
    }

    /// Moves the scans of a contribution to new poses, one per scan in the order they were inserted.
    /// Scans whose pose did not change are not touched. Returns how many were fused again.
    ///
    /// # Errors
    ///
    /// No such contribution, as many poses as scans not given, or a pose that is not finite; the map is as before.
    pub fn relocate(&mut self, key: u64, poses: &[Isometry2<f64>]) -> Result<usize, GridError> {
        poses.iter().try_for_each(|pose| self.check_pose(key, pose))?;
        let scans = self.contributions.get_mut(&key).ok_or(GridError::NoContribution(key))?;
        if scans.len() != poses.len() {
            return Err(GridError::Poses { key, scans: scans.len(), poses: poses.len() });
        }
        let mut moved = 0;
        for (posed, pose) in scans.iter_mut().zip(poses).filter(|(posed, pose)| posed.map_from_robot != **pose) {
            self.pen.draw(&mut self.sums, &self.options, (&posed.map_from_robot, &posed.scan), Direction::Out);
            self.pen.draw(&mut self.sums, &self.options, (pose, &posed.scan), Direction::In);
            posed.map_from_robot = *pose;
            moved += 1;
        }
        if moved > 0 {
            self.echoes.take();
        }
        Ok(moved)
    }

    /// Takes a contribution out, as if it had never been there. Returns how many scans it held.
    pub fn remove(&mut self, key: u64) -> usize {
        let Some(scans) = self.contributions.remove(&key) else { return 0 };
        for posed in &scans {
            self.pen.draw(&mut self.sums, &self.options, (&posed.map_from_robot, &posed.scan), Direction::Out);
        }
        self.echoes.take();
        self.sums.release_blank();
        self.pen.forget_tiles();
        scans.len()
    }

    /// The keys of the contributions, in order, with the number of their scans.
    pub fn contributions(&self) -> impl Iterator<Item = (u64, usize)> + '_ {
        self.contributions.iter().map(|(&key, scans)| (key, scans.len()))
    }

    /// The frame of all cells of which anything is known, or `None` when nothing is.
    ///
    /// # Errors
    ///
    /// More cells than one dense grid can hold.
    pub fn frame(&self) -> Result<Option<GridFrame>, GridError> {
        let Some((low, high)) = self.sums.known_box(self.echoes()) else { return Ok(None) };
        Ok(Some(frame_of(low, high, self.options.resolution)?))
    }

    /// The map as a dense grid, cut to what is known, each cell as `read` sees its sums.
    ///
    /// # Errors
    ///
    /// Nothing known, or more cells than one dense grid can hold.
    pub fn read<T: Copy + Default>(&self, read: impl FnMut(Tally) -> T) -> Result<Grid<T>, GridError> {
        let (low, high) = self.sums.known_box(self.echoes()).ok_or(GridError::NothingKnown)?;
        let frame = frame_of(low, high, self.options.resolution)?;
        Ok(dense(&self.sums, self.echoes(), (frame, low), read))
    }

    /// The map between two corners (the south-west and the north-east, in metres) as a dense grid, each cell as `read` sees
    /// its sums; known or not, all cells that the box touches are there.
    ///
    /// # Errors
    ///
    /// Corners that are no box, or more cells than one dense grid can hold.
    pub fn read_within<T: Copy + Default>(
        &self,
        (low, high): (Point2<f64>, Point2<f64>),
        read: impl FnMut(Tally) -> T,
    ) -> Result<Grid<T>, GridError> {
        let resolution = self.options.resolution;
        let limit = MAX_POSE_CELLS * resolution;
        let inside = |at: f64| at.abs() <= limit; // NaN is not
        if !(low.x < high.x && low.y < high.y && [low.x, low.y, high.x, high.y].into_iter().all(inside)) {
            return Err(GridError::Box { west: low.x, south: low.y, east: high.x, north: high.y, limit });
        }
        #[expect(clippy::cast_possible_truncation, reason = "within a billion cells of the origin")]
        let cell = |at: f64| at as i64;
        let first = (cell((low.y / resolution).floor()), cell((low.x / resolution).floor()));
        let last = (cell((high.y / resolution).ceil()) - 1, cell((high.x / resolution).ceil()) - 1);
        let frame = frame_of(first, last, resolution)?;
        Ok(dense(&self.sums, self.echoes(), (frame, first), read))
    }

    /// The map as a dense grid of degrees of emptiness and occupancy, cut to what is known.
    ///
    /// # Errors
    ///
    /// As [`GridMap::read`].
    pub fn to_grid(&self) -> Result<FuzzyGrid, GridError> {
        self.read(|tally| self.options.degrees(tally))
    }

    /// Bytes that the cells take, without the scans that are kept to be moved.
    #[must_use]
    pub fn cell_bytes(&self) -> usize {
        self.sums.bytes() + self.echoes().map_or(0, Plane::len) * size_of::<Tile<u32>>()
    }

    /// Shares the sonar echoes out now, if the model asks for it, rather than when the map is read first.
    pub fn settle(&self) {
        self.echoes();
    }

    /// Sonar echoes shared out by what all readings say, if the sonar model asks for it.
    fn echoes(&self) -> Option<&Plane> {
        let share = || {
            let model = model_of(&self.options)?;
            let posed = self.contributions.values().flatten();
            let sonar = posed.filter(|posed| shares_echoes(&self.options, &posed.scan));
            let scans: Vec<_> = sonar.map(|posed| (&posed.map_from_robot, &posed.scan)).collect();
            (!scans.is_empty()).then(|| share_echoes(&self.sums, (model, self.options.resolution), &scans))
        };
        self.echoes.get_or_init(share).as_ref()
    }

    /// Refuses a scan that could make a cell's sums overflow.
    fn make_room(&mut self, key: u64, scan: &Scan) -> Result<(), GridError> {
        let most = self.pen.most_of(&self.options, scan);
        let fits = |largest: (u32, u32)| Some((largest.0.checked_add(most.0)?, largest.1.checked_add(most.1)?));
        let grown = fits(self.largest).or_else(|| fits(self.sums.largest()));
        self.largest = grown.ok_or(GridError::Full(key))?;
        Ok(())
    }

    fn check_pose(&self, key: u64, pose: &Isometry2<f64>) -> Result<(), GridError> {
        let (at, turn) = (pose.translation.vector, pose.rotation);
        let limit = MAX_POSE_CELLS * self.options.resolution;
        if at.x.abs() <= limit && at.y.abs() <= limit && turn.re.is_finite() && turn.im.is_finite() {
            return Ok(()); // NaN fails the comparisons
        }
        Err(GridError::Pose { key, x: at.x, y: at.y, heading: turn.angle(), limit })
    }

    fn check_range(&self, key: u64, scan: &Scan) -> Result<(), GridError> {
        let sensor = scan.sensor();
        let (range, resolution) = (longest_reach(&self.options, sensor, scan.readings()), self.options.resolution);
        if range <= f64::from(MAX_BEAM_CELLS) * resolution {
            return Ok(());
        }
        Err(GridError::Range { key, sensor: sensor.name().to_owned(), range, resolution, limit: MAX_BEAM_CELLS })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Calculus, SonarModel, assemble};
    use local_grid::{Cell, RangeSensor, SensorKind, SonarCone};
    use nalgebra::Vector2;
    use std::sync::Arc;

    fn scan(seed: usize) -> Scan {
        let width = 25f64.to_radians();
        let ring = RangeSensor::ring("sonar", SensorKind::Sonar, 16, 0.225, width, 0.15..=6.0).unwrap();
        let range = |k: usize| f64::from(u32::try_from((k * 37 + seed * 61) % 70).unwrap()) * 0.1;
        Scan::from_ranges(Arc::new(ring), (0..16).map(range)).unwrap()
    }

    fn pose(seed: usize) -> Isometry2<f64> {
        let along = f64::from(u32::try_from(seed).unwrap());
        Isometry2::new(Vector2::new(0.83 * along - 4.0, 1.3 * along.sin()), 0.7 * along)
    }

    fn same(a: &GridMap, b: &GridMap) {
        assert_eq!(a.frame().unwrap(), b.frame().unwrap());
        assert_eq!(a.read(|tally| tally).unwrap().cells(), b.read(|tally| tally).unwrap().cells());
    }

    #[test]
    fn a_map_after_any_history_equals_the_map_built_at_once() {
        for calculus in [Calculus::Fuzzy, Calculus::Bayes, Calculus::DempsterShafer] {
            let options = GridOptions { calculus, ..GridOptions::default() };
            let mut map = GridMap::new(options.clone()).unwrap();
            for key in 0..8 {
                map.insert(u64::try_from(key).unwrap() / 2, &pose(key + 11), &scan(key)).unwrap();
            }
            map.insert(9, &pose(30), &scan(30)).unwrap();
            assert_eq!(map.relocate(1, &[pose(2), pose(3)]), Ok(2));
            assert_eq!(map.remove(9), 1);
            assert_eq!(map.remove(3), 2);
            map.insert(3, &pose(7), &scan(7)).unwrap();
            map.insert(3, &pose(6), &scan(6)).unwrap();
            assert_eq!(map.relocate(0, &[pose(0), pose(1)]), Ok(2));
            assert_eq!(map.relocate(2, &[pose(4), pose(5)]), Ok(2));
            assert_eq!(map.relocate(2, &[pose(4), pose(5)]), Ok(0));
            let posed: Vec<_> = (0..8).map(|key| (pose(key), scan(key))).collect();
            same(&map, &assemble(posed.iter().map(|(pose, scan)| (pose, scan)), &options).unwrap());
        }
    }

    #[test]
    fn the_map_agrees_with_fusing_cell_by_cell() {
        let model = SonarCone::default();
        let sonar = SonarModel::Cone(model.clone());
        let options = GridOptions { sonar, most_evidence: f64::INFINITY, ..GridOptions::default() };
        let map = assemble([(&pose(1), &scan(1)), (&pose(2), &scan(2))], &options).unwrap();
        let grid = map.to_grid().unwrap();
        let mut exact = FuzzyGrid::new(*grid.frame());
        exact.integrate(&model, &pose(1), &scan(1));
        exact.integrate(&model, &pose(2), &scan(2));
        for (fast, slow) in grid.cells().iter().zip(exact.cells()) {
            approx::assert_abs_diff_eq!(fast.known().empty, slow.known().empty, epsilon = 3e-3);
            approx::assert_abs_diff_eq!(fast.known().occupied, slow.known().occupied, epsilon = 3e-3);
        }
    }

    #[test]
    fn nothing_known_is_said_plainly() {
        let map = GridMap::new(GridOptions::default()).unwrap();
        assert_eq!(map.to_grid().unwrap_err(), GridError::NothingKnown);
        assert_eq!(map.frame(), Ok(None));
    }

    #[test]
    fn nonsense_is_refused_and_changes_nothing() {
        let mut map = GridMap::new(GridOptions::default()).unwrap();
        for x in [f64::NAN, f64::INFINITY, 1e12] {
            let error = map.insert(4, &Isometry2::translation(x, 0.0), &scan(0)).unwrap_err();
            assert!(matches!(error, GridError::Pose { key: 4, .. }));
        }
        let turned = Isometry2::new(Vector2::zeros(), f64::NAN);
        assert!(matches!(map.insert(4, &turned, &scan(0)), Err(GridError::Pose { .. })));
        assert_eq!(map.relocate(4, &[]), Err(GridError::NoContribution(4)));
        map.insert(5, &pose(0), &scan(1)).unwrap();
        assert_eq!(map.relocate(5, &[]), Err(GridError::Poses { key: 5, scans: 1, poses: 0 }));
        assert_eq!(map.contributions().collect::<Vec<_>>(), [(5, 1)]);
        for resolution in [0.0, -0.1, 1e-9, 1e9, f64::NAN] {
            let options = GridOptions { resolution, ..GridOptions::default() };
            assert!(matches!(GridMap::new(options), Err(GridError::Resolution(_))));
        }
        let fine = GridOptions { resolution: 1e-4, ..GridOptions::default() };
        let mut fine = GridMap::new(fine).unwrap();
        assert!(matches!(fine.insert(0, &pose(0), &scan(1)), Err(GridError::Range { .. })));
        let model = SonarCone { depth: -1.0, ..SonarCone::default() };
        let options = GridOptions { sonar: SonarModel::Cone(model), ..GridOptions::default() };
        assert!(matches!(GridMap::new(options), Err(GridError::Model(_))));
    }
}

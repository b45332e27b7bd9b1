use std::collections::VecDeque;

use local_grid::{Grid, GridFrame};
use nalgebra::Point2;

use crate::World;

/// What a cell of the true map is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ground {
    /// Behind walls, in furniture, outside: no way leads there from the start.
    #[default]
    Hidden,
    /// Floor that is connected with the start.
    Open,
    /// A surface passes through.
    Surface,
}

impl World {
    /// The true map, as a perfect robot would draw it: surfaces at time 0, and the floor connected with the start.
    ///
    /// Cells that a surface touches are [`Ground::Surface`]; a gap narrower than a cell is closed.
    #[must_use]
    pub fn ground(&self, frame: GridFrame) -> Grid<Ground> {
        let mut grid = Grid::<Ground>::new(frame);
        for surface in self.at(0.0).surfaces() {
            let steps = (surface.length() / frame.resolution() * 4.0).ceil().max(1.0);
            let mut step = 0.0;
            while step <= steps {
                let at = surface.from + surface.along() * (step / steps);
                if let Some(cell) = frame.cell_at(at).and_then(|(row, column)| grid.get_mut(row, column)) {
                    *cell = Ground::Surface;
                }
                step += 1.0;
            }
        }
        let start = Point2::from(self.map_from_start().translation.vector);
        let open = flood(&frame, start, |index| grid.cells()[index] != Ground::Surface);
        for (cell, open) in grid.cells_mut().iter_mut().zip(open) {
            if open {
                *cell = Ground::Open;
            }
        }
        grid
    }

    /// Where the centre of a robot of `radius` metres can get from the start at time 0: true for the centre of such a cell.
    #[must_use]
    pub fn reachable(&self, frame: GridFrame, radius: f64) -> Grid<bool> {
        let scene = self.at(0.0);
        let start = Point2::from(self.map_from_start().translation.vector);
        let fits = |index: usize| {
            let center = frame.center(index / frame.columns(), index % frame.columns());
            scene.clearance(center, radius) >= radius
        };
        let mut grid = Grid::new(frame);
        grid.cells_mut().copy_from_slice(&flood(&frame, start, fits));
        grid
    }

    /// The share of the reachable floor (for a robot of `radius` metres) that lies within `distance` metres of one of
    /// `places`: the coverage of an exploration.
    #[must_use]
    pub fn coverage(&self, places: &[Point2<f64>], radius: f64, distance: f64) -> f64 {
        const CELL: f64 = 0.1;
        let (low, high) = self.bounds();
        let Ok(frame) = GridFrame::covering(low, high, CELL) else { return 0.0 };
        let (mut all, mut covered) = (0u32, 0u32);
        for (index, _) in self.reachable(frame, radius).cells().iter().enumerate().filter(|(_, reached)| **reached) {
            let center = frame.center(index / frame.columns(), index % frame.columns());
            all += 1;
            covered += u32::from(places.iter().any(|place| (place - center).norm() <= distance));
        }
        if all == 0 { 0.0 } else { f64::from(covered) / f64::from(all) }
    }
}

/// The cells connected with `start` over edges, through cells that `passes` lets through.
fn flood(frame: &GridFrame, start: Point2<f64>, passes: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut reached = vec![false; frame.n_cells()];
    let mut queue = VecDeque::new();
    let mut visit = |row: usize, column: usize, queue: &mut VecDeque<(usize, usize)>| {
        if let Some(index) = frame.index(row, column)
            && !reached[index]
            && passes(index)
        {
            reached[index] = true;
            queue.push_back((row, column));
        }
    };
    if let Some((row, column)) = frame.cell_at(start) {
        visit(row, column, &mut queue);
    }
    while let Some((row, column)) = queue.pop_front() {
        visit(row.wrapping_sub(1), column, &mut queue);
        visit(row + 1, column, &mut queue);
        visit(row, column.wrapping_sub(1), &mut queue);
        visit(row, column + 1, &mut queue);
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO_ROOMS: &str = "name = 'r'\nstart = [1, 1, 0]\n[[wall]]\npoints = [[0, 0], [8, 0], [8, 4], [0, 4]]\nclosed = true\n[[wall]]\npoints = [[4, 0], [4, 4]]\n";

    fn open_area(plan: &str) -> (f64, f64) {
        let world = World::from_plan(plan).unwrap();
        let frame = GridFrame::covering(Point2::new(-1.0, -1.0), Point2::new(9.0, 5.0), 0.1).unwrap();
        let area = |count: usize| f64::from(u32::try_from(count).unwrap()) * 0.01;
        let open = world.ground(frame).cells().iter().filter(|cell| **cell == Ground::Open).count();
        let reachable = world.reachable(frame, 0.25).cells().iter().filter(|cell| **cell).count();
        (area(open), area(reachable))
    }

    #[test]
    fn a_closed_door_hides_a_room() {
        let (open, reachable) = open_area(TWO_ROOMS);
        assert!((open - 16.0).abs() < 1.2, "{open}"); // 4 × 4 m less the cells of the walls
        assert!((reachable - 12.25).abs() < 0.8, "{reachable}"); // 3.5 × 3.5 m
        let (open, reachable) = open_area(&format!("{TWO_ROOMS}[[door]]\nfrom = [4, 1]\nto = [4, 2]\n"));
        assert!(open > 30.0 && reachable > 24.0, "{open} {reachable}");
    }

    #[test]
    fn coverage_counts_the_floor_near_places() {
        let world = World::from_plan(TWO_ROOMS).unwrap();
        let places: Vec<_> = (0..16).map(|k| Point2::new(0.5 + f64::from(k % 4), 0.5 + f64::from(k / 4))).collect();
        approx::assert_relative_eq!(world.coverage(&places, 0.25, 1.0), 1.0);
        assert!(world.coverage(&places[..8], 0.25, 1.0) < 0.8);
        assert_eq!(world.coverage(&[Point2::new(6.0, 2.0)], 0.25, 1.5), 0.0); // the room behind the wall cannot be reached
    }
}

//! What is computed once for a map: the ways from door to door.

use global_grid::plan::ways_from;
use nalgebra::{Point2, Vector2};
use robot_log::local_grid::{Grid, GridFrame};

use super::Planner;
use super::doors::reach;
use super::legs::Leg;
use super::pieces::Piece;
use super::way::{Way, cells_of};

impl Planner<'_> {
    /// Finds the doors of each piece, and the ways between these.
    pub(super) fn prepare(&mut self) {
        self.exits = vec![Vec::new(); self.pieces.pieces.len()];
        for (index, door) in self.doors.iter().enumerate() {
            for piece in door.pieces(self.map, &self.pieces) {
                self.exits[piece].push(index);
            }
        }
        self.legs = vec![Vec::new(); self.doors.len()];
        for index in 0..self.pieces.pieces.len() {
            self.join_exits(index);
        }
    }

    /// Joins the doors of a piece by the cheapest ways through it.
    fn join_exits(&mut self, piece: usize) {
        let exits = self.exits[piece].clone();
        if exits.len() < 2 {
            return;
        }
        let region = self.pieces.pieces[piece].region;
        let cells = self.part(self.pieces.pieces[piece], &exits);
        let points: Vec<Point2<f64>> = exits.iter().map(|&exit| self.doors[exit].point).collect();
        for (k, &from) in exits.iter().enumerate() {
            let ways = ways_from(&cells, points[k], &points[k + 1..], &self.options);
            for (&to, path) in exits[k + 1..].iter().zip(ways) {
                let Some(path) = path else { continue };
                let way = self.ways.len();
                self.ways.push(Way::of(&cells_of(&path.points, self.unsafety.frame())));
                // Backwards it costs the same, but for the difference of its ends.
                self.legs[from].push(Leg { to, region, cost: path.cost, way: (way, false) });
                self.legs[to].push(Leg { to: from, region, cost: path.cost, way: (way, true) });
            }
        }
    }

    /// The unsafety of the cells of a piece and of its doors; all else is out of bounds.
    pub(super) fn part(&self, piece: Piece, exits: &[usize]) -> Grid<f32> {
        let frame = self.unsafety.frame();
        let around = piece.window.grown(reach(frame), frame.rows(), frame.columns());
        let ([low, high], [left, right]) = (around.rows, around.columns);
        #[expect(clippy::cast_precision_loss, reason = "rows and columns of a grid")]
        let corner = Vector2::new(left as f64, low as f64) * frame.resolution();
        let window = GridFrame::new(frame.origin() + corner, frame.resolution(), high - low, right - left);
        let mut part = Grid::new(window.expect("a part of a grid is a grid"));
        part.cells_mut().fill(1.0);
        for row in piece.window.rows[0]..piece.window.rows[1] {
            for column in piece.window.columns[0]..piece.window.columns[1] {
                let index = row * frame.columns() + column;
                if self.map.labels.cells()[index] == piece.region {
                    part.cells_mut()[(row - low) * (right - left) + column - left] = self.unsafety.cells()[index];
                }
            }
        }
        exits.iter().for_each(|&exit| self.open(&mut part, exit));
        part
    }

    /// Opens the cells around a door, whichever region they were given to.
    fn open(&self, part: &mut Grid<f32>, exit: usize) {
        self.doors[exit].sill(*part.frame(), |row, column, point| {
            if let (Some(cell), Some(unsafety)) = (part.get_mut(row, column), self.unsafety.at(point)) {
                *cell = *unsafety;
            }
        });
    }
}

//! Ways through fixed doors, made straight again around these.

use robot_log::local_grid::Grid;

use super::way::{Cell, wide};
use global_grid::plan::PlanOptions;

/// So far from a door, in cells along the way, a straight line is tried first, and then half as far, and so on.
const FARTHEST: usize = 256;
/// The nearest that is tried.
const NEAREST: usize = 2;

/// What ways are judged by.
pub(super) struct Ground<'a> {
    pub(super) unsafety: &'a Grid<f32>,
    pub(super) options: &'a PlanOptions,
}

impl Ground<'_> {
    /// Replaces the way around each joint by a straight line where that is cheaper; `joints` are indices of cells.
    pub(super) fn straighten(&self, mut cells: Vec<Cell>, joints: &[usize]) -> Vec<Cell> {
        // From behind, so that most joints before keep their places; one that a line swallowed says where another is tried.
        for &joint in joints.iter().rev() {
            let reaches = std::iter::successors(Some(FARTHEST), |far| Some(far / 2)).take_while(|far| *far >= NEAREST);
            for far in reaches {
                let (from, to) = (joint.saturating_sub(far), (joint + far).min(cells.len().saturating_sub(1)));
                let Some(cost) = cells.get(from..=to).and_then(|way| self.cost(way, f64::INFINITY)) else { continue };
                if let Some(line) = self.cheaper_line(cells[from], cells[to], cost - 1e-6) {
                    cells.splice(from..=to, line);
                }
            }
        }
        cells
    }

    /// A shortest way between two cells, if the robot may go it and it costs less than so much.
    fn cheaper_line(&self, from: Cell, to: Cell, most: f64) -> Option<Vec<Cell>> {
        (0..3).map(|shape| line(from, to, shape)).find(|line| self.cost(line, most).is_some())
    }

    /// What a way costs, in cells; `None` where it enters a forbidden cell, cuts a corner, or costs more than so much.
    fn cost(&self, way: &[Cell], most: f64) -> Option<f64> {
        let mut cost = 0.0;
        for pair in way.windows(2) {
            let ([row, column], [next_row, next_column]) = (pair[0], pair[1]);
            let diagonal = row != next_row && column != next_column;
            if diagonal {
                self.risk([row, next_column])?;
                self.risk([next_row, column])?;
            }
            let length = if diagonal { std::f64::consts::SQRT_2 } else { 1.0 };
            cost += length * (1.0 + self.options.risk_weight * self.risk(pair[1])?);
            if cost > most {
                return None;
            }
        }
        Some(cost)
    }

    /// How unsafe a cell is, if it is not forbidden.
    fn risk(&self, [row, column]: Cell) -> Option<f64> {
        let risk = f64::from(*self.unsafety.get(wide(row), wide(column))?);
        (risk <= self.options.forbidden + 1e-6).then_some(risk)
    }
}

/// One of the shortest ways between two cells that go from neighbour to neighbour: slanting first, slanting last, or along
/// the straight line.
fn line(from: Cell, to: Cell, shape: u8) -> Vec<Cell> {
    let [up, right] = [to[0] - from[0], to[1] - from[1]];
    let (n, slanting) = (up.abs().max(right.abs()), up.abs().min(right.abs()));
    let first = |length: i32, k: i32| length.signum() * if length.abs() == n { k } else { k.min(slanting) };
    let at = |length: i32, k: i32| match shape {
        0 => first(length, k),
        1 => length - first(length, n - k),
        _ => (2 * length * k + n).div_euclid(2 * n.max(1)),
    };
    (0..=n).map(|k| [from[0] + at(up, k), from[1] + at(right, k)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_go_from_cell_to_neighbour() {
        for to in [[0, 0], [7, 3], [-7, 3], [3, -7], [-5, -5], [0, 9]] {
            for line in (0..3).map(|shape| line([0, 0], to, shape)) {
                assert_eq!((line[0], line.last()), ([0, 0], Some(&to)));
                let step = |pair: &[Cell]| (pair[1][0] - pair[0][0]).abs().max((pair[1][1] - pair[0][1]).abs());
                assert!(line.windows(2).all(|pair| step(pair) == 1));
            }
        }
    }
}

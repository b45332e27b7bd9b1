use nalgebra::Vector2;

use super::patch::cell_of;

/// The cells of a line from point to point, column by column along the longer of its axes: within a column it climbs by one row
/// at most.
///
/// Which border comes next, that of a row or of a column, is as good as chance, and a processor that guesses it wrong loses
/// more time than a cell is worth. Column by column nothing is to be guessed: there are two cells, which may be the same.
#[derive(Debug)]
pub(super) struct Line {
    /// Whether columns are counted along y.
    is_steep: bool,
    column: i32,
    step: i32,
    /// Where the line enters the column and leaves it, in rows, with 32 binary digits behind the point.
    enters: i64,
    leaves: i64,
    slope: i64,
    /// Column and row of the last cell.
    last: (i32, i32),
}

impl Line {
    /// The line between two points given in cells, if they lie in cells.
    pub(super) fn between(from: Vector2<f64>, to: Vector2<f64>) -> Option<Self> {
        let way = to - from;
        let is_steep = way.y.abs() > way.x.abs();
        let turned = |point: Vector2<f64>| if is_steep { point.yx() } else { point };
        let (from, way, first, last) = (turned(from), turned(way), cell_of(turned(from))?, cell_of(turned(to))?);
        let step = if way.x < 0.0 { -1 } else { 1 };
        let border = f64::from(first.0 + i32::from(step > 0));
        let slope = if way.x == 0.0 { 0.0 } else { way.y / way.x.abs() };
        let leaves = from.y + slope * (border - from.x).abs();
        Some(Self {
            is_steep,
            column: first.0,
            step,
            enters: fixed(from.y),
            leaves: fixed(leaves),
            slope: fixed(slope),
            last,
        })
    }

    /// Whether columns are counted along y.
    pub(super) fn is_steep(&self) -> bool {
        self.is_steep
    }

    /// The column at hand, and the rows in which the line enters and leaves it.
    #[inline]
    pub(super) fn here(&self) -> (i32, i32, i32) {
        (self.column, row(self.enters), row(self.leaves))
    }

    /// Whether the line ends in the column at hand.
    #[inline]
    pub(super) fn ends_here(&self) -> bool {
        self.column == self.last.0
    }

    #[inline]
    pub(super) fn advance(&mut self) {
        self.column += self.step;
        self.enters = self.leaves;
        self.leaves += self.slope;
    }

    /// The row of the last cell.
    pub(super) fn last_row(&self) -> i32 {
        self.last.1
    }

    /// The cell at a column and row, as x and y.
    pub(super) fn cell(&self, column: i32, row: i32) -> (i32, i32) {
        if self.is_steep { (row, column) } else { (column, row) }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "cells are below 1e9, and 2^30 has room for 32 digits more")]
fn fixed(x: f64) -> i64 {
    (x * 4_294_967_296.0) as i64
}

fn row(fixed: i64) -> i32 {
    (fixed >> 32) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All cells but the last, each once.
    fn cells(from: Vector2<f64>, to: Vector2<f64>) -> Vec<(i32, i32)> {
        let mut line = Line::between(from, to).unwrap();
        let mut cells = Vec::new();
        while !line.ends_here() {
            let (column, row, then) = line.here();
            cells.push(line.cell(column, row));
            cells.extend((then != row).then(|| line.cell(column, then)));
            line.advance();
        }
        let (column, row, _) = line.here();
        cells.extend((row != line.last_row()).then(|| line.cell(column, row)));
        cells
    }

    #[test]
    fn a_line_leads_from_cell_to_neighbouring_cell() {
        let from = Vector2::new(-0.37, 0.21);
        for degrees in 0..360 {
            let angle = f64::from(degrees).to_radians();
            let to = from + Vector2::new(angle.cos(), angle.sin()) * 37.3;
            let last = cell_of(to).unwrap();
            let mut way = cells(from, to);
            way.push(last);
            assert_eq!(way[0], cell_of(from).unwrap());
            let is_step = |pair: &[(i32, i32)]| (pair[1].0 - pair[0].0).abs() + (pair[1].1 - pair[0].1).abs() == 1;
            assert!(way.windows(2).all(is_step), "{degrees}°: {way:?}");
            let steps = (last.0 - way[0].0).abs() + (last.1 - way[0].1).abs();
            assert_eq!(way.len(), usize::try_from(steps).unwrap() + 1, "{degrees}°");
        }
    }

    #[test]
    fn a_line_within_a_cell_has_no_other() {
        assert!(cells(Vector2::new(0.2, 0.3), Vector2::new(0.2, 0.3)).is_empty());
        assert!(cells(Vector2::new(0.2, 0.3), Vector2::new(0.9, 0.1)).is_empty());
        assert_eq!(cells(Vector2::new(0.2, 0.3), Vector2::new(0.9, -0.1)), [(0, 0)]);
        assert!(Line::between(Vector2::new(f64::NAN, 0.0), Vector2::zeros()).is_none());
    }
}

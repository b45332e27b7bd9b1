//! Floor that the map shows and no place covers: what the explorer's look into single directions has missed.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use local_grid::{Grid, GridFrame};
use nalgebra::{Point2, Vector2};
use region_map::{Element, Logic, erode};
use topo_map::PlaceId;

/// A spot on open floor to which nobody has been.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frontier {
    /// The visited place from which the way there is shortest.
    pub(super) seen_from: PlaceId,
    /// Where it lies, seen from there, in metres.
    pub(super) toward: Vector2<f64>,
}

/// The spots that were looked for before; none is looked for twice.
#[derive(Debug, Default)]
pub(super) struct Frontiers {
    asked: Vec<Point2<f64>>,
}

/// Floor is what the map calls floor to at least this degree...
const FLOOR: f32 = 0.4;
/// ...where it is so wide to each side, in metres: maps draw walls thicker and doors narrower than they are, and whether the
/// robot fits through is found out when it stands before it.
const GAP: f64 = 0.1;
/// A spot has so much room to each side, in metres.
const ROOM: f64 = 0.15;
/// So much floor must be left over in one piece, in square metres: what a sonar sees of a room through its door.
const WORTH: f64 = 0.05;
/// Spots nearer to each other, in metres, are one.
const APART: f64 = 0.8;

impl Frontiers {
    /// The nearest spot of every piece of `floor` from which the way to all `places` is longer than `covered` metres, if the
    /// place nearest to it is one from which it `may` be looked for and it was not answered before.
    ///
    /// Ways are measured over the floor, not through walls. Where the map has floor beyond a wall, since sonar hears past
    /// it, the spot is refuted on the way there, once.
    pub(super) fn find(
        &mut self,
        floor: &Grid<f32>,
        places: &[(PlaceId, Point2<f64>)],
        covered: f64,
        may: impl Fn(PlaceId) -> bool,
    ) -> Vec<Frontier> {
        let resolution = floor.frame().resolution();
        let wide = |radius: f64| erode(floor, &Element::disc(radius, resolution), Logic::Goedel);
        let (ways, room) = (Ways::over(&wide(GAP), places), wide(ROOM));
        let is_left = |(way, room): (&f64, &f32)| way.is_finite() && *way > covered && *room > FLOOR;
        let left = ways.length.iter().zip(room.cells()).map(is_left).collect();
        let mut found = Vec::new();
        for piece in pieces(floor.frame(), left) {
            if count(piece.len()) * resolution * resolution < WORTH {
                continue;
            }
            let nearest = piece.into_iter().min_by(|a, b| ways.length[*a].total_cmp(&ways.length[*b]).then(a.cmp(b)));
            let Some((cell, (place, at))) = nearest.and_then(|cell| Some((cell, places[ways.from[cell]?]))) else {
                continue;
            };
            let spot = center(floor.frame(), cell);
            if may(place) && self.asked.iter().all(|asked| (asked - spot).norm() >= APART) {
                self.asked.push(spot);
                found.push(Frontier { seen_from: place, toward: spot - at });
            }
        }
        found
    }
}

/// The shortest way over the floor from any place to each cell: its length in metres, and the place by its number in a list.
struct Ways {
    length: Vec<f64>,
    from: Vec<Option<usize>>,
}

/// A cell that can be reached, the nearest first.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reached {
    length: f64,
    cell: usize,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.length.total_cmp(&self.length).then(other.cell.cmp(&self.cell))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ways {
    /// Dijkstra over the eight neighbours of each cell, from all visited places at once.
    fn over(floor: &Grid<f32>, places: &[(PlaceId, Point2<f64>)]) -> Self {
        let frame = floor.frame();
        let mut ways = Self { length: vec![f64::INFINITY; frame.n_cells()], from: vec![None; frame.n_cells()] };
        let mut queue = BinaryHeap::new();
        for (number, (_, at)) in places.iter().enumerate() {
            let cell = frame.cell_at(*at).and_then(|(row, column)| frame.index(row, column));
            if let Some(cell) = cell.filter(|cell| ways.from[*cell].is_none()) {
                (ways.length[cell], ways.from[cell]) = (0.0, Some(number));
                queue.push(Reached { length: 0.0, cell });
            }
        }
        while let Some(Reached { length, cell }) = queue.pop() {
            if length > ways.length[cell] {
                continue;
            }
            for (next, step) in around(frame, cell) {
                let longer = length + step * frame.resolution();
                if floor.cells()[next] > FLOOR && longer < ways.length[next] {
                    (ways.length[next], ways.from[next]) = (longer, ways.from[cell]);
                    queue.push(Reached { length: longer, cell: next });
                }
            }
        }
        ways
    }
}

/// The cells beside and across from a cell, and how far they are, in cells.
fn around(frame: &GridFrame, cell: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
    let (frame, row, column) = (*frame, cell / frame.columns(), cell % frame.columns());
    let steps = [-1_isize, 0, 1].into_iter().flat_map(|down| [-1_isize, 0, 1].map(|right| (down, right)));
    steps.filter(|step| *step != (0, 0)).filter_map(move |(down, right)| {
        let next = frame.index(row.checked_add_signed(down)?, column.checked_add_signed(right)?)?;
        Some((next, if down != 0 && right != 0 { std::f64::consts::SQRT_2 } else { 1.0 }))
    })
}

/// The cells that are left, in pieces that hang together.
fn pieces(frame: &GridFrame, mut left: Vec<bool>) -> Vec<Vec<usize>> {
    let mut pieces = Vec::new();
    for first in 0..left.len() {
        if !std::mem::replace(&mut left[first], false) {
            continue;
        }
        let (mut piece, mut next) = (vec![first], 0);
        while next < piece.len() {
            for (beside, _) in around(frame, piece[next]) {
                if std::mem::replace(&mut left[beside], false) {
                    piece.push(beside);
                }
            }
            next += 1;
        }
        pieces.push(piece);
    }
    pieces
}

fn center(frame: &GridFrame, cell: usize) -> Point2<f64> {
    frame.center(cell / frame.columns(), cell % frame.columns())
}

#[expect(clippy::cast_precision_loss, reason = "cells of a map are far fewer than 2^52")]
fn count(cells: usize) -> f64 {
    cells as f64
}

#[cfg(test)]
mod tests {
    use topo_map::TopoMap;

    use super::*;

    /// Two rooms of 3 × 3 m side by side, with a gap of `gap` cells of 0.1 m in the wall between them.
    fn two_rooms(gap: usize) -> Grid<f32> {
        let frame = GridFrame::new(Point2::origin(), 0.1, 32, 63).unwrap();
        let mut floor = Grid::new(frame);
        for row in 1..31 {
            for column in 1..62 {
                let open = column != 31 || (14..14 + gap).contains(&row);
                floor.cells_mut()[row * 63 + column] = f32::from(u8::from(open));
            }
        }
        floor
    }

    fn places() -> Vec<(PlaceId, Point2<f64>)> {
        let mut map = TopoMap::new();
        let spots = [
            (0.6, 0.6),
            (1.6, 0.6),
            (2.5, 0.6),
            (0.6, 1.6),
            (1.6, 1.6),
            (2.5, 1.6),
            (0.6, 2.5),
            (1.6, 2.5),
            (2.5, 2.5),
        ];
        spots.iter().map(|&(x, y)| (map.add_place(()).unwrap(), Point2::new(x, y))).collect()
    }

    #[test]
    fn a_room_behind_an_overlooked_door_is_a_frontier_once() {
        let (floor, places, mut frontiers) = (two_rooms(6), places(), Frontiers::default());
        let found = frontiers.find(&floor, &places, 1.0, |_| true);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].seen_from, places[5].0); // the place before the door
        let spot = places[5].1 + found[0].toward;
        assert!(spot.x > 3.2 && found[0].toward.norm() < 1.3, "{spot}");
        assert!(frontiers.find(&floor, &places, 1.0, |_| true).is_empty());
    }

    #[test]
    fn what_lies_behind_a_wall_or_a_crack_is_no_frontier() {
        for gap in [0, 2] {
            assert!(Frontiers::default().find(&two_rooms(gap), &places(), 1.0, |_| true).is_empty());
        }
    }
}

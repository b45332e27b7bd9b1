use std::collections::HashMap;

use nalgebra::{Point2, Vector2};
use topo_map::PlaceId;

/// Which places lie where: a lattice of squares, so that finding those near a point costs what is near, whatever the map's size.
#[derive(Debug, Clone, Default)]
pub(super) struct Spots {
    squares: HashMap<[i64; 2], Vec<PlaceId>>,
}

/// The side of a square, in metres.
const SIDE: f64 = 4.0;

impl Spots {
    pub(super) fn of(positions: impl Iterator<Item = Vector2<f64>>) -> Self {
        let mut spots = Self::default();
        (0..).map(PlaceId).zip(positions).for_each(|(place, at)| spots.put(place, at));
        spots
    }

    pub(super) fn put(&mut self, place: PlaceId, at: Vector2<f64>) {
        self.squares.entry(square(at)).or_default().push(place);
    }

    pub(super) fn shift(&mut self, place: PlaceId, from: Vector2<f64>, to: Vector2<f64>) {
        if square(from) != square(to) {
            if let Some(places) = self.squares.get_mut(&square(from)) {
                places.retain(|other| *other != place);
            }
            self.put(place, to);
        }
    }

    /// The places in all squares that come within `radius` of a point, by number.
    pub(super) fn around(&self, at: Point2<f64>, radius: f64) -> Vec<PlaceId> {
        let (low, high) = (square(at.coords.add_scalar(-radius)), square(at.coords.add_scalar(radius)));
        let rows = (low[1]..=high[1]).flat_map(|y| (low[0]..=high[0]).map(move |x| [x, y]));
        let mut places: Vec<PlaceId> = rows.filter_map(|square| self.squares.get(&square)).flatten().copied().collect();
        places.sort_unstable();
        places
    }
}

#[expect(clippy::cast_possible_truncation, reason = "saturating, and farther than any robot goes")]
fn square(at: Vector2<f64>) -> [i64; 2] {
    [(at.x / SIDE).floor() as i64, (at.y / SIDE).floor() as i64]
}

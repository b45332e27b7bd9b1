//! Gateways: where one passes from one region into another.

use local_grid::{
    Grid,
    nalgebra::{Isometry2, Point2, Vector2},
};

use crate::segment::gate::Gate;

/// A passage between two regions: a door, a junction, an opening.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gateway {
    /// The labels of the two regions, the smaller first.
    pub regions: [u16; 2],
    /// Where the walls end on both sides, in metres.
    pub ends: [Point2<f64>; 2],
    /// The middle between the ends.
    pub center: Point2<f64>,
    /// Free width in metres.
    pub width: f64,
    /// Unit vector across the gateway, from `regions[0]` into `regions[1]`.
    pub normal: Vector2<f64>,
    /// Mean membership in "free" of the cells on the line between the ends, in `[0, 1]`.
    pub confidence: f64,
    /// Whether it is known to be closed at present, whatever the grid says: no [`route`](crate::RegionMap::route) leads
    /// through it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub blocked: bool,
}

impl Gateway {
    /// Describes a cut between two labelled sides; `sides` are the labels on its left (`-1`) and right.
    pub(crate) fn new(gate: &Gate, sides: [u16; 2], free: &Grid<f32>, origin: (usize, usize)) -> Self {
        let frame = free.frame();
        let point = |(row, column): (i32, i32)| {
            let step = |n: i32, shift: usize| f64::from(n) - 1.0 + shift as f64 + 0.5;
            frame.origin() + Vector2::new(step(column, origin.1), step(row, origin.0)) * frame.resolution()
        };
        let ends = gate.ends.map(point);
        let (row, column) = gate.along();
        // Side +1 lies at (−along.column, along.row), see `Gate::across`.
        let mut normal = Vector2::new(row, -column);
        let mut regions = sides;
        if regions[0] > regions[1] {
            regions.swap(0, 1);
            normal = -normal;
        }
        let center = ends[0] + (ends[1] - ends[0]) / 2.0;
        Self {
            regions,
            ends,
            center,
            width: gate.width * frame.resolution(),
            normal,
            confidence: membership(free, ends),
            blocked: false,
        }
    }

    /// The gateway in another frame.
    #[must_use]
    pub fn moved(&self, other_from_this: &Isometry2<f64>) -> Self {
        Self {
            ends: self.ends.map(|end| other_from_this * end),
            center: other_from_this * self.center,
            normal: other_from_this * self.normal,
            ..self.clone()
        }
    }

    /// Whether two cuts lie in one passage: one behind the other, not side by side.
    pub(crate) fn is_same_passage(&self, other: &Self) -> bool {
        let step = other.center - self.center;
        let behind = step.dot(&self.normal).abs();
        let beside = (step.norm_squared() - behind * behind).max(0.0).sqrt();
        self.regions == other.regions && behind < THICKEST_WALL && beside < (self.width + other.width) / 2.0
    }
}

/// Two cuts across one passage are less than this far apart along it, in metres: the thickest of walls.
const THICKEST_WALL: f64 = 1.0;

/// Mean membership of the cells between the ends, the wall cells at the ends left out.
fn membership(free: &Grid<f32>, [a, b]: [Point2<f64>; 2]) -> f64 {
    let steps = ((b - a).norm() / free.frame().resolution()).round().max(2.0);
    let (mut sum, mut count, mut step) = (0.0, 0.0_f64, 1.0);
    while step < steps {
        if let Some(&value) = free.at(a + (b - a) * (step / steps)) {
            sum += f64::from(value);
            count += 1.0;
        }
        step += 1.0;
    }
    sum / count.max(1.0)
}

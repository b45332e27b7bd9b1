//! Regions: how large, how long, which way they lie, and whether they are rooms or corridors.

pub(crate) mod outline;
pub(crate) mod survey;

use std::f64::consts::PI;

use local_grid::nalgebra::{Isometry2, Point2, Vector2};

/// A room, a corridor, or something between.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Region {
    /// Its label in [`RegionMap::labels`](crate::RegionMap::labels), from 1.
    pub label: u16,
    /// What people call it.
    pub name: Option<String>,
    /// Area in square metres: the sum of the memberships in "free" times that of a cell. Free-standing furniture is included.
    pub area: f64,
    /// Centre of area; it may lie outside of the region where this is bent.
    pub centroid: Point2<f64>,
    /// The place in it that is farthest from walls: a good goal.
    pub inside: Point2<f64>,
    /// Length of the rectangle with the same second moments, or of the bent strip, in metres.
    pub length: f64,
    /// Width of the rectangle with the same second moments, or of the bent strip, in metres.
    pub width: f64,
    /// Direction of the long axis in `(-π/2, π/2]`, radians from `+x`, counter-clockwise.
    pub orientation: f64,
    /// Length over width, at least 1.
    pub elongation: f64,
    /// Membership in "corridor", in `[0, 1]`.
    pub corridor: f64,
    /// Membership in "room", in `[0, 1]`.
    pub room: f64,
    /// Length of border on unexplored cells, in metres.
    pub frontier: f64,
    /// Length of border on walls, in metres.
    pub wall: f64,
}

impl Region {
    /// The region in another frame.
    #[must_use]
    pub fn moved(&self, other_from_this: &Isometry2<f64>) -> Self {
        let turned = self.orientation + other_from_this.rotation.angle();
        let half_turns = (turned / PI + 0.5).ceil() - 1.0; // an axis has no front: (-π/2, π/2]
        Self {
            centroid: other_from_this * self.centroid,
            inside: other_from_this * self.inside,
            orientation: turned - half_turns * PI,
            ..self.clone()
        }
    }
}

/// Weighted sums over the cells of one region, in cells.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Moments {
    pub(crate) weight: f64,
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) xx: f64,
    pub(crate) xy: f64,
    pub(crate) yy: f64,
}

impl Moments {
    pub(crate) fn add(&mut self, x: f64, y: f64, weight: f64) {
        self.weight += weight;
        self.x += weight * x;
        self.y += weight * y;
        self.xx += weight * x * x;
        self.xy += weight * x * y;
        self.yy += weight * y * y;
    }

    /// Centre, length, width and orientation of the rectangle with these moments: `L = √(12 λ₁)`, `W = √(12 λ₂)`.
    pub(crate) fn rectangle(&self) -> (Vector2<f64>, f64, f64, f64) {
        let (x, y) = (self.x / self.weight, self.y / self.weight);
        // A cell is a square, not a point: it has a second moment of 1/12 by itself.
        let xx = self.xx / self.weight - x * x + 1.0 / 12.0;
        let yy = self.yy / self.weight - y * y + 1.0 / 12.0;
        let xy = self.xy / self.weight - x * y;
        let (middle, spread) = ((xx + yy) / 2.0, ((xx - yy) / 2.0).hypot(xy));
        let orientation = 0.5 * (2.0 * xy).atan2(xx - yy);
        let side = |eigenvalue: f64| (12.0 * eigenvalue).max(0.0).sqrt();
        (Vector2::new(x, y), side(middle + spread), side(middle - spread), orientation)
    }
}

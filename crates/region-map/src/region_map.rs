//! Regions and what joins them.

use local_grid::{Grid, nalgebra::Point2};

use crate::{gateways::Gateway, regions::Region};

/// Regions of a grid, and the gateways between them.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RegionMap {
    /// The label of every cell, 0 where there is none.
    pub labels: Grid<u16>,
    /// The regions; `regions[k]` has label `k + 1`.
    pub regions: Vec<Region>,
    /// The gateways, in order of the regions they join.
    pub gateways: Vec<Gateway>,
}

impl RegionMap {
    /// The region that holds a point.
    #[must_use]
    pub fn region_at(&self, point: Point2<f64>) -> Option<&Region> {
        self.region(*self.labels.at(point)?)
    }

    /// The region of a label.
    #[must_use]
    pub fn region(&self, label: u16) -> Option<&Region> {
        self.regions.get(usize::from(label).checked_sub(1)?)
    }
}

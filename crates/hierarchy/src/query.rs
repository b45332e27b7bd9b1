use global_grid::{CrispOptions, Occupancy, occupancy};
use region_map::{Options, RegionMap, SegmentError, segment_explored};
use robot_log::local_grid::FuzzyGrid;
use topo_map::PlaceId;

use crate::mapper::Mapper;
use crate::metrics::RegionMetrics;

/// Cuts a gridmap into rooms, corridors and gateways; what is unexplored is told from walls.
///
/// # Errors
///
/// A map that falls into more than 65535 regions.
pub fn regions(gridmap: &FuzzyGrid) -> Result<RegionMap, SegmentError> {
    let crisp = occupancy(gridmap, &CrispOptions::default());
    let free = crisp.map(|cell| if *cell == Occupancy::Free { 1.0 } else { 0.0 });
    let unknown = crisp.map(|cell| *cell == Occupancy::Unknown);
    segment_explored(&free, &unknown, &Options::default())
}

/// How many rooms, corridors and gateways there are.
#[must_use]
pub fn count_regions(map: &RegionMap) -> RegionMetrics {
    let corridors = map.regions.iter().filter(|region| region.corridor > region.room).count();
    RegionMetrics { rooms: map.regions.len() - corridors, corridors, gateways: map.gateways.len() }
}

impl Mapper {
    /// The label of the region in which each visited place lies; `None` for one that lies in none.
    #[must_use]
    pub fn places_in(&self, map: &RegionMap) -> Vec<(PlaceId, Option<u16>)> {
        let visited = self.topology().places().iter().filter(|place| place.is_visited());
        let region = |place: PlaceId| {
            let spot = self.coordinates().map_from_place(place).translation.vector.into();
            map.region_at(spot).map(|region| region.label)
        };
        visited.map(|place| (place.id, region(place.id))).collect()
    }
}

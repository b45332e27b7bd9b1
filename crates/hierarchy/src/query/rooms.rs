use global_grid::Exposure;
use nalgebra::Isometry2;
use region_map::{NoSuchRegion, Options, RegionMap, SegmentError, segment_explored};
use robot_log::local_grid::FuzzyGrid;
use topo_map::PlaceId;

use super::floor::floor;
use crate::mapper::Mapper;
use crate::metrics::RegionMetrics;
use crate::query::floor_plan::Passage;

/// Cuts a gridmap into rooms, corridors and gateways; what is unexplored is told from walls. `driven` are poses of the robot
/// in the order in which it drove, or none: see [`floor`].
///
/// # Errors
///
/// A map that falls into more than 65535 regions.
pub fn regions(gridmap: &FuzzyGrid, driven: &[Isometry2<f64>]) -> Result<RegionMap, SegmentError> {
    let free = floor(gridmap, driven);
    let options = Options::robot_map();
    let exposure = Exposure::of(gridmap);
    let mut unknown = gridmap.map(|cell| exposure.of_cell(*cell).occupied <= OCCUPIED);
    unknown.cells_mut().iter_mut().zip(free.cells()).for_each(|(unknown, free)| *unknown &= *free <= options.threshold);
    segment_explored(&free, &unknown, &options)
}

/// A cell of more than this degree of occupancy is known, and be it only as a wall.
const OCCUPIED: f32 = 0.5;

/// How many rooms, corridors and gateways there are.
#[must_use]
pub fn count_regions(map: &RegionMap) -> RegionMetrics {
    let corridors = map.regions.iter().filter(|region| region.corridor > region.room).count();
    RegionMetrics { rooms: map.regions.len() - corridors, corridors, gateways: map.gateways.len() }
}

impl Mapper {
    /// Cuts a gridmap of this map into regions, as [`regions`] does, along all that was driven, and remembers them: names and closed gateways that
    /// are known from before are found again, wherever relaxation has moved them. A gateway that was last seen shut is
    /// closed until it is seen open; what a person closed stays closed.
    ///
    /// # Errors
    ///
    /// As [`regions`].
    pub fn survey(&mut self, gridmap: &FuzzyGrid) -> Result<RegionMap, SegmentError> {
        let mut map = regions(gridmap, &self.poses())?;
        let places = self.visited_poses();
        self.floor_plan_mut().renew(&mut map, &places);
        let seen = self.doors_last_seen(&map);
        self.floor_plan_mut().see_doors(&mut map, &seen);
        Ok(map)
    }

    /// Gives a region of the map that was last [surveyed](Mapper::survey) a name, or takes it away with an empty one.
    ///
    /// # Errors
    ///
    /// There is no region with this label.
    pub fn name_region(&mut self, map: &mut RegionMap, label: u16, name: &str) -> Result<(), NoSuchRegion> {
        map.name(label, name)?;
        let name = (!name.is_empty()).then(|| name.to_owned());
        let known = self.floor_plan_mut().regions.iter_mut().find(|region| region.label == Some(label));
        map.regions[usize::from(label) - 1].name.clone_from(&name);
        known.ok_or(NoSuchRegion { label, count: map.regions.len() })?.name = name;
        Ok(())
    }

    /// Opens or closes a gateway of the map that was last [surveyed](Mapper::survey); answers whether there is such a one.
    pub fn set_passage(&mut self, map: &mut RegionMap, gateway: usize, passage: Passage) -> bool {
        self.floor_plan_mut().set_passage(map, gateway, passage);
        gateway < map.gateways.len()
    }

    pub(super) fn visited_poses(&self) -> Vec<(PlaceId, Isometry2<f64>)> {
        let visited = self.topology().places().iter().filter(|place| place.is_visited());
        visited.map(|place| (place.id, self.coordinates().map_from_place(place.id))).collect()
    }

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

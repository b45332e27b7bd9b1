use nalgebra::Isometry2;
use region_map::{Element, Logic, NoSuchRegion, Options, RegionMap, SegmentError, dilate, erode, segment_explored};
use robot_log::local_grid::{FuzzyGrid, Grid};
use topo_map::PlaceId;

use crate::floor_plan::Passage;
use crate::mapper::Mapper;
use crate::metrics::RegionMetrics;

/// Cuts a gridmap into rooms, corridors and gateways; what is unexplored is told from walls.
///
/// # Errors
///
/// A map that falls into more than 65535 regions.
pub fn regions(gridmap: &FuzzyGrid) -> Result<RegionMap, SegmentError> {
    let free = floor(gridmap);
    let threshold = Options::robot_map().threshold;
    let mut unknown = gridmap.map(|cell| cell.occupied <= OCCUPIED);
    unknown.cells_mut().iter_mut().zip(free.cells()).for_each(|(unknown, free)| *unknown &= *free <= threshold);
    segment_explored(&free, &unknown, &Options::robot_map())
}

/// Membership of each cell in "floor": empty, as far as that is known, and not contradicted by echoes.
///
/// A wall between two rooms is seen from both of them, and rays along it pass its cells by: sonar leaves it as empty as it
/// is occupied. So what counts is the share of the evidence that says "occupied", in logarithms, where evidence adds up:
///
/// ```text
/// floor = min(E / 0.4, 1 − s / 0.6)      s = ln(1 − O) / (ln(1 − E) + ln(1 − O))
/// ```
///
/// `O` is closed before (dilated and eroded by a disc of 0.2 m): echoes dot a wall, and nobody passes between two dots.
#[must_use]
pub fn floor(gridmap: &FuzzyGrid) -> Grid<f32> {
    let disc = Element::disc(WALL_GAP / 2.0, gridmap.frame().resolution());
    let occupied = gridmap.map(|cell| cell.occupied.clamp(0.0, 1.0));
    let mut floor = erode(&dilate(&occupied, &disc, Logic::Goedel), &disc, Logic::Goedel);
    for (cell, fuzzy) in floor.cells_mut().iter_mut().zip(gridmap.cells()) {
        *cell = membership(fuzzy.empty.clamp(0.0, 1.0), *cell);
    }
    floor
}

/// Echoes closer than this, in metres, are of one wall: half a door.
const WALL_GAP: f64 = 0.4;
/// A cell of this degree of emptiness is as empty as a handful of readings makes it.
const EMPTY: f32 = 0.4;
/// A cell is no floor at all where this share of the evidence says "occupied".
const CONTRADICTED: f32 = 0.6;
/// A cell of more than this degree of occupancy is known, and be it only as a wall.
const OCCUPIED: f32 = 0.5;

fn membership(empty: f32, occupied: f32) -> f32 {
    let evidence = |degree: f32| -(1.0 - degree).max(1e-6).ln();
    let (empty_evidence, occupied_evidence) = (evidence(empty), evidence(occupied));
    let share = occupied_evidence / (empty_evidence + occupied_evidence).max(f32::MIN_POSITIVE);
    (empty / EMPTY).min(1.0 - share / CONTRADICTED).clamp(0.0, 1.0)
}

/// How many rooms, corridors and gateways there are.
#[must_use]
pub fn count_regions(map: &RegionMap) -> RegionMetrics {
    let corridors = map.regions.iter().filter(|region| region.corridor > region.room).count();
    RegionMetrics { rooms: map.regions.len() - corridors, corridors, gateways: map.gateways.len() }
}

impl Mapper {
    /// Cuts a gridmap of this map into regions, as [`regions`] does, and remembers them: names and closed gateways that
    /// are known from before are found again, wherever relaxation has moved them.
    ///
    /// # Errors
    ///
    /// As [`regions`].
    pub fn survey(&mut self, gridmap: &FuzzyGrid) -> Result<RegionMap, SegmentError> {
        let mut map = regions(gridmap)?;
        let places = self.visited_poses();
        self.floor_plan_mut().renew(&mut map, &places);
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

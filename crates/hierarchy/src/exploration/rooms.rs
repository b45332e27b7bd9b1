//! Which room the robot is in while it explores, so that it may look around there before it goes elsewhere.

use nalgebra::Point2;
use region_map::RegionMap;
use topo_map::{Link, PlaceId};

use crate::live_map::LiveMap;
use crate::mapper::{Mapper, MapperError};
use crate::query::regions;

/// The rooms of a map that grows.
#[derive(Debug)]
pub(super) struct Rooms {
    /// By how many metres what lies outside of the robot's room seems farther away.
    reluctance: f64,
    gridmap: LiveMap,
    map: Option<RegionMap>,
    /// So many places were there when the rooms were last cut.
    places: usize,
}

/// After so many new places the rooms are cut again.
const RENEWED: usize = 8;
/// A scan that moved by less, in metres, is left where it was drawn.
const SLACK: f64 = 0.1;

impl Rooms {
    pub(super) fn new(mapper: &Mapper, reluctance: f64) -> Result<Self, MapperError> {
        Ok(Self { reluctance, gridmap: LiveMap::new(mapper.config().grid.options())?, map: None, places: 0 })
    }

    /// Cuts the rooms again if enough is new.
    pub(super) fn follow(&mut self, mapper: &Mapper) -> Result<(), MapperError> {
        let places = mapper.topology().n_visited();
        if places < self.places + RENEWED {
            return Ok(());
        }
        self.gridmap.follow(mapper, SLACK)?;
        // Only a map that falls into more than 65535 regions is refused, and then there are no rooms.
        self.map = regions(&self.gridmap.map().to_grid()?, &mapper.poses()).ok();
        self.places = places;
        Ok(())
    }

    /// By how many metres a predicted link seems farther away to a robot at the place `here` for leading out of its room.
    /// Nothing holds a robot in a corridor: its rooms lie along the way.
    pub(super) fn detour(&self, position: impl Fn(PlaceId) -> Point2<f64>, here: PlaceId, link: &Link) -> f64 {
        let room = |map: &RegionMap, at: Point2<f64>| map.region_at(at).map(|region| region.label);
        let leads_out = || {
            let map = self.map.as_ref()?;
            let here = map.region_at(position(here)).filter(|region| region.room >= region.corridor)?;
            let seen_from = position(link.from);
            let there = room(map, seen_from + link.displacement.vector).or(room(map, seen_from))?;
            Some(there != here.label)
        };
        if leads_out() == Some(true) { self.reluctance } else { 0.0 }
    }
}

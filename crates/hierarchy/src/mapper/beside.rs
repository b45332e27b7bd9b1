use topo_map::{Place, PlaceId};

use super::{Mapper, MapperError};
use crate::event::Event;
use crate::recognize::reach::{Chains, reach_from};
use crate::recognize::{Closure, Verdict, verify};

/// Places that lie within so many metres see the same walls.
const WITHIN: f64 = 1.5;
/// Places fewer than this apart belong to one visit, whose walls have held the path already.
const OF_ONE_VISIT: u32 = 8;
/// The coordinates must know how the two lie to each other to so many metres: no farther than walls draw a scan.
const SURE: f64 = 0.3;

impl Mapper {
    /// Measures how places of different visits lie to each other that the finished map has beside each other.
    ///
    /// While the robot drives, a place is compared with what the coordinates of that moment have near it, and linked where a whole
    /// stretch is recognised. Once all loops are closed the map knows of more places that see the same walls; scans measure
    /// how they lie to a centimetre or two, where the map by itself bends by some more.
    pub(super) fn link_beside(&mut self) -> Result<Vec<Event>, MapperError> {
        if !self.config.recognition.enabled || !self.front_end.is_held_by_scans() {
            return Ok(Vec::new());
        }
        let chains = Chains::of(&self.map);
        let places: Vec<PlaceId> = self.map.places().iter().filter(|place| place.is_visited()).map(|p| p.id).collect();
        let found: Vec<Closure> = places.into_iter().filter_map(|place| self.measured_beside(place, &chains)).collect();
        self.close_all(found)
    }

    /// How a place lies to the nearest one of an earlier visit, if they are not linked yet.
    fn measured_beside(&self, place: PlaceId, chains: &Chains) -> Option<Closure> {
        let at = |place| self.coordinates.map_from_place(place);
        let here = at(place).translation.vector;
        let distance = |known: &PlaceId| (at(*known).translation.vector - here).norm();
        let mut near = self.coordinates.near(here.into(), WITHIN);
        near.retain(|known| known.0 + OF_ONE_VISIT < place.0 && self.map.place(*known).is_some_and(Place::is_visited));
        let known = near.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let is_linked = self.map.links_between(place, known).next().is_some();
        let reach = reach_from(&self.map, chains, place, &[known]).pop().flatten().filter(|_| !is_linked)?;
        let variance = self.front_end.held().variance(&reach);
        if variance > SURE.powi(2) {
            return None;
        }
        let (expected, turns) = (at(place).inv_mul(&at(known)), !self.front_end.tracker.has_compass());
        let seen = verify::beside(&self.trajectory, (place, known), &expected, (variance, reach.turn_variance), turns);
        let (displacement, score) = seen?;
        let shift = (displacement.vector - expected.translation.vector).norm();
        Some(Closure { place, known, displacement, score, shift, verdict: Verdict::Beside { score } })
    }

    /// Links closures that scans have measured, and takes back those that the relaxed map contradicts.
    fn close_all(&mut self, closures: Vec<Closure>) -> Result<Vec<Event>, MapperError> {
        let mut events = self.link(closures)?;
        if !events.is_empty() {
            events.extend(self.settle_all()?);
        }
        Ok(events)
    }
}

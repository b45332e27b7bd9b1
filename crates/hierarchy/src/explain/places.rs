use serde::{Deserialize, Serialize};
use topo_map::PlaceId;

use super::springs::Springs;
use crate::mapper::Mapper;

/// A place and how sure it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceStory {
    /// Its number.
    pub place: PlaceId,
    /// A name that a person gave it.
    pub name: Option<String>,
    /// Where it lies in the map, in metres.
    pub position_m: [f64; 2],
    /// The one-σ half axis of its position, along the least sure direction, relative to the first place, in metres.
    pub sigma_m: f64,
    /// How far relaxation moved it from where dead reckoning had it, in metres.
    pub shift_m: f64,
    /// Links that measured it.
    pub links: usize,
    /// Loops that go through it.
    pub loops: usize,
}

/// Every visited place, the least sure one first.
pub(super) fn stories(mapper: &Mapper, springs: &Springs) -> Vec<PlaceStory> {
    let names: std::collections::BTreeMap<_, _> = mapper.names().collect();
    let map = mapper.topology();
    let place = |place: &topo_map::Place<_>| {
        let position = mapper.coordinates().map_from_place(place.id).translation.vector;
        let measured = || map.links_of(place.id).filter(|link| link.is_measured());
        let before = springs.before.get(place.id.index()).map_or(position, |pose| pose.translation.vector);
        PlaceStory {
            place: place.id,
            name: names.get(&place.id).map(|name| (*name).to_owned()),
            position_m: position.into(),
            sigma_m: springs.node(place.id).symmetric_eigenvalues().max().max(0.0).sqrt(),
            shift_m: (position - before).norm(),
            links: measured().count(),
            loops: measured().filter(|link| link.origin == topo_map::LinkOrigin::Recognized).count(),
        }
    };
    let mut places: Vec<PlaceStory> = map.places().iter().filter(|place| place.is_visited()).map(place).collect();
    places.sort_by(|a, b| b.sigma_m.total_cmp(&a.sigma_m).then(a.place.cmp(&b.place)));
    places
}

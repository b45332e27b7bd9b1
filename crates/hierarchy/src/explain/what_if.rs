use nalgebra::Isometry2;
use serde::{Deserialize, Serialize};
use topo_map::{LinkId, LinkState, PlaceId};

use crate::mapper::{Mapper, MapperError};

/// What a map would be without some of its links.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WhatIf {
    /// The links that were left out.
    pub removed: Vec<LinkId>,
    /// Energy of the map as it is.
    pub energy_with: f64,
    /// Energy of the map without them, relaxed again.
    pub energy_without: f64,
    /// Places that nothing would hold to the first one any more.
    pub parted: usize,
    /// The places that would move by more than a millimetre, the farthest first.
    pub moved: Vec<Moved>,
}

/// A place that would move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// Its number.
    pub place: PlaceId,
    /// Where it is, in metres.
    pub from_m: [f64; 2],
    /// Where it would be, in metres.
    pub to_m: [f64; 2],
    /// How far that is, in metres.
    pub distance_m: f64,
}

/// Solves the map again without some of its links, and says what would change; the map itself stays as it is.
///
/// # Errors
///
/// A link that does not exist, or links that cannot be relaxed.
pub fn without(mapper: &Mapper, links: &[LinkId]) -> Result<WhatIf, MapperError> {
    let (map, coordinates) = (mapper.topology(), mapper.coordinates());
    let before = coordinates.padded(map);
    let mut other = map.clone();
    for link in links {
        other.set_link_state(*link, LinkState::Rejected)?;
    }
    let problem = coordinates.problem(&other)?;
    let after = problem.relaxed(&before)?;
    let network = problem.network_at(&after)?;
    let parted = (0..network.len()).filter(|node| network.component(*node) != network.component(0)).count();
    let now = coordinates.problem(map)?;
    let stray = now.network_at(&before)?;
    let stray = (0..stray.len()).filter(|node| stray.component(*node) != stray.component(0)).count();
    Ok(WhatIf {
        removed: links.to_vec(),
        energy_with: now.energy(&before),
        energy_without: problem.energy(&after),
        parted: parted - stray,
        moved: moved(mapper, &before, &after),
    })
}

/// Less than this is no move, in metres.
const STILL: f64 = 1e-3;

fn moved(mapper: &Mapper, before: &[Isometry2<f64>], after: &[Isometry2<f64>]) -> Vec<Moved> {
    let places = mapper.topology().places().iter().zip(before.iter().zip(after));
    let mut moved: Vec<Moved> = places
        .map(|(place, (from, to))| Moved {
            place: place.id,
            from_m: from.translation.vector.into(),
            to_m: to.translation.vector.into(),
            distance_m: (to.translation.vector - from.translation.vector).norm(),
        })
        .filter(|moved| moved.distance_m > STILL)
        .collect();
    moved.sort_by(|a, b| b.distance_m.total_cmp(&a.distance_m).then(a.place.cmp(&b.place)));
    moved
}

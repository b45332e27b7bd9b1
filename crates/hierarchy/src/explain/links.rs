use serde::{Deserialize, Serialize};
use topo_map::{LinkId, LinkOrigin, LinkState, PlaceId};

use super::bridges;
use super::springs::Springs;
use crate::mapper::Mapper;

/// A link and what the rest of the map says of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LinkStory {
    /// Its number.
    pub link: LinkId,
    /// Where it begins.
    pub from: PlaceId,
    /// Where it ends.
    pub to: PlaceId,
    /// Where it comes from.
    pub origin: LinkOrigin,
    /// Whether it holds.
    pub state: LinkState,
    /// Its measured length, in metres.
    pub length_m: f64,
    /// Where the map has its end, less where it has it itself, in the map's axes, in metres.
    pub residual_m: [f64; 2],
    /// The standard deviation that such a residual may have along its direction, in metres.
    pub sigma_m: f64,
    /// `√χ²`: how many standard deviations it is from what the rest of the map says; 0 where nothing checks it.
    pub residual_sigma: f64,
    /// Its square.
    pub chi2: f64,
    /// Its share of the map's energy: its residual weighted by its own covariance.
    pub energy: f64,
    /// What its measurement counts: 1, or 0 where it is held to be false or nobody has gone there.
    pub weight: f64,
    /// Whether it is part of no loop: nothing checks what it measured.
    pub bridge: bool,
    /// How many places it alone holds to the rest, where it is a bridge: those on its smaller side.
    pub beyond: usize,
    /// How many times it was gone.
    pub traversals: u32,
}

/// Every link, by number.
pub(super) fn stories(mapper: &Mapper, springs: &Springs) -> Vec<LinkStory> {
    let beyond = bridges::beyond(&springs.network);
    let link = |link: &topo_map::Link| {
        let spring = springs.of(link.id);
        let strain = spring.map(|spring| springs.strain(spring)).unwrap_or_default();
        let behind = spring.and_then(|spring| beyond.get(&spring).copied());
        LinkStory {
            link: link.id,
            from: link.from,
            to: link.to,
            origin: link.origin,
            state: link.state,
            length_m: link.distance(),
            residual_m: strain.residual.into(),
            sigma_m: strain.sigma,
            residual_sigma: strain.chi2.sqrt(),
            chi2: strain.chi2,
            energy: spring.map_or(0.0, |spring| springs.network.spring_energy(spring, &springs.positions)),
            weight: spring.map_or(0.0, |spring| springs.network.weight(spring)),
            bridge: behind.is_some(),
            beyond: behind.unwrap_or(0),
            traversals: link.traversals,
        }
    };
    mapper.topology().links().iter().map(link).collect()
}

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use topo_map::{Link, LinkId, LinkOrigin, LinkState, PlaceId};

use super::springs::{Springs, Strain, is_refused};
use crate::mapper::Mapper;
use crate::recognize::Closure;

/// A loop that was weighed: a place that looked like an older one, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LoopStory {
    /// The place that was reached.
    pub place: PlaceId,
    /// The older place that it looks like.
    pub known: PlaceId,
    /// The link that it became; absent where it was refused.
    pub link: Option<LinkId>,
    /// Whether the map is built on it.
    pub accepted: bool,
    /// Where the map has the older place, less where the views have it, in the map's axes, in metres.
    pub residual_m: [f64; 2],
    /// The same by dead reckoning, before anything was relaxed.
    pub residual_before_m: [f64; 2],
    /// The standard deviation that such a residual may have along its direction, in metres.
    pub sigma_m: f64,
    /// `√χ²`: how many standard deviations the loop is from what the rest of the map says.
    pub residual_sigma: f64,
    /// Its square, of two degrees of freedom.
    pub chi2: f64,
    /// Similarity of the two views, in `[0, 1]`; absent where a person added the loop.
    pub score: Option<f64>,
    /// How far the place had to move for the views to fit, when they were seen, in metres.
    pub shift_m: Option<f64>,
    /// Why it holds or not.
    pub reason: String,
}

/// Every decision in its order, then the loops that nobody decided but a person.
pub(super) fn stories(mapper: &Mapper, springs: &Springs) -> Vec<LoopStory> {
    let mut told = BTreeSet::new();
    let mut stories = Vec::with_capacity(mapper.closures().len());
    for (decision, closure) in mapper.closures().iter().enumerate() {
        let link = link_of(mapper, closure, &told).filter(|_| !is_refused(closure));
        told.extend(link.map(|link| link.id));
        stories.push(decided(mapper, springs, decision, closure, link));
    }
    let added = mapper.topology().links().iter().filter(|link| link.origin == LinkOrigin::Recognized);
    stories.extend(added.filter(|link| !told.contains(&link.id)).map(|link| by_hand(springs, link)));
    stories
}

/// The link that an accepted closure became.
fn link_of<'a>(mapper: &'a Mapper, closure: &Closure, told: &BTreeSet<LinkId>) -> Option<&'a Link> {
    let (place, known) = (mapper.topology().resolve(closure.place), mapper.topology().resolve(closure.known));
    let mut between = mapper.topology().links_between(place, known);
    between.find(|link| link.origin == LinkOrigin::Recognized && !told.contains(&link.id))
}

fn decided(mapper: &Mapper, springs: &Springs, decision: usize, closure: &Closure, link: Option<&Link>) -> LoopStory {
    let spring = link.and_then(|link| springs.of(link.id));
    let strain = spring.map_or_else(|| springs.apart(decision, mapper, closure), |spring| springs.strain(spring));
    let dropped = link.is_some_and(|link| link.state == LinkState::Rejected);
    let reason = if dropped { format!("dropped; {}", closure.verdict) } else { closure.verdict.to_string() };
    LoopStory {
        place: closure.place,
        known: closure.known,
        link: link.map(|link| link.id),
        accepted: spring.is_some(),
        residual_before_m: springs.before(closure.place, closure.known, &closure.displacement).into(),
        score: Some(closure.score),
        shift_m: Some(closure.shift),
        reason,
        ..told_by(&strain)
    }
}

fn by_hand(springs: &Springs, link: &Link) -> LoopStory {
    let spring = springs.of(link.id);
    LoopStory {
        place: link.from,
        known: link.to,
        link: Some(link.id),
        accepted: spring.is_some(),
        residual_before_m: springs.before(link.from, link.to, &link.displacement).into(),
        reason: match link.state {
            LinkState::Open => "added by hand".into(),
            LinkState::Blocked => "pinned by hand".into(),
            LinkState::Rejected => "added by hand and dropped".into(),
        },
        ..told_by(&spring.map(|spring| springs.strain(spring)).unwrap_or_default())
    }
}

/// A story of which only the numbers are known.
fn told_by(strain: &Strain) -> LoopStory {
    LoopStory {
        place: PlaceId(0),
        known: PlaceId(0),
        link: None,
        accepted: false,
        residual_m: strain.residual.into(),
        residual_before_m: [0.0; 2],
        sigma_m: strain.sigma,
        residual_sigma: strain.chi2.sqrt(),
        chi2: strain.chi2,
        score: None,
        shift_m: None,
        reason: String::new(),
    }
}

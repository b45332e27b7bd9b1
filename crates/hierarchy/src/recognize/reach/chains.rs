use std::collections::BTreeSet;
use std::ops::Bound::{Excluded, Unbounded};

use topo_map::{Link, PlaceId, TopoMap};

use super::Reach;

/// The links of a map, where places follow one another without a branch told as one.
///
/// A robot that drives through the unknown leaves such chains: each place hangs between the one before and the one after,
/// by number too. What a chain adds to a [`Reach`] is a difference of sums kept along the numbers, so that a search goes from
/// **junction** to junction, the places where loops were closed, however many places lie between.
#[derive(Debug, Default)]
pub(crate) struct Chains {
    /// For each place the sums over all links that lead from one number to the next, up to it.
    sums: Vec<Sums>,
    /// Places that are no inner part of a chain.
    junctions: BTreeSet<PlaceId>,
    /// Links taken into account.
    links: usize,
}

/// Sums over links `k` of what they add: `a` m² of position, `t` rad² of turn, `l` metres.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// `Σ a_k`
    position: f64,
    /// `T = Σ t_k`
    turn: f64,
    /// `Σ l_k`
    path: f64,
    /// `Σ l_k²`
    squares: f64,
    /// `Σ l_k² T_{k−1}` and `Σ l_k² T_k`: how the turns of links before one move its end, seen from either side.
    ahead: f64,
    behind: f64,
}

impl Chains {
    pub(crate) fn of<S>(map: &TopoMap<S>) -> Self {
        let mut chains = Self::default();
        chains.follow(map);
        chains
    }

    /// No chains: every place is a junction.
    #[cfg(test)]
    pub(super) fn place_by_place<S>(map: &TopoMap<S>) -> Self {
        Self { junctions: map.places().iter().map(|place| place.id).collect(), ..Self::of(map) }
    }

    /// Takes places and links into account that came since. Links that changed otherwise need [`Chains::of`].
    pub(crate) fn follow<S>(&mut self, map: &TopoMap<S>) {
        for place in &map.places()[self.sums.len()..] {
            let before = place.id.0.checked_sub(1).map(PlaceId);
            let sums = before.map_or(Sums::default(), |before| self.sums[before.index()]);
            let link = before.and_then(|before| ways(map, place.id).find(|link| link.other_end(place.id) == before));
            self.sums.push(link.map_or(sums, |link| sums.and(link)));
            self.tell(map, place.id);
        }
        for link in &map.links()[self.links..] {
            self.tell(map, link.from);
            self.tell(map, link.to);
        }
        self.links = map.links().len();
    }

    /// The same of a closure that was taken back.
    pub(crate) fn forget<S>(&mut self, map: &TopoMap<S>, closure: &Link) {
        self.tell(map, closure.from);
        self.tell(map, closure.to);
    }

    /// Whether it is a junction, now.
    fn tell<S>(&mut self, map: &TopoMap<S>, place: PlaceId) {
        if is_inner(map, place) {
            self.junctions.remove(&place);
        } else {
            self.junctions.insert(place);
        }
    }

    /// The places to which links lead from `place`, with what is known of them: the next junction of each chain, or a place
    /// before it that is among `also` (in order).
    pub(super) fn steps<'a, S>(
        &'a self,
        map: &'a TopoMap<S>,
        (place, reach): (PlaceId, Reach),
        also: &'a [PlaceId],
    ) -> impl Iterator<Item = (PlaceId, Reach)> + 'a {
        ways(map, place).map(move |link| {
            let other = link.other_end(place);
            let chain = (!self.junctions.contains(&other)).then(|| self.end(place, other, also));
            match chain {
                Some(end) => (end, self.along(reach, place, end)),
                None => (other, extend(reach, link)),
            }
        })
    }

    /// Where a chain that leads from `place` to `next`, an inner place of it, ends or passes one that is among `also`.
    fn end(&self, place: PlaceId, next: PlaceId, also: &[PlaceId]) -> PlaceId {
        if next > place {
            let wanted = also[also.partition_point(|other| *other <= place)..].first();
            let junction = self.junctions.range((Excluded(place), Unbounded)).next();
            return *wanted.into_iter().chain(junction).min().unwrap_or(&next);
        }
        let wanted = also[..also.partition_point(|other| *other < place)].last();
        let junction = self.junctions.range(..place).next_back();
        *wanted.into_iter().chain(junction).max().unwrap_or(&next)
    }

    /// What is known at the end of a chain, given what is known at its beginning.
    fn along(&self, reach: Reach, begin: PlaceId, end: PlaceId) -> Reach {
        let (low, high) = (self.sums[begin.min(end).index()], self.sums[begin.max(end).index()]);
        let squares = high.squares - low.squares;
        // Each link is turned by all that were passed before it.
        let turned = match begin < end {
            true => high.ahead - low.ahead - low.turn * squares,
            false => high.turn * squares - (high.behind - low.behind),
        };
        Reach {
            position_variance: reach.position_variance
                + (high.position - low.position)
                + reach.turn_variance * squares
                + turned.max(0.0),
            turn_variance: reach.turn_variance + (high.turn - low.turn),
            path: reach.path + (high.path - low.path),
        }
    }
}

impl Sums {
    fn and(&self, link: &Link) -> Self {
        let (position, turn, length) = added(link);
        let square = length * length;
        Self {
            position: self.position + position,
            turn: self.turn + turn,
            path: self.path + length,
            squares: self.squares + square,
            ahead: self.ahead + square * self.turn,
            behind: self.behind + square * (self.turn + turn),
        }
    }
}

/// The links of a place that say where its neighbours are.
fn ways<S>(map: &TopoMap<S>, place: PlaceId) -> impl Iterator<Item = &Link> {
    map.links_of(place).filter(|link| link.is_measured() && !link.is_carried())
}

/// Whether a place has two links, one to the place before and one to the place after.
fn is_inner<S>(map: &TopoMap<S>, place: PlaceId) -> bool {
    let mut ways = ways(map, place).map(|link| link.other_end(place).0);
    let (Some(a), Some(b), None) = (ways.next(), ways.next(), ways.next()) else { return false };
    a.abs_diff(b) == 2 && a.min(b) + 1 == place.0
}

/// What a link adds to the variances of position and turn, and its length.
fn added(link: &Link) -> (f64, f64, f64) {
    let position = link.displacement.covariance.symmetric_eigenvalues().max();
    (position, link.displacement.turn.map_or(0.0, |turn| turn.variance), link.distance())
}

/// What is known at the far end of a link. An uncertain heading turns the whole link: to first order it moves its end
/// sideways.
fn extend(reach: Reach, link: &Link) -> Reach {
    let (position, turn, length) = added(link);
    Reach {
        position_variance: reach.position_variance + position + reach.turn_variance * length * length,
        turn_variance: reach.turn_variance + turn,
        path: reach.path + length,
    }
}

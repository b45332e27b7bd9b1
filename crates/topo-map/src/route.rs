use std::cmp::Ordering;
use std::collections::{BTreeSet, BinaryHeap};

use nalgebra::Isometry2;
use petgraph::graph::UnGraph;
use petgraph::unionfind::UnionFind;

use crate::{Link, LinkId, PlaceId, TopoMap};

/// A way over passable links from one place to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// The places from start to goal, both included.
    pub places: Vec<PlaceId>,
    /// The links between them, one fewer.
    pub links: Vec<LinkId>,
    /// The sum of the costs of the links; metres, unless the caller has its own idea of cost.
    pub cost: f64,
}

/// A place on the border of Dijkstra's search; the order is that of a max-heap, so the cheapest comes first.
#[derive(Debug, PartialEq)]
struct Reached {
    cost: f64,
    place: PlaceId,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        // Ties go to the lower number, so that the same map gives the same route.
        other.cost.total_cmp(&self.cost).then_with(|| other.place.cmp(&self.place))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<S> TopoMap<S> {
    /// The shortest way from one place to another over passable links, or `None` if none leads there.
    #[must_use]
    pub fn route(&self, from: PlaceId, to: PlaceId) -> Option<Route> {
        self.nearest(from, Link::distance, |place| place == to)
    }

    /// The cheapest way from a place to any that `is_goal` accepts, or `None` if none can be reached.
    ///
    /// `cost` is asked once per passable link and end; negative and NaN costs count as infinite.
    pub fn nearest(
        &self,
        from: PlaceId,
        cost: impl Fn(&Link) -> f64,
        is_goal: impl Fn(PlaceId) -> bool,
    ) -> Option<Route> {
        let (best, came_over, goal) = self.dijkstra(from, cost, is_goal);
        goal.map(|goal| self.retrace(from, goal, best[goal.index()], &came_over))
    }

    /// The cost of the cheapest way from a place to each place over passable links, by number; infinite where none leads.
    ///
    /// `cost` as in [`TopoMap::nearest`].
    #[must_use]
    pub fn distances_from(&self, from: PlaceId, cost: impl Fn(&Link) -> f64) -> Vec<f64> {
        self.dijkstra(from, cost, |_| false).0
    }

    /// Costs from `from`, the links over which they arise, and the first goal met, at which the search ends.
    fn dijkstra(
        &self,
        from: PlaceId,
        cost: impl Fn(&Link) -> f64,
        is_goal: impl Fn(PlaceId) -> bool,
    ) -> (Vec<f64>, Vec<Option<LinkId>>, Option<PlaceId>) {
        let mut best = vec![f64::INFINITY; self.places().len()];
        let mut came_over: Vec<Option<LinkId>> = vec![None; self.places().len()];
        let mut border = BinaryHeap::new();
        if self.place(from).is_some() {
            best[from.index()] = 0.0;
            border.push(Reached { cost: 0.0, place: from });
        }
        while let Some(Reached { cost: so_far, place }) = border.pop() {
            if so_far > best[place.index()] {
                continue; // an older, longer way to a place that is settled
            }
            if is_goal(place) {
                return (best, came_over, Some(place));
            }
            for link in self.links_of(place).filter(|link| link.is_passable()) {
                let (next, step) = (link.other_end(place), cost(link));
                let total = if step >= 0.0 { so_far + step } else { f64::INFINITY };
                if total < best[next.index()] {
                    best[next.index()] = total;
                    came_over[next.index()] = Some(link.id);
                    border.push(Reached { cost: total, place: next });
                }
            }
        }
        (best, came_over, None)
    }

    fn retrace(&self, from: PlaceId, to: PlaceId, cost: f64, came_over: &[Option<LinkId>]) -> Route {
        let (mut places, mut links, mut at) = (vec![to], Vec::new(), to);
        while at != from {
            let Some(link) = came_over[at.index()] else { break };
            at = self.links()[link.index()].other_end(at);
            links.push(link);
            places.push(at);
        }
        places.reverse();
        links.reverse();
        Route { places, links, cost }
    }

    /// The visited places at most `reach` measured links from `place`, itself first, and where they lie.
    ///
    /// The poses are `place_from_other`, chained along the ways with the fewest links: in metres, in the axes of `place`.
    #[must_use]
    pub fn surroundings(&self, place: PlaceId, reach: usize) -> Vec<(PlaceId, Isometry2<f64>)> {
        let mut found = vec![(place, Isometry2::identity())];
        let (mut begin, mut seen) = (0, BTreeSet::from([place]));
        for _ in 0..reach {
            let ring = begin..found.len();
            begin = found.len();
            for index in ring {
                let (at, place_from_at) = found[index];
                for link in self.links_of(at).filter(|link| link.is_measured()) {
                    let next = link.other_end(at);
                    if self.place(next).is_some_and(crate::Place::is_visited) && seen.insert(next) {
                        found.push((next, place_from_at * link.displacement_from(at).from_place_from_to_place()));
                    }
                }
            }
        }
        found
    }

    /// The visited places in groups that measured links hold together, each sorted, by their lowest number; a link over which
    /// the robot was carried holds nothing.
    ///
    /// Positions are determined within a component only.
    #[must_use]
    pub fn components(&self) -> Vec<Vec<PlaceId>> {
        let mut sets = UnionFind::<usize>::new(self.places().len());
        for link in self.links().iter().filter(|link| link.is_measured() && !link.is_carried()) {
            sets.union(link.from.index(), link.to.index());
        }
        let mut groups: Vec<Vec<PlaceId>> = Vec::new();
        let mut group_of = vec![None; self.places().len()];
        for place in self.places().iter().filter(|place| place.is_visited()) {
            let root = sets.find(place.id.index());
            let group = *group_of[root].get_or_insert_with(|| {
                groups.push(Vec::new());
                groups.len() - 1
            });
            groups[group].push(place.id);
        }
        groups
    }

    /// The measured links without which the map would fall apart, sorted: no other way checks them.
    #[must_use]
    pub fn bridges(&self) -> Vec<LinkId> {
        let measured = || self.links().iter().filter(|link| link.is_measured());
        let pair = |link: &Link| (link.from.min(link.to), link.from.max(link.to));
        let mut seen = BTreeSet::new();
        let parallel: BTreeSet<_> = measured().map(pair).filter(|&ends| !seen.insert(ends)).collect();
        let mut graph = UnGraph::<(), LinkId>::with_capacity(self.places().len(), self.links().len());
        let nodes: Vec<_> = self.places().iter().map(|_| graph.add_node(())).collect();
        for link in measured().filter(|link| !parallel.contains(&pair(link))) {
            graph.add_edge(nodes[link.from.index()], nodes[link.to.index()], link.id);
        }
        // Two parallel links check each other; as one edge with a detour they are no bridge, and the graph stays simple.
        for (a, b) in parallel {
            let (a, b, detour) = (nodes[a.index()], nodes[b.index()], graph.add_node(()));
            for (from, to) in [(a, b), (a, detour), (detour, b)] {
                graph.add_edge(from, to, LinkId(u32::MAX));
            }
        }
        let mut bridges: Vec<LinkId> = petgraph::algo::bridges(&graph).map(|edge| *edge.weight()).collect();
        bridges.sort_unstable();
        bridges
    }
}

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap, HashSet};

use topo_map::{PlaceId, TopoMap};

use super::{Chains, Reach};

/// The reach from `start` of each place that is `wanted`, over the surest chains of measured links (Dijkstra on the
/// variance); `None` where no chain leads.
///
/// A chain is an upper bound: parallel chains would make the relative position surer, never less sure. The search ends
/// with the last place wanted, and passes only places where ways part: where a robot drives through what it knows it costs
/// what lies near, and through the unknown as much as there are loops.
pub(crate) fn reach_from<S>(
    map: &TopoMap<S>,
    chains: &Chains,
    start: PlaceId,
    wanted: &[PlaceId],
) -> Vec<Option<Reach>> {
    let mut stops = wanted.to_vec();
    stops.sort_unstable();
    let mut settled: HashMap<PlaceId, Reach> = HashMap::new();
    let mut missing: HashSet<PlaceId> = wanted.iter().copied().collect();
    let mut heap = BinaryHeap::new();
    heap.push(Visit { place: start, reach: Reach::HERE });
    while let Some(Visit { place, reach }) = heap.pop().filter(|_| !missing.is_empty()) {
        if settled.contains_key(&place) {
            continue;
        }
        settled.insert(place, reach);
        missing.remove(&place);
        let steps = chains.steps(map, (place, reach), &stops);
        heap.extend(steps.filter(|(next, _)| !settled.contains_key(next)).map(|(place, reach)| Visit { place, reach }));
    }
    wanted.iter().map(|place| settled.get(place).copied()).collect()
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Visit {
    place: PlaceId,
    reach: Reach,
}

impl Eq for Visit {}

/// The surest first; equal ones in the order of their numbers, so that the result never depends on luck.
impl Ord for Visit {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_variance = other.reach.position_variance.total_cmp(&self.reach.position_variance);
        by_variance.then(other.place.cmp(&self.place))
    }
}

impl PartialOrd for Visit {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Vector2};
    use proptest::prelude::*;
    use topo_map::{Displacement, LinkState, Turn};

    use super::*;

    fn step(length: f64, compass: bool) -> Displacement {
        let covariance = Matrix2::new(0.01 + 0.001 * length, 0.002, 0.002, 0.004);
        let turn = (!compass).then_some(Turn { change: 0.1, variance: 1e-4 * (1.0 + length) });
        Displacement { vector: Vector2::new(length, 0.0), covariance, turn }
    }

    /// A drive with loops closed on the way; the chains follow it, or are made anew where a link changes.
    fn drive(lengths: &[f64], closures: &[(usize, usize)], broken: usize, compass: bool) -> (TopoMap<()>, Chains) {
        let (mut map, mut chains) = (TopoMap::new(), Chains::default());
        let mut here = map.add_place(()).unwrap();
        for (number, length) in lengths.iter().enumerate() {
            let next = map.add_place(()).unwrap();
            let link = map.travel(here, next, step(*length, compass)).unwrap();
            here = next;
            for (_, known) in closures.iter().filter(|(at, known)| *at == number && *known < number) {
                map.recognize(here, map.places()[*known].id, step(0.5, compass)).unwrap();
            }
            if number == broken {
                map.carry(link).unwrap();
                chains = Chains::of(&map);
            }
            chains.follow(&map);
        }
        (map, chains)
    }

    proptest! {
        #[test]
        fn chains_are_passed_as_if_place_by_place(
            lengths in proptest::collection::vec(0.5..2.0f64, 2..80),
            closures in proptest::collection::vec((0usize..80, 0usize..80), 0..6),
            (broken, start) in (0usize..400, 0usize..80),
            wanted in proptest::collection::vec(0usize..80, 0..8),
            compass in any::<bool>(),
        ) {
            let (mut map, mut chains) = drive(&lengths, &closures, broken, compass);
            let at = |number: usize| PlaceId(u32::try_from(number % (lengths.len() + 1)).unwrap());
            let wanted: Vec<PlaceId> = wanted.into_iter().map(at).collect();
            for _ in 0..2 {
                let passed = reach_from(&map, &chains, at(start), &wanted);
                let stepped = reach_from(&map, &Chains::place_by_place(&map), at(start), &wanted);
                for (passed, stepped) in passed.iter().zip(&stepped) {
                    prop_assert_eq!(passed.is_some(), stepped.is_some());
                    let (Some(passed), Some(stepped)) = (passed, stepped) else { continue };
                    approx::assert_relative_eq!(passed.position_variance, stepped.position_variance, max_relative = 1e-9);
                    approx::assert_relative_eq!(passed.turn_variance, stepped.turn_variance, max_relative = 1e-9);
                    approx::assert_relative_eq!(passed.path, stepped.path, max_relative = 1e-9);
                }
                // Once more with the last link taken back.
                map.set_link_state(map.links().last().unwrap().id, LinkState::Rejected).unwrap();
                chains.forget(&map, map.links().last().unwrap());
            }
        }
    }
}

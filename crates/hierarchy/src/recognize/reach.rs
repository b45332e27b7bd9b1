use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap, HashSet};

use topo_map::{PlaceId, TopoMap};

/// How surely one place is known from another: what the best chain of links between them says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    /// Variance of the relative position, in m², the larger of the two axes.
    pub(crate) position_variance: f64,
    /// Variance of the relative heading, in rad²; 0 where a compass holds it.
    pub(crate) turn_variance: f64,
    /// Length of the chain, in metres.
    pub(crate) path: f64,
}

/// What holds the robot's pose while it drives, and so how far its coordinates may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Held {
    /// Precise scans, laid onto the walls seen before.
    Scans,
    /// A compass; distances are the wheels'.
    Compass,
    /// The directions of walls; distances are the wheels'.
    Walls,
    /// A gyro; distances are the wheels'.
    Gyro,
    /// Nothing but the wheels.
    Wheels,
}

impl Held {
    /// The variance of the relative position of two places, in m²: what the chain of links says, and what its errors have in
    /// common, which grows with the path itself.
    ///
    /// Measured as the error of dead reckoning against the truth over 6 to 400 m of path (see the results of recognition):
    /// four logs with lasers and spoilt odometry, twenty simulated ones with sonars.
    pub(crate) fn variance(self, reach: &Reach) -> f64 {
        let share = match self {
            Self::Scans => 0.005,
            Self::Compass | Self::Gyro => 0.03, // the field that turns a needle stays the same over several links
            Self::Walls => 0.02,
            Self::Wheels => 0.08,
        };
        reach.position_variance + (share * reach.path).powi(2)
    }
}

/// The reach from `start` of each place that is `wanted`, over the surest chains of measured links (Dijkstra on the
/// variance); `None` where no chain leads.
///
/// A chain is an upper bound: parallel chains would make the relative position surer, never less sure. The search ends
/// with the last place wanted, so that where a robot drives through what it knows it costs what lies near.
pub(crate) fn reach_from<S>(map: &TopoMap<S>, start: PlaceId, wanted: &[PlaceId]) -> Vec<Option<Reach>> {
    let mut settled: HashMap<PlaceId, Reach> = HashMap::new();
    let mut missing: HashSet<PlaceId> = wanted.iter().copied().collect();
    let mut heap = BinaryHeap::new();
    heap.push(Visit { place: start, reach: Reach { position_variance: 0.0, turn_variance: 0.0, path: 0.0 } });
    while let Some(Visit { place, reach }) = heap.pop().filter(|_| !missing.is_empty()) {
        if settled.contains_key(&place) {
            continue;
        }
        settled.insert(place, reach);
        missing.remove(&place);
        for link in map.links_of(place).filter(|link| link.is_measured() && !link.is_carried()) {
            let next = link.other_end(place);
            if !settled.contains_key(&next) {
                heap.push(Visit { place: next, reach: extend(reach, link) });
            }
        }
    }
    wanted.iter().map(|place| settled.get(place).copied()).collect()
}

fn extend(reach: Reach, link: &topo_map::Link) -> Reach {
    let covariance = &link.displacement.covariance;
    let length = link.distance();
    let largest = covariance.symmetric_eigenvalues().max();
    let turn = link.displacement.turn.map_or(0.0, |turn| turn.variance);
    Reach {
        // An uncertain heading turns the whole link: to first order it moves its end sideways.
        position_variance: reach.position_variance + largest + reach.turn_variance * length * length,
        turn_variance: reach.turn_variance + turn,
        path: reach.path + length,
    }
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

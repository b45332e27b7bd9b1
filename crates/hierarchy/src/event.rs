use topo_map::{LinkId, PlaceId};

use crate::recognize::Closure;

/// What a log entry changed in the hierarchy of maps.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// The robot reached a place that was not in the map.
    PlaceAdded {
        /// The new place.
        place: PlaceId,
    },
    /// Two places were joined by travel.
    LinkAdded {
        /// The new link.
        link: LinkId,
    },
    /// The robot was carried; it is at another place than its wheels believe, and the map goes on there.
    Carried {
        /// The link over which it was carried, which says nothing.
        link: LinkId,
        /// What told of it.
        told_by: CarriedBy,
    },
    /// The robot is where it was before; a link closes the loop.
    PlaceRecognized {
        /// The place reached now.
        place: PlaceId,
        /// The known place that it matches.
        known: PlaceId,
        /// The link between the two.
        link: LinkId,
    },
    /// A resemblance was weighed and refused.
    RecognitionRefused {
        /// The two places and the reason.
        closure: Closure,
    },
    /// The coordinates of the places changed.
    Relaxed {
        /// Sweeps spent; 0 where the optimum was solved directly.
        sweeps: usize,
        /// Energy before (weighted, over undirected links; dimensionless).
        energy_before: f64,
        /// Energy after.
        energy_after: f64,
        /// Largest shift of a place, in metres.
        max_shift: f64,
    },
}

/// What tells that a robot was carried.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum CarriedBy {
    /// From one scan to the next everything was another.
    Scans,
    /// Places passed since then look like old ones, all moved by one motion that no drift explains.
    Places {
        /// How many of them agree.
        agreed: usize,
        /// Logarithm of the odds against all else.
        log_odds: f64,
    },
}

use crate::{DisplacementError, LinkId, LinkOrigin, PlaceId};

/// Why the map refuses a change.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// There is no such place.
    #[error("{place} does not exist: the map has {count} places")]
    NoPlace {
        /// The place named.
        place: PlaceId,
        /// How many there are.
        count: usize,
    },
    /// There is no such link.
    #[error("{link} does not exist: the map has {count} links")]
    NoLink {
        /// The link named.
        link: LinkId,
        /// How many there are.
        count: usize,
    },
    /// A link needs two places.
    #[error("a link cannot lead from {0} to itself")]
    Loop(PlaceId),
    /// The measurement is none.
    #[error("link from {from} to {to}")]
    Displacement {
        /// Where the link would begin.
        from: PlaceId,
        /// Where it would end.
        to: PlaceId,
        /// What is wrong with the measurement.
        #[source]
        source: DisplacementError,
    },
    /// Places that proved false, or to be another place, take no links any more.
    #[error("{0} is refuted or merged into another place")]
    Gone(PlaceId),
    /// Only a place that was visited can do this.
    #[error("{0} was not visited")]
    NotVisited(PlaceId),
    /// Only a predicted place can do this.
    #[error("{0} is not predicted")]
    NotPredicted(PlaceId),
    /// The link is of another origin than the change needs.
    #[error("{link} is {found:?}")]
    Origin {
        /// The link.
        link: LinkId,
        /// Its origin.
        found: LinkOrigin,
    },
    /// A confidence is a probability.
    #[error("confidence must lie in [0, 1], got {0}")]
    Confidence(f64),
    /// The parts of a map that was read do not fit together.
    #[error("{what} at index {index} is numbered {number}")]
    Numbering {
        /// `place` or `link`.
        what: &'static str,
        /// Where it stood.
        index: usize,
        /// Its number.
        number: u32,
    },
    /// Numbers have 32 bits.
    #[error("a map holds at most {} places and as many links", u32::MAX)]
    Full,
}

use local_grid::Heading;
use nalgebra::{Rotation2, Vector2};

/// The number of a place in its [`TopoMap`](crate::TopoMap): an index, given out in order from 0 and never again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlaceId(pub u32);

impl PlaceId {
    /// The number as an index into a slice that has one entry per place.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl std::fmt::Display for PlaceId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "place {}", self.0)
    }
}

/// A spot about one metre across that the robot has visited, or expects to exist.
///
/// `S` is what the caller recognises a place by, as a `local_grid::Signature`; the map keeps it and never looks into it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Place<S> {
    /// Which place this is.
    pub id: PlaceId,
    /// What is known of it.
    pub state: PlaceState<S>,
    /// How many times the robot has been here.
    pub visits: u32,
}

/// What is known of a place.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PlaceState<S> {
    /// Open space was seen there, and nobody has been there yet.
    Predicted {
        /// The place from which it was seen.
        seen_from: PlaceId,
        /// The direction in which it was seen, in the map frame.
        toward: Heading,
        /// The network's belief that the way is open, in `[0, 1]`.
        confidence: f64,
    },
    /// The robot has been there.
    Visited {
        /// What the place is recognised by.
        signature: S,
    },
    /// It was predicted, and the robot found that it cannot be reached.
    Refuted,
    /// It turned out to be another place, which now holds its links.
    Merged {
        /// The place that it is.
        into: PlaceId,
        /// Where its centre lay in the frame of `into`, in metres.
        offset: Vector2<f64>,
    },
}

impl<S> PlaceState<S> {
    /// The same in axes that were wrong by `turn` radians.
    pub(crate) fn turn(&mut self, turn: f64) {
        match self {
            Self::Predicted { toward, .. } => *toward = *toward + turn,
            Self::Merged { offset, .. } => *offset = Rotation2::new(turn) * *offset,
            Self::Visited { .. } | Self::Refuted => {}
        }
    }
}

impl<S> Place<S> {
    /// What the place is recognised by, if the robot has been there.
    #[must_use]
    pub fn signature(&self) -> Option<&S> {
        match &self.state {
            PlaceState::Visited { signature } => Some(signature),
            PlaceState::Predicted { .. } | PlaceState::Refuted | PlaceState::Merged { .. } => None,
        }
    }

    /// Whether the robot has been there.
    #[must_use]
    pub fn is_visited(&self) -> bool {
        matches!(self.state, PlaceState::Visited { .. })
    }

    /// Whether the place is only expected to exist.
    #[must_use]
    pub fn is_predicted(&self) -> bool {
        matches!(self.state, PlaceState::Predicted { .. })
    }
}

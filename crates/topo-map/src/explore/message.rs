use local_grid::{Heading, Scan};
use nalgebra::{Isometry2, Matrix2, Point2, Vector2};

use crate::{LinkId, PlaceId};

/// What the robot has to tell after a command.
pub struct Observation<'a, S> {
    /// Where dead reckoning believes the robot to be: a frame that may drift, but whose axes are the map's (the heading
    /// is a compass', or as good).
    pub track_from_robot: Isometry2<f64>,
    /// The scans since the last observation, each with the pose where it was taken.
    pub scans: &'a [(Isometry2<f64>, Scan)],
    /// Whether something stopped the robot short.
    pub bumped: bool,
    /// The answer to [`Command::Identify`].
    pub identity: Option<Identity<S>>,
    /// Where visited places lie, in metres, by the best coordinates there are.
    pub position: &'a dyn Fn(PlaceId) -> Option<Point2<f64>>,
}

impl<S: std::fmt::Debug> std::fmt::Debug for Observation<'_, S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Observation")
            .field("track_from_robot", &self.track_from_robot)
            .field("scans", &self.scans.len())
            .field("bumped", &self.bumped)
            .field("identity", &self.identity)
            .finish_non_exhaustive()
    }
}

impl<'a, S> Observation<'a, S> {
    /// An observation of nothing but where the robot believes to be; fill in the rest by struct update.
    #[must_use]
    pub fn at(track_from_robot: Isometry2<f64>, position: &'a dyn Fn(PlaceId) -> Option<Point2<f64>>) -> Self {
        Self { track_from_robot, scans: &[], bumped: false, identity: None, position }
    }
}

/// Which place the robot stands at, by the judgement of the level above.
#[derive(Debug, Clone, PartialEq)]
pub enum Identity<S> {
    /// One of the map.
    Known {
        /// Which.
        place: PlaceId,
        /// Where the robot is, seen from its centre, in metres.
        offset: Vector2<f64>,
        /// The covariance of the offset, in m²: how well the robot knows where it is now.
        covariance: Matrix2<f64>,
        /// The covariance of what the view alone says of the offset, in m²; `None` where only coordinates speak. A link
        /// is a new measurement only as far as something was seen: coordinates must not confirm themselves.
        seen: Option<Matrix2<f64>>,
    },
    /// One that the map does not have.
    New {
        /// What it will be recognised by.
        signature: S,
    },
    /// It cannot tell: the explorer goes by dead reckoning if the place was expected, and otherwise turns back.
    Unsure,
}

/// What the robot should do. Headings are in the map's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Turn the direction of travel to `to`.
    Turn {
        /// The new direction.
        to: Heading,
    },
    /// Drive straight ahead, and stop before touching anything.
    Drive {
        /// Metres to go.
        distance: f64,
    },
    /// Turn the turret with the sensors to `to` and hold it there; a robot without one ignores this.
    Look {
        /// The heading to hold.
        to: Heading,
    },
    /// Fire all range sensors once.
    Fire {
        /// What for.
        purpose: Firing,
    },
    /// Say which place this is, in the next observation.
    Identify {
        /// The place that the explorer believes to have reached; it may be a predicted one.
        expected: Option<PlaceId>,
        /// Whether an answer is needed; otherwise the robot is passing by, and [`Identity::Unsure`] costs nothing.
        thorough: bool,
    },
    /// Observe again, where you are. Nothing predicted is left near the robot, and it is about to set out for something
    /// farther: whoever knows of more here should [expect](crate::Explorer::expect) it now.
    Leave,
    /// Nothing predicted is left: stop.
    Done,
}

/// What a firing of the sensors is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Firing {
    /// To learn what a place looks like: these readings belong into the map.
    Survey,
    /// To see what is in the way.
    Watch,
}

/// What the explorer changed in the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Change {
    /// The robot reached a place for the first time.
    PlaceVisited(PlaceId),
    /// The robot came to a place that was known.
    PlaceRecognized(PlaceId),
    /// Open space was seen.
    PlacePredicted(PlaceId),
    /// A predicted place cannot be reached.
    PlaceRefuted(PlaceId),
    /// A place turned out to be another one: a predicted one was reached and known, or a loop closed over a visited one.
    PlaceMerged {
        /// The place that is no more.
        absorbed: PlaceId,
        /// The place that it is.
        kept: PlaceId,
    },
    /// The way between two places looks open.
    LinkPredicted(LinkId),
    /// The robot went from one place to another; the link's displacement has changed.
    LinkTraveled(LinkId),
    /// Something stood in the way.
    LinkBlocked(LinkId),
    /// Two places were recognised as lying near each other, by the level above.
    LinkRecognized(LinkId),
    /// Such a recognition was taken back, because the rest of the map contradicts it.
    LinkRejected(LinkId),
}

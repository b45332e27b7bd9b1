use local_grid::nalgebra::Isometry2;
use local_grid::{Heading, Scan};

/// One thing that a robot recorded, in the vocabulary of the mapper: metres, radians counter-clockwise from `+x`, seconds.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Seconds on the log's own clock; never smaller than that of the entry before.
    pub stamp: f64,
    /// What was recorded.
    pub kind: EntryKind,
}

/// What an [`Entry`] holds.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum EntryKind {
    /// Where dead reckoning believes the robot to be, in the frame where the log began.
    Odometry {
        /// The robot's pose in the drifting `odom` frame.
        odom_from_robot: Isometry2<f64>,
    },
    /// A firing of range sensors, with the odometry of that moment where the log line states one.
    Scan {
        /// The robot's pose in the drifting `odom` frame.
        odom_from_robot: Option<Isometry2<f64>>,
        /// What the sensors read.
        scan: Scan,
    },
    /// An absolute heading: of a compass, or of an inertial unit that holds its heading.
    Heading {
        /// The robot's heading, free of the odometry's drift.
        heading: Heading,
        /// Its standard deviation in radians.
        deviation: f64,
    },
    /// The robot's own recogniser finds that it is where it was at an earlier moment. It may be wrong, and often is.
    Recognition {
        /// That moment, in seconds on the log's clock; not after the entry's own stamp.
        earlier: f64,
        /// How alike the two views are: more is more alike, on whatever scale the recogniser has.
        similarity: f64,
    },
    /// The turns that a gyro has added up: free of wheels that slip, but drifting, so no absolute heading.
    Gyro {
        /// The sum, from an arbitrary beginning.
        heading: Heading,
        /// The standard deviation in radians of one reading, its drift left aside.
        deviation: f64,
    },
    /// Where the robot really was, for evaluation only; the mapper never looks at it.
    Truth {
        /// The robot's true pose in the map frame of the experiment.
        map_from_robot: Isometry2<f64>,
    },
}

pub(crate) mod route_graph;

use nalgebra::Point2;
use topo_map::{LinkId, LinkOrigin, LinkState, PlaceId};

/// The topological map with its coordinates, as pictures, tables and exports need it.
#[derive(Debug, Clone, Default)]
pub struct Atlas {
    /// Every place that has coordinates, the first one first.
    pub places: Vec<AtlasPlace>,
    /// Every link between two of them.
    pub links: Vec<AtlasLink>,
}

/// A place with its coordinates.
#[derive(Debug, Clone)]
pub struct AtlasPlace {
    /// Its number in the topological map.
    pub id: PlaceId,
    /// A name that a person gave it.
    pub name: Option<String>,
    /// Whether the robot has been there.
    pub visited: bool,
    /// How many times it was visited.
    pub visits: u32,
    /// Where relaxation puts it, in the map frame, in metres.
    pub position: Point2<f64>,
    /// The turn of its axes in the map, in radians.
    pub heading: f64,
    /// Which way the robot looked when it came there first, in the map, in radians; 0 where it never was.
    pub robot_heading: f64,
    /// The place that it is, where a person said that it is one with another.
    pub same_as: Option<PlaceId>,
    /// Where dead reckoning along the traveled links puts it, in metres.
    pub dead_reckoned: Point2<f64>,
    /// The one-σ ellipse of its position relative to the first place: half axes in metres, the long one first, and
    /// the direction of that in radians.
    pub ellipse: Option<([f64; 2], f64)>,
}

/// A link with what relaxation left of its disagreement.
#[derive(Debug, Clone)]
pub struct AtlasLink {
    /// Its number in the topological map.
    pub id: LinkId,
    /// Index of the place where it begins, in [`Atlas::places`].
    pub from: usize,
    /// Index of the place where it ends, in [`Atlas::places`].
    pub to: usize,
    /// Where it comes from.
    pub origin: LinkOrigin,
    /// Whether it holds.
    pub state: LinkState,
    /// Its measured length, in metres.
    pub length: f64,
    /// The standard deviation of that measurement along its least sure direction, in metres.
    pub sigma: f64,
    /// Distance between where it says its end is and where the map has it, in metres.
    pub residual: f64,
    /// The same in standard deviations of the link.
    pub residual_sigma: f64,
    /// How many times it was traveled.
    pub traversals: u32,
}

impl AtlasLink {
    /// Whether it is a measurement that the coordinates must respect.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        self.state != LinkState::Rejected && self.origin != LinkOrigin::Predicted
    }
}

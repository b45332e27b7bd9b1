//! Places and the links between them, recognition of places, and exploration: the topological level of the hierarchy of maps.

mod link;
mod localize;
mod map;
mod place;
mod route;

pub use link::{Displacement, DisplacementError, Link, LinkId, LinkOrigin, LinkState, Turn};
pub use localize::{
    Belief, Hypothesis, LocalizeError, Localizer, LocalizerOptions, PlaceLikelihood, Recognition, Unsure,
};
pub use map::{MapError, Neighbor, TopoMap};
pub use place::{Place, PlaceId, PlaceState};
pub use route::Route;

pub use local_grid;

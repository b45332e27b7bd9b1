#![doc = include_str!("../README.md")]

mod dead_reckoning;
mod explore;
mod link;
mod localize;
mod map;
mod nearby;
mod open_space;
mod place;
mod range_rose;
mod route;
mod signature_index;

pub use dead_reckoning::DeadReckoning;
pub use explore::{
    Change, Command, ExploreError, Explorer, ExplorerOptions, Firing, Identity, Observation, ObstacleOptions,
    SurveyMotion,
};
pub use link::{Displacement, DisplacementError, Link, LinkId, LinkOrigin, LinkState, Turn};
pub use localize::{
    Belief, Hypothesis, LocalizeError, Localizer, LocalizerOptions, PlaceLikelihood, Recognition, Unsure,
};
pub use map::{MapError, Neighbor, TopoMap};
pub use nearby::{NearbyOptions, Supposed, identify_nearby};
pub use open_space::{
    Central, FeatureOptions, Features, N_FEATURES, NetworkError, OpenSpace, Opening, PeakOptions, RocScore, Sample,
    TrainOptions, TrainReport, gradient, mean_loss, roc_score, train,
};
pub use place::{Place, PlaceId, PlaceState};
pub use range_rose::RangeRose;
pub use route::Route;
pub use signature_index::{Found, IndexError, SignatureIndex};

pub use local_grid;

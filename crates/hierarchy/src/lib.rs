#![doc = include_str!("../README.md")]

mod atlas;
mod config;
mod coordinates;
pub mod edit;
pub mod evaluate;
mod event;
pub mod explain;
mod exploration;
mod front_end;
mod live_map;
mod mapper;
mod metrics;
mod query;
mod recognize;
mod session;
mod trajectory;

pub use atlas::route_graph::{RouteEdge, RouteGraph, RouteNode, RouteOptions};
pub use atlas::{Atlas, AtlasLink, AtlasPlace};
pub use config::{
    Config, ConfigError, GridConfig, HeadingConfig, HeadingMode, OdometryConfig, PlaceConfig, RecognitionConfig,
    RelaxationConfig, RelaxationPolicy, SonarDrawing,
};
pub use coordinates::directions::HeldHeading;
pub use coordinates::problem::{Problem, RelaxationError};
pub use coordinates::{Coordinates, Relaxation};
pub use event::{CarriedBy, Event};
pub use exploration::{Ended, Errand, Exploration, ExplorationError};
pub use front_end::SenseError;
pub use front_end::gyro::{GyroDrift, GyroSurvey};
pub use front_end::tracker::{Tracker, Travel};
pub use live_map::{Followed, LiveMap};
pub use mapper::growth::{Growth, Regrown};
pub use mapper::tally::Tally;
pub use mapper::{Mapper, MapperError};
pub use metrics::truth::Truth;
pub use metrics::{
    GridMetrics, LinkMetrics, LogMetrics, METRICS_SCHEMA, Metrics, RefusedLoop, RegionMetrics, RelaxationMetrics,
    Timings, TrustMetrics, TruthMetrics, WeakLink,
};
pub use query::floor_plan::{FloorPlan, KnownGateway, KnownRegion, Landmark, Passage};
pub use query::{Finder, FinderError, Plan, Planner, RouteError, Whereabouts, count_regions, floor, regions};
pub use recognize::{Closure, Verdict};
pub use session::SessionError;
pub use trajectory::{Anchor, Sample, Trajectory};

pub use global_grid;
pub use region_map;
pub use relaxation;
pub use robot_log;
pub use robot_log::local_grid;
pub use topo_map;

/// The code of the tutorial is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/tutorial.md")]
struct Tutorial;

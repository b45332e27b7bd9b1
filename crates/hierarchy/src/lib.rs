#![doc = include_str!("../README.md")]

mod atlas;
mod config;
mod coordinates;
mod directions;
pub mod edit;
pub mod evaluate;
mod event;
pub mod explain;
mod exploration;
mod eyes;
mod floor_plan;
mod front_end;
mod growth;
mod gyro;
mod laser;
mod live_map;
mod mapper;
mod metrics;
mod problem;
mod proposals;
mod query;
mod reach;
mod recognize;
mod route_graph;
mod session;
mod sight;
mod summary;
mod tally;
mod tracker;
mod trajectory;
mod truth;
mod verify;
mod wall_heading;

pub use atlas::{Atlas, AtlasLink, AtlasPlace};
pub use config::{
    Config, ConfigError, GridConfig, HeadingConfig, HeadingMode, OdometryConfig, PlaceConfig, RecognitionConfig,
    RelaxationConfig, RelaxationPolicy, SonarDrawing,
};
pub use coordinates::{Coordinates, Relaxation};
pub use directions::HeldHeading;
pub use event::Event;
pub use exploration::{Ended, Errand, Exploration, ExplorationError};
pub use floor_plan::{FloorPlan, KnownGateway, KnownRegion, Landmark, Passage};
pub use front_end::SenseError;
pub use growth::{Growth, Regrown};
pub use live_map::{Followed, LiveMap};
pub use mapper::{Mapper, MapperError};
pub use metrics::{
    GridMetrics, LinkMetrics, LogMetrics, METRICS_SCHEMA, Metrics, RefusedLoop, RegionMetrics, RelaxationMetrics,
    Timings, TrustMetrics, TruthMetrics, WeakLink,
};
pub use problem::{Problem, RelaxationError};
pub use query::{Plan, Planner, RouteError, count_regions, floor, regions};
pub use recognize::{Closure, Verdict};
pub use route_graph::{RouteEdge, RouteGraph, RouteNode, RouteOptions};
pub use session::SessionError;
pub use tally::Tally;
pub use tracker::{Tracker, Travel};
pub use trajectory::{Anchor, Sample, Trajectory};
pub use truth::Truth;

pub use global_grid;
pub use region_map;
pub use relaxation;
pub use robot_log;
pub use robot_log::local_grid;
pub use topo_map;

//! Rooms, corridors and gateways from a gridmap of free space.

mod carve;
mod clean;
mod components;
mod distance;
mod gates;
mod gateways;
mod options;
mod plane;
mod region_map;
mod regions;
mod segment;

pub use local_grid;
pub use local_grid::nalgebra;

pub use gateways::Gateway;
pub use options::{Options, SegmentError};
pub use region_map::RegionMap;
pub use regions::Region;
pub use segment::{segment, segment_explored};

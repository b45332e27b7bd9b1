//! Rooms, corridors and gateways from a gridmap of free space.

pub mod baseline;
mod carve;
mod clean;
mod components;
mod distance;
mod gates;
mod gateways;
mod morphology;
mod options;
mod plane;
mod region_map;
mod regions;
mod segment;
mod watershed;

pub use local_grid;
pub use local_grid::nalgebra;

pub use gateways::Gateway;
pub use morphology::{Element, Logic, dilate, erode, opening};
pub use options::{Options, SegmentError};
pub use region_map::RegionMap;
pub use regions::Region;
pub use segment::{segment, segment_explored};

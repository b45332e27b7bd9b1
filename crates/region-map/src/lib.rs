//! Rooms, corridors and gateways from a gridmap of free space.

pub mod baseline;
mod carve;
mod chords;
mod clean;
mod components;
mod crop;
mod distance;
pub mod export;
mod gates;
mod gateways;
mod graph;
mod morphology;
mod mouths;
mod names;
mod numbering;
mod options;
mod outline;
mod plane;
mod region_map;
mod regions;
mod segment;
mod survey;
mod watershed;

pub use local_grid;
pub use local_grid::nalgebra;

pub use gateways::Gateway;
pub use graph::Route;
pub use morphology::{Element, Logic, dilate, erode, opening};
pub use names::{NoSuchRegion, carry_names};
pub use options::{Options, SegmentError};
pub use outline::{Outline, Polygon};
pub use region_map::RegionMap;
pub use regions::Region;
pub use segment::{segment, segment_explored};

#![doc = include_str!("../README.md")]

mod components;
mod distance;
mod morphology;
mod numbering;
mod plane;

mod gateways;
mod graph;
mod names;
mod options;
mod region_map;
mod regions;
mod segment;

pub mod baseline;
pub mod export;

pub use local_grid;
pub use local_grid::nalgebra;

pub use gateways::Gateway;
pub use graph::Route;
pub use morphology::{Element, Logic, dilate, erode, opening};
pub use names::overlay::lay_over;
pub use names::{NoSuchRegion, carry_names};
pub use options::{Options, SegmentError};
pub use region_map::RegionMap;
pub use regions::Region;
pub use regions::outline::{Outline, Polygon};
pub use segment::{segment, segment_explored};

#![doc = include_str!("../README.md")]

mod plane;

mod components;
mod crop;

mod clean;
mod distance;
mod morphology;

mod chords;
mod gates;
mod mouths;

mod carve;
mod numbering;
mod watershed;

mod gateways;
mod options;
mod outline;
mod region_map;
mod regions;
mod segment;
mod survey;

mod graph;
mod names;
mod overlay;

pub mod baseline;
pub mod export;

pub use local_grid;
pub use local_grid::nalgebra;

pub use gateways::Gateway;
pub use graph::Route;
pub use morphology::{Element, Logic, dilate, erode, opening};
pub use names::{NoSuchRegion, carry_names};
pub use options::{Options, SegmentError};
pub use outline::{Outline, Polygon};
pub use overlay::lay_over;
pub use region_map::RegionMap;
pub use regions::Region;
pub use segment::{segment, segment_explored};

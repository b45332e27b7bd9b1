#![doc = include_str!("../README.md")]

mod arcs;
mod assemble;
mod calculus;
mod cone;
mod counts;
mod dense;
mod derived;
mod difference;
mod draw;
mod echo_model;
mod exposure;
mod fan;
pub mod layers;
mod map;
pub mod map_server;
mod moravec_elfes;
mod occupancy;
mod options;
mod oriolo;
mod picture;
pub mod plan;
mod plane;
mod score;
mod share;
mod sonar;
mod sums;
mod tally;
mod window;

pub use assemble::assemble;
pub use calculus::Calculus;
pub use derived::{Derived, Norm, derive, derived};
pub use difference::{Change, common_frame, count_changes, difference, resampled, write_difference};
pub use echo_model::SharedEcho;
pub use exposure::Exposure;
pub use map::GridMap;
pub use moravec_elfes::{MoravecElfesOptions, moravec_elfes};
pub use occupancy::{CellCounts, CrispOptions, Occupancy, count_cells, occupancy};
pub use options::{GridError, GridOptions, SonarModel};
pub use picture::{PictureError, write_indexed, write_path, write_picture, write_side_by_side};
pub use score::{MapScore, score};
pub use tally::{STRONGEST_EVIDENCE, Tally, UNITS_PER_NAT};

pub use local_grid;

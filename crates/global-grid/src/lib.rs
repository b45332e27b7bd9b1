#![doc = include_str!("../README.md")]

mod calculus;
mod derived;
mod difference;
mod draw;
mod exposure;
pub mod layers;
mod map;
pub mod map_server;
mod occupancy;
mod options;
mod picture;
pub mod plan;
mod plane;
mod score;
mod tally;

pub use calculus::Calculus;
pub use derived::{Derived, Norm, derive, derived};
pub use difference::{Change, common_frame, count_changes, difference, resampled, write_difference};
pub use draw::echo_model::SharedEcho;
pub use draw::moravec_elfes::{MoravecElfesOptions, moravec_elfes};
pub use exposure::Exposure;
pub use map::GridMap;
pub use map::assemble::assemble;
pub use occupancy::{CellCounts, CrispOptions, Occupancy, count_cells, occupancy};
pub use options::{GridError, GridOptions, SonarModel};
pub use picture::{PictureError, write_indexed, write_path, write_picture, write_side_by_side};
pub use score::{MapScore, score};
pub use tally::{STRONGEST_EVIDENCE, Tally, UNITS_PER_NAT};

pub use local_grid;

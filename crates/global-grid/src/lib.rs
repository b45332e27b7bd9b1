//! One gridmap in the map frame from poses and scans: fuzzy, Bayesian and Dempster-Shafer.

mod calculus;
mod dense;
mod draw;
mod map;
pub mod map_server;
mod occupancy;
mod options;
mod picture;
mod tally;
mod tiles;

pub use calculus::Calculus;
pub use map::{GridMap, assemble};
pub use occupancy::{CellCounts, CrispOptions, Occupancy, count_cells, occupancy};
pub use options::{GridError, GridOptions, SonarModel};
pub use picture::{PictureError, write_picture};
pub use tally::{STRONGEST_EVIDENCE, Tally, UNITS_PER_NAT};

pub use local_grid;

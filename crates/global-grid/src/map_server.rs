//! `map.pgm` and `map.yaml` as the ROS map server writes and reads them.

mod image;
mod pgm;
mod png;
mod read;
mod shades;
mod write;
mod yaml;

use local_grid::GridFrame;

pub(crate) use image::read_shades;
pub use read::{MapImage, ReadError, read_image};
pub use shades::ImageError;
pub use write::{write_pgm, write_raw, write_scale, write_yaml};
pub use yaml::MetadataError;

/// How the map server turns a pixel into occupancy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Mode {
    /// Occupied, free or unknown.
    #[default]
    Trinary,
    /// Degrees between the thresholds.
    Scale,
    /// The pixel's value itself.
    Raw,
}

/// What `map.yaml` says: where the image lies in the map frame and what its pixels mean.
#[derive(Debug, Clone, PartialEq)]
pub struct MapMetadata {
    /// The image's file name, beside the YAML file.
    pub image: String,
    /// How a pixel is read.
    pub mode: Mode,
    /// Edge of a pixel in metres.
    pub resolution: f64,
    /// Pose of the lower left corner of the lower left pixel: `x`, `y` in metres, yaw in radians.
    pub origin: [f64; 3],
    /// Whether white means occupied.
    pub negate: bool,
    /// Above this occupancy a cell is occupied.
    pub occupied_thresh: f64,
    /// Below this occupancy a cell is free.
    pub free_thresh: f64,
}

impl MapMetadata {
    /// The shade of an unknown cell.
    pub const UNKNOWN: u8 = 205;
    /// The shade of a free cell.
    pub const FREE: u8 = 254;
    /// The shade of an occupied cell.
    pub const OCCUPIED: u8 = 0;

    /// The description of an image of a grid in `frame`: trinary, not negated, not turned.
    ///
    /// The unknown shade 205 means an occupancy of `50/255 = 0.196078`, which must not count as free: hence a
    /// `free_thresh` of 0.196, where many tools' default of 0.25 makes unexplored space drivable.
    #[must_use]
    pub fn new(image: impl Into<String>, frame: &GridFrame) -> Self {
        Self {
            image: image.into(),
            mode: Mode::Trinary,
            resolution: frame.resolution(),
            origin: [frame.origin().x, frame.origin().y, 0.0],
            negate: false,
            occupied_thresh: 0.65,
            free_thresh: 0.196,
        }
    }
}

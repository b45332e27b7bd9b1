//! Local occupancy grids, evidence, range sensors and place signatures: the bottom of the hierarchy of maps.

mod evidence;
mod frame;
mod grid;
mod heading;
mod scan;

pub use evidence::{Cell, Evidence, Fuzzy};
pub use frame::{FrameError, GridFrame};
pub use grid::{FuzzyGrid, Grid};
pub use heading::Heading;
pub use scan::{Beam, RangeSensor, Reading, Scan, ScanError, SensorError, SensorKind};

pub use nalgebra;

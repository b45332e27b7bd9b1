#![doc = include_str!("../README.md")]

mod align;
mod evidence;
mod facing;
mod frame;
mod grid;
mod heading;
mod integrate;
mod local_map;
pub mod raster;
mod scan;
mod scan_match;
mod sensor;
mod signature;
mod structure;
mod working;

pub use align::{AlignOptions, Alignment, Ambiguity, align};
pub use evidence::{Bayes, Cell, DempsterShafer, Evidence, Fuzzy, Union};
pub use facing::{facing, unseen_by_sonar};
pub use frame::{FrameError, GridFrame};
pub use grid::{FuzzyGrid, Grid};
pub use heading::Heading;
pub use local_map::{LocalMap, LocalMapError, LocalMapOptions};
pub use scan::{Beam, RangeSensor, Reading, Scan, ScanError, SensorError, SensorKind, Sweep};
pub use scan_match::{
    Echo, Fit, Match, MatchOptions, Prior, SearchWindow, TrackOptions, echoes, judge, refine, search, thinned, track,
};
pub use sensor::{
    AngularProfile, BeamPoint, Footprint, LaserRay, ModelError, SensorModel, SonarCone, SonarRegions, Sounding,
};
pub use signature::{
    AxisHistogram, CellClass, Count, Descriptor, HistogramMatch, Signature, SignatureError, SignatureOptions,
};
pub use structure::{
    FollowedWall, Learnt, StructureOptions, WallCompass, WallCompassOptions, WallDirection, WallEcho, WallRun,
    WallRunOptions, WallRuns, wall_direction_of_echoes, wall_direction_of_segments,
};
pub use working::{WorkingGrid, WorkingGridOptions};

pub use nalgebra;

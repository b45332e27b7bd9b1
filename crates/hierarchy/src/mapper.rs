use std::sync::Arc;

use nalgebra::Isometry2;
use robot_log::local_grid::{Scan, Signature};
use robot_log::{Entry, EntryKind};
use topo_map::{Displacement, PlaceId, TopoMap, Turn};

use crate::config::{Config, ConfigError, RelaxationPolicy};
use crate::coordinates::{Coordinates, Relaxation};
use crate::front_end::FrontEnd;
use crate::recognize::{Closure, Recognizer};
use crate::trajectory::{Anchor, Sample, Trajectory};
use crate::{Event, Tally};

/// Builds all levels of the hierarchy from a stream of log entries and keeps them consistent.
///
/// ```no_run
/// # fn entries() -> Vec<robot_log::Entry> { vec![] }
/// let mut mapper = hierarchy::Mapper::new(hierarchy::Config::default())?;
/// for entry in entries() {
///     for event in mapper.push(&entry)? {
///         println!("{event:?}");
///     }
/// }
/// mapper.finish()?;
/// let gridmap = mapper.gridmap()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Mapper {
    config: Config,
    front_end: FrontEnd,
    trajectory: Trajectory,
    map: TopoMap<Arc<Signature>>,
    coordinates: Coordinates,
    recognizer: Recognizer,
    tally: Tally,
}

/// Why an entry could not be taken in.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapperError {
    /// The configuration cannot be used.
    #[error("configuration: {0}")]
    Config(#[from] ConfigError),
    /// Time runs backwards.
    #[error("stamp {stamp} s comes after {previous} s: entries must be in the order of their stamps")]
    Backwards {
        /// The entry's stamp.
        stamp: f64,
        /// The stamp before.
        previous: f64,
    },
    /// A pose or a stamp is not a number.
    #[error("entry at {stamp} s: {what} is not finite")]
    NotFinite {
        /// The entry's stamp.
        stamp: f64,
        /// What is not finite.
        what: &'static str,
    },
    /// The topological level refused a step.
    #[error("topological map: {0}")]
    Topology(#[from] topo_map::MapError),
    /// The links cannot be relaxed.
    #[error("relaxation: {0}")]
    Relaxation(#[from] relaxation::NetworkError),
    /// The gridmap cannot be made.
    #[error("gridmap: {0}")]
    Grid(String),
}

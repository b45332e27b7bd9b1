pub(crate) mod truth;

use serde::{Deserialize, Serialize};

/// The figures of a run: what `metrics.json` holds. Its keys are a promise.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Metrics {
    /// Name and version of this list of keys.
    pub schema: String,
    /// What came in.
    pub log: LogMetrics,
    /// Places visited.
    pub places: usize,
    /// Places predicted and not yet visited.
    pub predicted_places: usize,
    /// How places are joined.
    pub links: LinkMetrics,
    /// How consistent the coordinates are.
    pub relaxation: RelaxationMetrics,
    /// How far the map is to be trusted.
    #[serde(default)]
    pub trust: TrustMetrics,
    /// The gridmap.
    pub grid: GridMetrics,
    /// Rooms and corridors; absent where none were looked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub regions: Option<RegionMetrics>,
    /// Mean error of the places against the truth that the log holds; absent where it holds none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthMetrics>,
    /// Seconds of each stage.
    pub timings_s: Timings,
    /// Largest memory of the process so far, in MiB; 0 where the system does not say.
    pub peak_memory_mib: f64,
}

/// The version of the keys of [`Metrics`].
pub const METRICS_SCHEMA: &str = "topogrid/metrics/1";

/// What came in.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LogMetrics {
    /// Entries of any kind.
    pub entries: usize,
    /// Firings of range sensors.
    pub scans: usize,
    /// Beams that measured (an echo, or none up to the maximum range).
    pub readings: usize,
    /// Summed length of the odometry's steps, in metres.
    pub path_length_m: f64,
    /// Last stamp minus first, in seconds.
    pub duration_s: f64,
    /// Where headings came from: `compass`, `structure` or `odometry`.
    pub heading_source: String,
    /// Damaged lines that were skipped.
    pub skipped: usize,
}

/// How places are joined.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LinkMetrics {
    /// Links driven.
    pub traveled: usize,
    /// Loops closed by recognition.
    pub recognized: usize,
    /// Recognitions weighed and refused.
    pub rejected: usize,
    /// Links over which the robot was carried.
    #[serde(default)]
    pub carried: usize,
    /// Pieces in which the map is, because the robot was carried and has not recognised anything since; 0 or 1 where it is whole.
    #[serde(default)]
    pub pieces: usize,
}

/// How consistent the coordinates are.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RelaxationMetrics {
    /// Energy of dead reckoning over all links (weighted; dimensionless).
    pub energy_before: f64,
    /// Energy of the coordinates that the map has.
    pub energy_after: f64,
    /// Energy of the direct least-squares solution of the same links.
    pub energy_optimum: f64,
    /// `(after − optimum) / before`, or 0 where nothing was to be repaired.
    pub relative_gap: f64,
    /// Gauss-Seidel sweeps in all.
    pub sweeps: usize,
    /// The solver that made the final coordinates.
    pub solver: String,
    /// Largest distance between a place's dead-reckoned and its final position, in metres.
    pub max_shift_m: f64,
}

/// How far the map is to be trusted: what summary, report and gates show of an `explain::Explanation`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TrustMetrics {
    /// Root mean square by which the believed loops miss by dead reckoning, in metres.
    pub loop_residual_before_m: f64,
    /// The same after relaxation.
    pub loop_residual_after_m: f64,
    /// The largest distance of a believed loop from what the rest of the map says, in standard deviations.
    pub loop_residual_worst_sigma: f64,
    /// The median standard deviation of the places, in metres.
    pub place_sigma_median_m: f64,
    /// The largest.
    pub place_sigma_worst_m: f64,
    /// The place that has it.
    pub worst_place: Option<u32>,
    /// Links of that place.
    pub worst_place_links: usize,
    /// Refused loops, the farthest from the map first: at most three.
    pub refused: Vec<RefusedLoop>,
    /// The one link that holds many places to the rest, where there is one.
    pub weakest_link: Option<WeakLink>,
}

/// A loop that was refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RefusedLoop {
    /// The place that was reached.
    pub place: u32,
    /// The older place that it looks like.
    pub known: u32,
    /// How many standard deviations it is from what the map says.
    pub residual_sigma: f64,
}

/// A link that alone holds many places to the rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WeakLink {
    /// One end.
    pub from: u32,
    /// The other.
    pub to: u32,
    /// How many places.
    pub holds: usize,
}

/// The gridmap.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct GridMetrics {
    /// Rows, along `+y`.
    pub rows: usize,
    /// Columns, along `+x`.
    pub columns: usize,
    /// Metres per cell.
    pub resolution_m: f64,
    /// `fuzzy`, `bayes` or `dempster-shafer`.
    pub calculus: String,
    /// Cells that are occupied.
    pub occupied: usize,
    /// Cells that are empty.
    pub empty: usize,
    /// Cells about which the readings contradict each other.
    pub contradictory: usize,
    /// Cells about which nothing is known.
    pub unexplored: usize,
}

/// Rooms and corridors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RegionMetrics {
    /// Regions that are rooms rather than corridors.
    pub rooms: usize,
    /// Regions that are corridors rather than rooms.
    pub corridors: usize,
    /// Narrow passages between regions.
    pub gateways: usize,
}

/// Position error of the places against the log's truth, in metres, after rigid alignment.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TruthMetrics {
    /// Places that have a truth.
    pub places: usize,
    /// Mean error of the raw odometry.
    pub odometry_m: f64,
    /// Mean error of dead reckoning along the links, before relaxation.
    pub before_m: f64,
    /// Mean error after relaxation.
    pub after_m: f64,
}

/// Seconds of each stage, processor or wall clock as the caller measures.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Timings {
    /// Reading and parsing.
    pub read: f64,
    /// Tracking, local grids, signatures.
    pub local: f64,
    /// Recognition.
    pub recognize: f64,
    /// Relaxation.
    pub relax: f64,
    /// The gridmap.
    pub grid: f64,
    /// Rooms and gateways.
    pub regions: f64,
    /// Writing files.
    pub write: f64,
    /// All of it.
    pub total: f64,
}

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use hierarchy::local_grid::FuzzyGrid;
use hierarchy::{Config, GridMetrics, Mapper, Metrics, Truth};
use region_map::RegionMap;
use robot_log::{EntryKind, LogReader};

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::input::{LogArgs, warn_of_skipped};
use crate::run_folder::RunFolder;
use crate::{memory, output, summary};

/// A log goes in; a topological map with consistent coordinates and a gridmap come out
///
/// Example: topogrid run office.log.gz -o runs/office
#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    log: LogArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Where the results of a run go, and how it is done.
#[derive(Debug, Args)]
pub(crate) struct OutputArgs {
    /// The folder for the results [default: runs/NAME, with a number behind it where that exists]
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Write into a folder that holds another run
    #[arg(long)]
    pub(crate) force: bool,
    /// Settings as TOML; unknown keys are errors, and the effective settings are written into the run folder
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Metres per cell of the gridmap
    #[arg(long, value_name = "M")]
    pub(crate) resolution: Option<f64>,
    /// Where headings come from
    #[arg(long, value_name = "SOURCE", value_parser = heading_mode)]
    pub(crate) heading: Option<hierarchy::HeadingMode>,
    /// Relax once for each added place, as the paper does, and never to the optimum
    #[arg(long)]
    pub(crate) online: bool,
}

/// A source of headings by its name in the configuration.
fn heading_mode(name: &str) -> Result<hierarchy::HeadingMode, String> {
    use hierarchy::HeadingMode::{Auto, Compass, Odometry, Structure};
    match name {
        "auto" => Ok(Auto),
        "compass" => Ok(Compass),
        "structure" => Ok(Structure),
        "odometry" => Ok(Odometry),
        _ => Err("expected auto, compass, structure or odometry".to_owned()),
    }
}

impl OutputArgs {
    /// Whether nothing is said about how the map is made.
    pub(crate) fn is_default(&self) -> bool {
        self.config.is_none() && self.resolution.is_none() && self.heading.is_none() && !self.online
    }

    /// The configuration: built in, then the file, then the flags.
    pub(crate) fn configuration(&self) -> Result<Config, Failure> {
        let mut config = match &self.config {
            Some(path) => {
                let text =
                    std::io::read_to_string(files::open(path)?).map_err(|error| Failure::reading(path, &error))?;
                let rejected = |error| Failure::new(Exit::Rejected, "config", format!("{}: {error}", path.display()));
                Config::from_toml(&text).map_err(rejected)?
            }
            None => Config::default(),
        };
        if let Some(resolution) = self.resolution {
            config.grid.resolution_m = resolution;
        }
        if let Some(source) = self.heading {
            config.heading.source = source;
        }
        if self.online {
            config.relaxation.policy = hierarchy::RelaxationPolicy::OneSweep;
        }
        config.check().map_err(|error| Failure::new(Exit::Usage, "config", error.to_string()))?;
        Ok(config)
    }
}

/// Does the whole job.
pub(crate) fn run(args: &RunArgs, context: &Context) -> Result<(), Failure> {
    let first = args.log.logs.first().map_or(Path::new("-"), |path| path);
    map_log(&name_of(first), args.log.open()?, &args.output, context)
}

/// What a run is called: its log's name without folder and endings.
fn name_of(path: &Path) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.split('.').next().unwrap_or_default();
    if stem.is_empty() || stem == "-" { "run".to_owned() } else { stem.to_owned() }
}

/// A finished map with everything that is written of it.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) mapper: Mapper,
    pub(crate) gridmap: FuzzyGrid,
    pub(crate) regions: RegionMap,
    pub(crate) metrics: Metrics,
}

/// Maps a log into a folder of its own.
pub(crate) fn map_log(name: &str, log: LogReader, args: &OutputArgs, context: &Context) -> Result<(), Failure> {
    let mapper = Mapper::new(args.configuration()?).map_err(rejected)?;
    let folder = RunFolder::choose(args.out.as_deref(), name, args.force)?;
    go_on(name, mapper, log, folder, context)
}

/// Goes on with a map, fills the run folder, and says what was made.
pub(crate) fn go_on(
    name: &str,
    mapper: Mapper,
    mut log: LogReader,
    mut folder: RunFolder,
    context: &Context,
) -> Result<(), Failure> {
    let started = Instant::now();
    let finished = build(mapper, &mut log, context)?;
    let mut metrics = finished.metrics.clone();
    warn_of_skipped(log.reports(), context);
    let skipped: u64 = log.reports().map(|report| report.skipped_lines()).sum();
    metrics.log.skipped = usize::try_from(skipped).unwrap_or(usize::MAX);
    let writing = Instant::now();
    output::write(&mut folder, &finished)?;
    metrics.timings_s.write = writing.elapsed().as_secs_f64();
    metrics.timings_s.total = started.elapsed().as_secs_f64();
    metrics.peak_memory_mib = memory::peak_mib();
    folder.write("metrics.json", "the figures of the run", |out| Ok(serde_json::to_writer_pretty(out, &metrics)?))?;
    if context.json { context.print_json(&metrics) } else { context.print(&summary::text(name, &folder, &metrics)) }
}

/// A log or a configuration that the mapper refuses.
fn rejected(error: hierarchy::MapperError) -> Failure {
    Failure::new(Exit::Rejected, "map", error.to_string())
}

/// Feeds the log to the mapper and draws the gridmap.
fn build(mut mapper: Mapper, log: &mut LogReader, context: &Context) -> Result<Finished, Failure> {
    let mut truth = Truth::default();
    let stage = context.progress().stage("mapping", 0);
    let (mut reading, mut mapping) = (0.0, 0.0);
    let mut mark = Instant::now();
    for entry in log.by_ref() {
        let entry = entry?;
        reading += mark.elapsed().as_secs_f64();
        mark = Instant::now();
        if let EntryKind::Truth { map_from_robot } = entry.kind {
            truth.push(entry.stamp, map_from_robot);
        }
        mapper.push(&entry).map_err(rejected)?;
        mapping += mark.elapsed().as_secs_f64();
        mark = Instant::now();
        let entries = mapper.tally().entries;
        if entries.is_multiple_of(100) {
            let places = mapper.topology().n_visited();
            stage.at(entries as u64, || format!("{entries} entries, {places} places"));
        }
    }
    mapper.finish().map_err(rejected)?;
    stage.finish(&format!("{} entries, {} places", mapper.tally().entries, mapper.topology().n_visited()));
    if mapper.topology().places().is_empty() {
        let message = "the log holds no scan, so there is nothing to map";
        return Err(Failure::new(Exit::Rejected, "map.empty", message).help("topogrid inspect LOG tells what it holds"));
    }
    let stage = context.progress().stage("gridmap", 0);
    let drawing = Instant::now();
    let gridmap = mapper.gridmap().map_err(rejected)?;
    let frame = gridmap.frame();
    stage.finish(&format!("{} × {} cells of {} m", frame.rows(), frame.columns(), frame.resolution()));
    let cutting = Instant::now();
    let regions = mapper.survey(&gridmap).map_err(|error| {
        Failure::new(Exit::Rejected, "regions", format!("could not cut the map into regions: {error}"))
    })?;
    let mut metrics = mapper.metrics().map_err(rejected)?;
    metrics.regions = Some(hierarchy::count_regions(&regions));
    metrics.timings_s.regions = cutting.elapsed().as_secs_f64();
    metrics.truth = truth.judge(&mapper);
    metrics.grid = count(&gridmap);
    metrics.timings_s.read = reading;
    metrics.timings_s.local = mapping;
    metrics.timings_s.grid = drawing.elapsed().as_secs_f64();
    Ok(Finished { mapper, gridmap, regions, metrics })
}

fn count(gridmap: &FuzzyGrid) -> GridMetrics {
    let counts = global_grid::count_cells(gridmap, &global_grid::CrispOptions::default());
    let frame = gridmap.frame();
    GridMetrics {
        rows: frame.rows(),
        columns: frame.columns(),
        resolution_m: frame.resolution(),
        calculus: "fuzzy".into(),
        occupied: counts.occupied,
        empty: counts.empty,
        contradictory: counts.contradictory,
        unexplored: counts.unexplored,
    }
}

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use hierarchy::{Config, Mapper, Metrics};
use toml::Value;

use crate::context::{self, Context};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::finished::{Finished, rejected};
use crate::gate::{self, Gate};
use crate::input::{Log, LogArgs, warn_of_skipped};
use crate::live::LiveArgs;
use crate::mapping::{self, Fed, Part};
use crate::run_folder::RunFolder;
use crate::run_folder::run_record::RunRecord;
use crate::settings::{Origin, Settings, SettingsArgs};
use crate::{
    finished::memory, finished::output, finished::summary, input::edits, input::session, report, run_folder::verify,
};

mod plan;

/// A log goes in; a topological map with consistent coordinates and a gridmap come out
///
/// Examples:
///   topogrid run office.log.gz -o runs/office
///   topogrid run office.log --set places.spacing_m=0.8 --fail-on 'relaxation.relative_gap>1e-6'
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) log: LogArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
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
    #[command(flatten)]
    pub(crate) settings: SettingsArgs,
    /// Metres per cell of the gridmap
    #[arg(long, value_name = "M")]
    pub(crate) resolution: Option<f64>,
    /// Where headings come from: auto, compass, structure or odometry
    #[arg(long, value_name = "SOURCE")]
    pub(crate) heading: Option<String>,
    /// Relax once for each added place, as the paper does, and never to the optimum
    #[arg(long)]
    pub(crate) online: bool,
    /// Begin so many seconds after the log's first entry
    #[arg(long, value_name = "S")]
    pub(crate) from: Option<f64>,
    /// End so many seconds after the log's first entry
    #[arg(long, value_name = "S")]
    pub(crate) until: Option<f64>,
    /// The seed of everything random, kept in run.json; mapping itself draws nothing at random
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Save the session after so many new places; 0: only at the end
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(crate) checkpoint: usize,
    /// Map the log twice and compare every file; exit code 4 where one differs
    #[arg(long)]
    pub(crate) verify: bool,
    /// End with exit code 4 where this holds for the figures of metrics.json, such as 'links.rejected>5'; may be repeated
    #[arg(long, value_name = "EXPR")]
    pub(crate) fail_on: Vec<Gate>,
    /// Say what would be done, and do nothing
    #[arg(long)]
    pub(crate) dry_run: bool,
    #[command(flatten)]
    pub(crate) live: LiveArgs,
}

impl OutputArgs {
    /// Whether nothing is said about how the map is made.
    pub(crate) fn is_default(&self) -> bool {
        let settings = self.settings.config.is_none() && self.settings.set.is_empty();
        settings && self.resolution.is_none() && self.heading.is_none() && !self.online
    }

    /// The settings with those of the flags on top.
    pub(crate) fn settings(&self, context: &Context) -> Result<Settings, Failure> {
        let mut settings = Settings::layered(&self.settings, context)?;
        if let Some(resolution) = self.resolution {
            settings.put("grid.resolution_m", Value::Float(resolution), Origin::Flag("--resolution"))?;
        }
        if let Some(source) = &self.heading {
            settings.put("heading.source", Value::String(source.clone()), Origin::Flag("--heading"))?;
        }
        if self.online {
            settings.put("relaxation.policy", Value::String("one-sweep".into()), Origin::Flag("--online"))?;
        }
        Ok(settings)
    }
}

/// A log that is mapped.
pub(crate) struct Job<'a> {
    /// What the run is called.
    pub(crate) name: String,
    /// Its files, for the record; none where the program brings the log itself.
    pub(crate) inputs: &'a [PathBuf],
    /// Opens the log, as often as it is asked.
    pub(crate) open: &'a dyn Fn() -> Result<Log, Failure>,
    pub(crate) args: &'a OutputArgs,
}

/// Does the whole job.
pub(crate) fn run(args: &RunArgs, context: &Context) -> Result<(), Failure> {
    let first = args.log.logs.first().map_or(Path::new("-"), |path| path);
    let open = || args.log.open();
    map_log(&Job { name: name_of(first), inputs: &args.log.logs, open: &open, args: &args.output }, context)
}

/// What a run is called: its log's name without folder and endings.
fn name_of(path: &Path) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.split('.').next().unwrap_or_default();
    if stem.is_empty() || stem == "-" { "run".to_owned() } else { stem.to_owned() }
}

/// Maps a log into a folder of its own.
pub(crate) fn map_log(job: &Job, context: &Context) -> Result<(), Failure> {
    let settings = job.args.settings(context)?;
    let config = settings.config()?;
    if job.args.verify && job.inputs.iter().any(|path| path.as_os_str() == "-") {
        let message = "standard input can be read once only, and --verify reads twice";
        return Err(Failure::new(Exit::Usage, "verify.input", message).help("name a file"));
    }
    let folder = RunFolder::choose(job.args.out.as_deref(), &job.name, job.args.force)?;
    if job.args.dry_run {
        (job.open)()?; // what cannot be opened is no plan
        return context.print(&plan::text(job, &folder, settings));
    }
    let mapper = new_mapper(&config)?;
    let metrics = go_on(job, mapper, &folder, 0, context)?;
    let verified = if job.args.verify { Some(run_again(job, &config, &folder, &metrics, context)?) } else { None };
    if context.json {
        context.print_json(&metrics)?;
    } else {
        context.sum_up(&summary::text(&job.name, &folder, &metrics, job.args.seed, verified.as_deref()))?;
    }
    gate::check(&job.args.fail_on, &metrics)
}

fn new_mapper(config: &Config) -> Result<Mapper, Failure> {
    Mapper::new(config.clone()).map_err(rejected)
}

/// Goes on with a map and fills the run folder; `known` entries of the log are in the map already.
pub(crate) fn go_on(
    job: &Job,
    mut mapper: Mapper,
    folder: &RunFolder,
    known: usize,
    context: &Context,
) -> Result<Metrics, Failure> {
    let started = Instant::now();
    context::catch_interrupts();
    let mut record = RunRecord::begin(job.args.seed, job.inputs);
    let live = job.args.live.start(context)?;
    mapping::look_ahead(&mut mapper, job)?;
    let mut log = (job.open)()?;
    let part = Part { known, from: job.args.from, until: job.args.until };
    let path = folder.path().to_owned();
    let mut save = |mapper: &Mapper| {
        record.entries = mapper.tally().entries;
        output::checkpoint(&path, mapper)?;
        record.write(&path)
    };
    let fed = mapping::feed(&mut mapper, &mut log, (part, job.args.checkpoint), live, context, &mut save)?;
    if fed.interrupted {
        save(&mapper)?;
        let message = format!("interrupted after {} places; the map so far is kept", mapper.topology().n_visited());
        return Err(Failure::new(Exit::Interrupted, "interrupted", message)
            .help(format!("resume with: topogrid resume {}", path.display())));
    }
    warn_of_skipped(log.reports(), context);
    let skipped: u64 = log.reports().map(|report| report.skipped_lines()).sum();
    let fed = Fed { skipped: usize::try_from(skipped).unwrap_or(usize::MAX), ..fed };
    conclude(mapper, &fed, folder, (record, started), context)
}

/// Fills a run folder with all that follows from a map that is whole.
pub(crate) fn conclude(
    mapper: Mapper,
    fed: &Fed,
    folder: &RunFolder,
    (mut record, started): (RunRecord, Instant),
    context: &Context,
) -> Result<Metrics, Failure> {
    record.entries = mapper.tally().entries;
    let mut finished = finish(mapper, fed, folder, context)?;
    let stage = context.progress().stage("writing", 0);
    write(folder, &mut finished, started)?;
    stage.finish(&format!("{} files", folder.size().0));
    (record.complete, record.warnings) = (true, context.warnings());
    record.seconds = started.elapsed().as_secs_f64();
    record.write(folder.path())?;
    Ok(finished.metrics)
}

/// Applies what was edited, and draws. The session that is kept is the map as it was recorded, without the edits.
fn finish(mut mapper: Mapper, fed: &Fed, folder: &RunFolder, context: &Context) -> Result<Finished, Failure> {
    let spent = [mapper.spent_recognizing(), mapper.coordinates().spent()].map(|spent| spent.as_secs_f64());
    let edits = edits::read(folder.path())?;
    let config = mapper.config().clone();
    if !edits.list.is_empty() {
        output::write_session(folder, &mapper)?;
        edits::apply(folder.path(), &mut mapper)?;
    }
    let mut finished = Finished::draw(mapper, context)?;
    if edits.list.is_empty() {
        output::write_session(folder, &finished.mapper)?; // with the regions that were found
    }
    output::write_config(folder, &config)?;
    finished.metrics.truth = fed.truth.judge(&finished.mapper);
    finished.metrics.log.skipped = fed.skipped;
    let timings = &mut finished.metrics.timings_s;
    [timings.recognize, timings.relax] = spent;
    (timings.read, timings.local) = (fed.reading_s, (fed.mapping_s - spent[0] - spent[1]).max(0.0));
    Ok(finished)
}

/// Writes all that follows from the map; the figures come last, since they hold how long it took, the page included.
fn write(folder: &RunFolder, finished: &mut Finished, started: Instant) -> Result<(), Failure> {
    let (writing, name) = (Instant::now(), session::name(folder.path()));
    output::write(folder, &name, finished)?;
    let page = report::draw(&name, finished)?;
    finished.metrics.timings_s.write = writing.elapsed().as_secs_f64();
    finished.metrics.timings_s.total = started.elapsed().as_secs_f64();
    finished.metrics.peak_memory_mib = memory::peak_mib();
    output::write_metrics(folder, &finished.metrics)?;
    output::write_report(folder, page, &finished.metrics)
}

/// Maps the log a second time, beside the first, and compares; the times are those of the first run.
fn run_again(
    job: &Job,
    config: &Config,
    first: &RunFolder,
    metrics: &Metrics,
    context: &Context,
) -> Result<String, Failure> {
    let silent = context.silent();
    let stage = context.progress().stage("verifying", 0);
    let beside = tempfile::Builder::new().prefix(".verify-").tempdir_in(first.path());
    let beside = beside.map_err(|error| Failure::writing(first.path(), &error))?;
    let folder = RunFolder::existing(beside.path());
    let mut mapper = new_mapper(config)?;
    mapping::look_ahead(&mut mapper, job)?;
    let mut log = (job.open)()?;
    let part = Part { known: 0, from: job.args.from, until: job.args.until };
    let fed = mapping::feed(&mut mapper, &mut log, (part, 0), None, &silent, |_| Ok(()))?;
    let fed = Fed { skipped: metrics.log.skipped, ..fed };
    let mut finished = finish(mapper, &fed, &folder, &silent)?;
    finished.metrics.timings_s = metrics.timings_s.clone();
    finished.metrics.peak_memory_mib = metrics.peak_memory_mib;
    output::write(&folder, &session::name(first.path()), &finished)?;
    output::write_metrics(&folder, &finished.metrics)?;
    output::write_report(&folder, report::draw(&session::name(first.path()), &finished)?, &finished.metrics)?;
    let verdict = verify::compare(first.path(), beside.path());
    stage.finish(verdict.as_deref().unwrap_or("not identical"));
    verdict
}

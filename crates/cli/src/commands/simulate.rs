use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use robot_log::{CarmenWriter, Entry, EntryKind};
use serde::Serialize;
use simulator::nalgebra::Point2;
use simulator::{Robot, RobotDescription, TourOptions, World};

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::run_folder::RunFolder;
use crate::run_folder::run_record::RunRecord;
use crate::{finished::summary, input::session};

mod explore;
mod frames;
mod waypoints;
pub(super) mod world;

use frames::Frames;

/// A world, a robot, a seed: a log with the truth in it
///
/// The robot explores the world until nothing new is left, or drives along given points.
///
/// Examples:
///   topogrid simulate office-46x12 --seed 7 -o office.log
///   topogrid simulate office-46x12 --seed 7 -o office.log --run runs/explored
#[derive(Debug, Args)]
#[command(verbatim_doc_comment, after_help = "Worlds that come along: office-46x12, office-loop, laboratory, flat")]
pub(crate) struct SimulateArgs {
    /// A plan (.toml), a map (.yaml; .map; .png or .pgm with --resolution), a world that comes along, or `random:SEED`
    #[arg(value_name = "WORLD")]
    world: String,
    /// The robot: a name (nomad200, nomad200-infrared, nomad200-perfect-compass, laser, perfect) or a description (.toml)
    #[arg(long, value_name = "ROBOT", default_value = "nomad200")]
    robot: String,
    /// Metres per pixel of a world that is an image
    #[arg(long, value_name = "M", value_parser = crate::input::positive)]
    resolution: Option<f64>,
    /// All that is random follows from it
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The log to write (CARMEN); `-` writes to standard output [default: WORLD-SEED.log]
    #[arg(short, long, value_name = "LOG")]
    out: Option<PathBuf>,
    /// Drive along the points of a file: `x y` per line, metres in the map frame
    #[arg(long, value_name = "FILE", conflicts_with = "tour")]
    waypoints: Option<PathBuf>,
    /// Drive along a tour of the world: the one of that name, or its first
    #[arg(long, value_name = "NAME", num_args = 0..=1)]
    tour: Option<Option<String>>,
    /// Metres between two stops of a tour, at which the sensors fire
    #[arg(long, value_name = "M", value_parser = crate::input::positive, default_value_t = 1.0)]
    stop_every: f64,
    /// How often the sensors fire at a stop of a tour, the turret a little further each time
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    firings: u16,
    /// End an exploration after so many seconds of the robot's clock; places that it still expects stay predicted
    #[arg(long, value_name = "S", value_parser = crate::input::positive, conflicts_with_all = ["tour", "waypoints"])]
    until: Option<f64>,
    /// Write pictures for an animation into this folder, one per stop or new place
    #[arg(long, value_name = "DIR")]
    frames: Option<PathBuf>,
    /// Keep the map that the robot makes while it explores: a run folder, with its report
    #[arg(long, value_name = "DIR", conflicts_with_all = ["tour", "waypoints"])]
    run: Option<PathBuf>,
    /// Replace files where they exist
    #[arg(long)]
    force: bool,
}

/// What was made, for programs.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    world: String,
    robot: String,
    seed: u64,
    log: String,
    entries: usize,
    scans: usize,
    readings: usize,
    path_length_m: f64,
    duration_s: f64,
    /// How often something was in the way.
    bumps: usize,
    /// By how much dead reckoning, aligned at the start, is wrong at the end.
    odometry_error_m: f64,
    frames: usize,
    /// Where the robot explored.
    #[serde(skip_serializing_if = "Option::is_none")]
    exploration: Option<explore::Explored>,
    /// The run folder that holds the robot's own map.
    #[serde(skip_serializing_if = "Option::is_none")]
    run: Option<String>,
}

/// Drives the robot through the world and writes its log.
pub(crate) fn run(args: &SimulateArgs, context: &Context) -> Result<(), Failure> {
    let world = world::load(&args.world, args.resolution)?;
    let description = robot(&args.robot)?;
    let points = args.points(&world)?;
    let mut robot = Robot::new(&world, description, args.seed)
        .map_err(|error| Failure::new(Exit::Rejected, "simulate.robot", error.to_string()))?;
    let start = robot.map_from_robot();
    let folder = args.run.as_ref().map(|path| RunFolder::choose(Some(path), "", args.force)).transpose()?;
    let begun = (RunRecord::begin(args.seed, &[]), Instant::now());
    let mut frames = args.frames.as_ref().map(|folder| Frames::new(folder, &world, args.force)).transpose()?;
    let (entries, explored) = match &points {
        Some(points) => (drive(args, &mut robot, points, frames.as_mut(), context)?, None),
        None => explore::explore(&mut robot, args.until, frames.as_mut(), context)
            .map(|(entries, mapper, how)| (entries, Some((mapper, how))))?,
    };
    let out = args.out();
    write_log(args, &out, &robot, &entries)?;
    let (mapper, exploration) = explored.unzip();
    let metrics = match (&folder, mapper) {
        (Some(folder), Some(mapper)) => Some(explore::keep(mapper, &entries, folder, begun, context)?),
        _ => None,
    };
    let scans = entries.iter().filter_map(|entry| match &entry.kind {
        EntryKind::Scan { scan, .. } => Some(scan.readings().len()),
        _ => None,
    });
    let believed = start * robot.odom_from_robot();
    let report = Report {
        schema: "topogrid/simulate/1",
        world: world.name().to_owned(),
        robot: robot.description().name.clone(),
        seed: args.seed,
        log: out.display().to_string(),
        entries: entries.len(),
        scans: scans.clone().count(),
        readings: scans.sum(),
        path_length_m: robot.path_length(),
        duration_s: robot.time(),
        bumps: robot.bumps(),
        odometry_error_m: (believed.translation.vector - robot.map_from_robot().translation.vector).norm(),
        frames: frames.map_or(0, |frames| frames.count()),
        exploration,
        run: folder.as_ref().map(|folder| folder.path().display().to_string()),
    };
    report.tell(context)?;
    if let (Some(folder), Some(metrics), false) = (&folder, &metrics, context.json) {
        context.sum_up(&summary::text(&session::name(folder.path()), folder, metrics, args.seed, None))?;
    }
    match report.exploration {
        Some(explored) if !explored.complete => {
            Err(Failure::new(Exit::Interrupted, "interrupted", "the exploration was stopped; its log so far is kept"))
        }
        _ => Ok(()),
    }
}

impl SimulateArgs {
    fn out(&self) -> PathBuf {
        self.out.clone().unwrap_or_else(|| {
            let stem = Path::new(&self.world).file_stem().unwrap_or_default().to_string_lossy().replace(':', "-");
            PathBuf::from(format!("{stem}-{}.log", self.seed))
        })
    }

    /// The points to drive along; none to explore.
    fn points(&self, world: &World) -> Result<Option<Vec<Point2<f64>>>, Failure> {
        if let Some(path) = &self.waypoints {
            return waypoints::read(path).map(Some);
        }
        let Some(wanted) = &self.tour else { return Ok(None) };
        let tours = world.tours();
        let tour = match wanted {
            Some(name) => tours.iter().find(|tour| tour.name == *name),
            None => tours.first(),
        };
        tour.map(|tour| Some(tour.points.clone())).ok_or_else(|| {
            let names: Vec<String> = tours.iter().map(|tour| format!("`{}`", tour.name)).collect();
            let has =
                if names.is_empty() { "has no tour".to_owned() } else { format!("has the tours {}", names.join(", ")) };
            let wanted = wanted.as_ref().map(|name| format!(", none called `{name}`")).unwrap_or_default();
            Failure::new(Exit::Usage, "simulate.tour", format!("the world `{}` {has}{wanted}", world.name()))
                .help("give the points to drive along with --waypoints FILE")
        })
    }
}

/// The robot of that name, or described in that file.
pub(super) fn robot(name: &str) -> Result<RobotDescription, Failure> {
    if let Some(robot) = RobotDescription::named(name) {
        return Ok(robot);
    }
    let path = Path::new(name);
    if path.extension().is_none() {
        let message = format!("there is no robot called `{name}`");
        return Err(Failure::new(Exit::Usage, "simulate.robot", message)
            .help(format!("name one of {}, or a description (.toml)", RobotDescription::NAMES.join(", "))));
    }
    let text = world::read_text(path)?;
    RobotDescription::from_toml(&text).map_err(|error| Failure::rejected(path, "simulate.robot", &error))
}

fn drive(
    args: &SimulateArgs,
    robot: &mut Robot<'_>,
    points: &[Point2<f64>],
    mut frames: Option<&mut Frames>,
    context: &Context,
) -> Result<Vec<Entry>, Failure> {
    let start = Point2::from(robot.map_from_robot().translation.vector);
    let ends = std::iter::once(start).chain(points.iter().copied());
    let length: f64 = ends.zip(points).map(|(from, to)| (to - from).norm()).sum();
    let options = TourOptions { stop_every: args.stop_every, firings: args.firings.into(), ..TourOptions::default() };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a path in centimetres, for a bar")]
    let steps = |metres: f64| (metres * 100.0) as u64;
    let stage = context.progress().stage("driving", steps(length).max(1));
    let (mut entries, mut failure) = (Vec::new(), None);
    let outcome = robot.drive_tour(points, &options, |robot, mut log| {
        if let Some(frames) = frames.as_deref_mut()
            && failure.is_none()
        {
            failure = frames.add(robot, &log).err();
        }
        entries.append(&mut log);
        stage.at(steps(robot.path_length()), || format!("{:.0} of {length:.0} m", robot.path_length()));
    });
    outcome.map_err(|error| {
        Failure::new(Exit::Rejected, "simulate.blocked", format!("the tour cannot be driven: {error}"))
            .help("waypoints are joined by straight lines, on which the robot must fit")
    })?;
    stage.finish(&format!("{:.1} m, {} entries", robot.path_length(), entries.len()));
    failure.map_or(Ok(entries), Err)
}

fn write_log(args: &SimulateArgs, out: &Path, robot: &Robot<'_>, entries: &[Entry]) -> Result<(), Failure> {
    let content = |out: &mut dyn io::Write| {
        let mut writer = CarmenWriter::new(out);
        let (world, robot) = (robot.world().name(), &robot.description().name);
        writer.comment(&format!("A simulated {robot} in the world `{world}`, seed {}.", args.seed))?;
        entries.iter().try_for_each(|entry| writer.write(entry))
    };
    if out.as_os_str() == "-" {
        content(&mut io::stdout().lock()).map_err(Failure::stdout)
    } else {
        files::write(out, args.force, content).map_err(|error| Failure::writing(out, &error))
    }
}

impl Report {
    fn tell(&self, context: &Context) -> Result<(), Failure> {
        if self.log == "-" {
            return Ok(()); // standard output holds the log
        }
        if context.json {
            return context.print_json(self);
        }
        let mut text = format!(
            "{}: {} scans, {} readings, {:.0} m in {:.0} s; dead reckoning ends {:.1} m off\n",
            self.log, self.scans, self.readings, self.path_length_m, self.duration_s, self.odometry_error_m
        );
        if let Some(explored) = &self.exploration {
            let explore::Explored { places, predicted_places, links, coverage, .. } = explored;
            text += &format!(
                "{places} places, {predicted_places} still predicted, {links} links, {:.1} % of the floor covered\n",
                100.0 * coverage
            );
        }
        if self.frames > 0 {
            text += &format!("{} pictures\n", self.frames);
        }
        let next = if self.run.is_some() { "\n".to_owned() } else { format!("next: topogrid run {}\n", self.log) };
        context.print(&(text + &next))
    }
}

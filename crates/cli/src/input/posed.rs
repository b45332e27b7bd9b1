mod trajectory;

use std::path::{Path, PathBuf};

use clap::Args;
use global_grid::{Calculus, GridMap, GridOptions};
use hierarchy::SonarDrawing;
use local_grid::{Scan, SensorKind};
use nalgebra::Isometry2;
use robot_log::EntryKind;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::input::session;
use crate::input::{ReadingArgs, warn_of_skipped};
use trajectory::Trajectory;

/// Scans whose poses are known, and how they become a gridmap.
#[derive(Debug, Args)]
pub(crate) struct PosedArgs {
    /// A run (its folder, or its session.hmap), or a log whose poses are known: CARMEN or CSV, plain or gzip; several files
    /// are merged by stamp; `-` reads standard input
    #[arg(value_name = "RUN|LOG", required = true)]
    pub(crate) sources: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    /// Where the robot was: a trajectory in TUM's form, `known` for the poses of the run or beside the scans of the log, or
    /// `truth` for the log's true poses
    #[arg(long, value_name = "FILE.tum|known|truth", default_value = "known")]
    poses: String,
    /// Which sensors' readings count
    #[arg(long, value_name = "KIND", default_value = "all")]
    pub(crate) sensor: SensorChoice,
    /// By which model sonar readings are drawn [default: that of the run; shared for a log]
    #[arg(long, value_name = "MODEL")]
    sonar: Option<SonarChoice>,
    /// Metres per cell [default: those of the run; 0.1 for a log]
    #[arg(long, value_name = "M")]
    resolution: Option<f64>,
    /// Farthest reading that is drawn, in metres: echoes from beyond leave emptiness up to there
    #[arg(long, value_name = "M", value_parser = crate::input::positive)]
    range_max: Option<f64>,
}

/// By which model sonar readings are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum SonarChoice {
    /// A flat cone whose echo is shared out by what all readings say
    Shared,
    /// The paper's cone, which trusts near readings only
    Oriolo,
    /// Murphy's regions of the cone
    Murphy,
}

impl SonarChoice {
    fn drawing(self) -> SonarDrawing {
        match self {
            Self::Shared => SonarDrawing::Shared,
            Self::Oriolo => SonarDrawing::Oriolo,
            Self::Murphy => SonarDrawing::Murphy,
        }
    }
}

/// Which sensors' readings count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum SensorChoice {
    All,
    Sonar,
    Laser,
}

impl SensorChoice {
    /// Whether a scan's readings count.
    pub(crate) fn takes(self, scan: &Scan) -> bool {
        match self {
            Self::All => true,
            Self::Sonar => scan.sensor().kind() == SensorKind::Sonar,
            Self::Laser => scan.sensor().kind() != SensorKind::Sonar,
        }
    }
}

/// By which rule readings are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum CalculusChoice {
    Fuzzy,
    Bayes,
    DempsterShafer,
}

impl CalculusChoice {
    /// All of them, in the order of tables.
    pub(crate) const ALL: [Self; 3] = [Self::Fuzzy, Self::Bayes, Self::DempsterShafer];

    /// The calculus.
    pub(crate) fn calculus(self) -> Calculus {
        match self {
            Self::Fuzzy => Calculus::Fuzzy,
            Self::Bayes => Calculus::Bayes,
            Self::DempsterShafer => Calculus::DempsterShafer,
        }
    }

    /// Its name, as on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Fuzzy => "fuzzy",
            Self::Bayes => "bayes",
            Self::DempsterShafer => "dempster-shafer",
        }
    }
}

/// Scans at their poses.
pub(crate) struct Posed {
    pub(crate) scans: Vec<(Isometry2<f64>, Scan)>,
    /// Scans taken before or after the time of which poses are known.
    pub(crate) left_out: usize,
    /// How the gridmap is built, but for the calculus.
    options: GridOptions,
}

impl Posed {
    /// How a map by a calculus is built.
    pub(crate) fn options(&self, calculus: Calculus) -> GridOptions {
        GridOptions { calculus, ..self.options.clone() }
    }
}

/// Scans with their stamps, and the poses beside them where there are any.
type Stamped = Vec<(f64, Option<Isometry2<f64>>, Scan)>;

impl PosedArgs {
    /// The run that is named, if it is one.
    pub(crate) fn run(&self) -> Option<&Path> {
        let is_run = |path: &&PathBuf| path.is_dir() || path.extension().is_some_and(|ending| ending == "hmap");
        self.sources.iter().find(is_run).map(PathBuf::as_path)
    }

    /// Reads the run or the log and finds the pose of every scan.
    pub(crate) fn read(&self, context: &Context) -> Result<Posed, Failure> {
        let mut trajectory = match self.poses.as_str() {
            "known" | "truth" => Trajectory::default(),
            file => Trajectory::read(Path::new(file), &mut files::open(&PathBuf::from(file))?)?,
        };
        let (scans, options) = match self.run() {
            Some(run) => self.recorded(run)?,
            None => (self.logged(&mut trajectory, context)?, GridOptions::default()),
        };
        let n_scans = scans.len();
        let place = |(stamp, known, scan): (f64, Option<Isometry2<f64>>, Scan)| {
            Some((known.or_else(|| trajectory.at(stamp))?, scan))
        };
        let scans: Vec<_> = scans.into_iter().filter_map(place).collect();
        let left_out = n_scans - scans.len();
        if scans.is_empty() {
            let message = format!("none of the log's {n_scans} scans has a pose in {}", self.poses);
            return Err(Failure::new(Exit::Rejected, "grid.poses", message)
                .help("topogrid inspect LOG tells what the log holds; stamps of both must overlap"));
        }
        if left_out > 0 {
            context.warn(&format!("left out {left_out} scans from before or after the known poses"));
        }
        Ok(Posed { scans, left_out, options: self.changed(options) })
    }

    /// The scans of a run, and how its gridmap is built.
    fn recorded(&self, run: &Path) -> Result<(Stamped, GridOptions), Failure> {
        if self.sources.len() > 1 || self.poses == "truth" {
            let what = if self.poses == "truth" { "keeps no true poses" } else { "stands for itself" };
            let message = format!("the run {} {what}", run.display());
            return Err(Failure::new(Exit::Usage, "grid.run", message).help("name one run, or the files of one log"));
        }
        let mapper = session::load(run)?;
        let known = |pose| (self.poses == "known").then_some(pose);
        let samples = mapper.trajectory().samples().iter().zip(mapper.poses());
        let scans = samples.map(|(sample, pose)| (sample.stamp, known(pose), sample.scan.clone())).collect();
        Ok((scans, mapper.config().grid.options()))
    }

    /// The scans of a log; poses that stand by themselves go into the trajectory.
    fn logged(&self, trajectory: &mut Trajectory, context: &Context) -> Result<Stamped, Failure> {
        let mut log = crate::input::open(&self.sources, &self.reading)?;
        let stage = context.progress().reading("reading", log.size());
        let mut scans = Vec::new();
        while let Some(entry) = log.next() {
            let entry = entry?;
            if scans.len() % 1000 == 999 {
                stage.at(log.taken(), || format!("{} scans", scans.len()));
            }
            match entry.kind {
                EntryKind::Truth { map_from_robot } if self.poses == "truth" => {
                    trajectory.push(entry.stamp, map_from_robot);
                }
                EntryKind::Odometry { odom_from_robot } if self.poses == "known" => {
                    trajectory.push(entry.stamp, odom_from_robot);
                }
                EntryKind::Scan { odom_from_robot, scan } => {
                    let known = odom_from_robot.filter(|_| self.poses == "known");
                    scans.push((entry.stamp, known, scan));
                }
                _ => {}
            }
        }
        stage.finish(&format!("{} scans", scans.len()));
        warn_of_skipped(log.reports(), context);
        Ok(scans)
    }

    /// Options with what the arguments change of them.
    fn changed(&self, mut options: GridOptions) -> GridOptions {
        if let Some(resolution) = self.resolution {
            options.resolution = resolution;
        }
        if let Some(sonar) = self.sonar {
            options.sonar = sonar.drawing().model();
        }
        self.range_max.map_or(options.clone(), |range| options.within_range(range))
    }
}

/// Fuses the scans that a choice of sensors takes.
pub(crate) fn fuse(posed: &Posed, sensor: SensorChoice, options: &GridOptions) -> Result<GridMap, Failure> {
    let chosen = posed.scans.iter().filter(|(_, scan)| sensor.takes(scan));
    let map = global_grid::assemble(chosen.map(|(pose, scan)| (pose, scan)), options);
    map.map_err(|error| {
        Failure::new(Exit::Rejected, "grid", format!("could not build the map: {error}")).because_of(&error)
    })
}

/// A gridmap's failure to become a dense grid.
pub(crate) fn no_grid(error: &global_grid::GridError) -> Failure {
    Failure::new(Exit::Rejected, "grid.empty", format!("could not draw the map: {error}")).because_of(error)
}

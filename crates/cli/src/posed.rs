mod trajectory;

use std::path::{Path, PathBuf};

use clap::Args;
use global_grid::{Calculus, GridMap, GridOptions};
use local_grid::{Scan, SensorKind};
use nalgebra::Isometry2;
use robot_log::EntryKind;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::input::{LogArgs, warn_of_skipped};
use trajectory::Trajectory;

/// A log whose poses are known, and how its readings become a gridmap.
#[derive(Debug, Args)]
pub(crate) struct PosedArgs {
    #[command(flatten)]
    pub(crate) log: LogArgs,
    /// Where the robot was: a trajectory in TUM's form, `known` for the poses beside the scans of the log, or `truth`
    /// for the log's true poses
    #[arg(long, value_name = "FILE.tum|known|truth", default_value = "known")]
    poses: String,
    /// Which sensors' readings count
    #[arg(long, value_name = "KIND", default_value = "all")]
    pub(crate) sensor: SensorChoice,
    /// Metres per cell
    #[arg(long, value_name = "M", default_value_t = 0.1)]
    pub(crate) resolution: f64,
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
}

impl PosedArgs {
    /// Reads the log and finds the pose of every scan.
    pub(crate) fn read(&self, context: &Context) -> Result<Posed, Failure> {
        let mut trajectory = match self.poses.as_str() {
            "known" | "truth" => Trajectory::default(),
            file => Trajectory::read(Path::new(file), &mut files::open(&PathBuf::from(file))?)?,
        };
        let mut log = self.log.open()?;
        let stage = context.progress().stage("reading", 0);
        let mut scans = Vec::new();
        for entry in log.by_ref() {
            let entry = entry?;
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
        Ok(Posed { scans, left_out })
    }

    /// How a map by a calculus is built.
    pub(crate) fn options(&self, calculus: Calculus) -> GridOptions {
        GridOptions { resolution: self.resolution, calculus, ..GridOptions::default() }
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

use std::path::{Path, PathBuf};

use global_grid::map_server::{MapMetadata, read_image};
use global_grid::{Calculus, CrispOptions, Occupancy, occupancy};
use hierarchy::Mapper;
use hierarchy::evaluate::{TimedPath, known_entropy, odometry_map, odometry_map_by};
use hierarchy::local_grid::Grid;
use nalgebra::Isometry2;
use robot_log::EntryKind;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::input::session;
use crate::input::{self, ReadingArgs};

/// A map in its own frame, and where that lies.
pub(super) type PlacedMap = (Grid<Occupancy>, Isometry2<f64>);

/// What is judged.
#[derive(Debug)]
pub(super) struct Subject {
    pub(super) path: TimedPath,
    pub(super) odometry: Option<TimedPath>,
    pub(super) map: Option<PlacedMap>,
    /// The run itself, where its session is at hand.
    pub(super) run: Option<Mapper>,
}

impl Subject {
    /// Reads a run folder, a trajectory or a log.
    pub(super) fn read(path: &Path, odometry: Option<&Path>, reading: &ReadingArgs) -> Result<Self, Failure> {
        let odometry = odometry.map(|path| read_path(path, reading, false)).transpose()?;
        if !path.is_dir() {
            return Ok(Self { path: read_path(path, reading, false)?, odometry, map: None, run: None });
        }
        let file = |name: &str| Some(path.join(name)).filter(|file| file.exists());
        let trajectory = trajectory_of(path)?;
        let beside = || file("odometry.tum").map(|file| read_path(&file, reading, false)).transpose();
        let odometry = odometry.map_or_else(beside, |odometry| Ok(Some(odometry)))?;
        let map = file("map.yaml").map(|file| read_map(&file)).transpose()?;
        let run = file("session.hmap").map(|_| session::load(path)); // with its edits, as its trajectory and map are
        Ok(Self { path: read_path(&trajectory, reading, false)?, odometry, map, run: run.transpose()? })
    }

    /// The map that the run's scans make along its raw odometry; `None` where that cannot be drawn.
    pub(super) fn odometry_map(&self) -> Option<PlacedMap> {
        let grid = odometry_map(self.run.as_ref()?).ok()?;
        Some((occupancy(&grid, &CrispOptions::for_map(&grid)), Isometry2::identity()))
    }

    /// Mean entropy in bits of the known cells of the run's map, and of that along its raw odometry, both by Bayes' rule.
    pub(super) fn entropies(&self) -> [Option<f64>; 2] {
        let Some(run) = &self.run else { return [None; 2] };
        let mapped = run.gridmap_by(Calculus::Bayes).ok();
        [mapped, odometry_map_by(run, Calculus::Bayes).ok()].map(|map| known_entropy(&map?))
    }
}

/// The trajectory in a run folder.
fn trajectory_of(folder: &Path) -> Result<PathBuf, Failure> {
    let file = folder.join("trajectory.tum");
    if file.exists() {
        return Ok(file);
    }
    let message = format!("{} is no run folder: there is no trajectory.tum in it", folder.display());
    Err(Failure::new(Exit::Rejected, "evaluate.folder", message))
}

/// Whether the name is that of a map's description.
pub(super) fn is_map(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "yaml" || extension == "yml")
}

/// The path in a run folder, a trajectory file or a log; of a log the odometry, or with `truth` its true poses where it has some.
pub(super) fn read_path(path: &Path, reading: &ReadingArgs, truth: bool) -> Result<TimedPath, Failure> {
    if path.is_dir() {
        return read_path(&trajectory_of(path)?, reading, truth);
    }
    if path.extension().is_some_and(|extension| extension == "tum") {
        return TimedPath::read_tum(files::open(path)?)
            .map_err(|error| Failure::rejected(path, "trajectory.parse", &error));
    }
    let (mut odometry, mut true_poses) = (Vec::new(), Vec::new());
    for entry in input::open(&[PathBuf::from(path)], reading)? {
        let entry = entry?;
        match entry.kind {
            EntryKind::Odometry { odom_from_robot } => odometry.push((entry.stamp, odom_from_robot)),
            EntryKind::Scan { odom_from_robot: Some(pose), .. } => odometry.push((entry.stamp, pose)),
            EntryKind::Truth { map_from_robot } => true_poses.push((entry.stamp, map_from_robot)),
            _ => {}
        }
    }
    let poses = if truth && !true_poses.is_empty() { true_poses } else { odometry };
    if poses.is_empty() {
        let message = format!("{} holds no poses to compare", path.display());
        return Err(Failure::new(Exit::Rejected, "evaluate.poses", message));
    }
    Ok(TimedPath::new(poses))
}

/// The map that `path` describes.
pub(super) fn read_map(path: &Path) -> Result<PlacedMap, Failure> {
    let metadata =
        MapMetadata::read(files::open(path)?).map_err(|error| Failure::rejected(path, "map.description", &error))?;
    let image = path.parent().unwrap_or(Path::new(".")).join(&metadata.image);
    let read =
        read_image(&metadata, files::open(&image)?).map_err(|error| Failure::rejected(&image, "map.image", &error))?;
    Ok((read.occupancy(), read.map_from_grid))
}

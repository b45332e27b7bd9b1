use std::path::{Path, PathBuf};

use robot_log::{Entry, EntryKind};
use simulator::nalgebra::{Isometry2, Point2};
use simulator::{Picture, Robot, World};

use crate::failure::Failure;
use crate::files;

/// The longer edge of a frame in dots.
const EDGE: f64 = 1200.0;

/// Pictures of a drive, one per stop: the building, the echoes so far, the way, and the way as odometry believes it.
pub(super) struct Frames {
    folder: PathBuf,
    force: bool,
    count: usize,
    /// All that was drawn so far, without the building and the robot.
    trail: Picture,
    map_from_start: Isometry2<f64>,
    map_from_robot: Option<Isometry2<f64>>,
}

impl Frames {
    pub(super) fn new(folder: &Path, world: &World, force: bool) -> Result<Self, Failure> {
        std::fs::create_dir_all(folder).map_err(|error| Failure::writing(folder, &error))?;
        let (low, high) = world.bounds();
        let trail = Picture::of(world, EDGE / (high - low).max().max(1e-3));
        let folder = folder.to_owned();
        Ok(Self { folder, force, count: 0, trail, map_from_start: Isometry2::identity(), map_from_robot: None })
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Draws what was recorded since the last frame, and writes the next one.
    pub(super) fn add(&mut self, robot: &Robot<'_>, log: &[Entry]) -> Result<(), Failure> {
        for entry in log {
            self.draw(entry);
        }
        let mut frame = self.trail.clone();
        frame.scene(&robot.world().at(robot.time()));
        frame.robot(&robot.map_from_robot(), robot.description().radius, [200, 0, 0]);
        self.count += 1;
        let path = self.folder.join(format!("frame-{:05}.png", self.count));
        files::write(&path, self.force, |out| out.write_all(&frame.png()))
            .map_err(|error| Failure::writing(&path, &error))
    }

    fn draw(&mut self, entry: &Entry) {
        match &entry.kind {
            EntryKind::Truth { map_from_robot } => {
                if self.map_from_robot.is_none() {
                    self.map_from_start = *map_from_robot;
                }
                self.map_from_robot = Some(*map_from_robot);
                self.trail.dot(Point2::from(map_from_robot.translation.vector), 1.0, [0, 150, 0]);
            }
            EntryKind::Odometry { odom_from_robot } if self.map_from_robot.is_some() => {
                let believed = self.map_from_start * odom_from_robot;
                self.trail.dot(Point2::from(believed.translation.vector), 1.0, [235, 150, 20]);
            }
            EntryKind::Scan { scan, .. } => {
                let Some(map_from_robot) = self.map_from_robot else { return };
                for echo in scan.echo_points() {
                    self.trail.dot(map_from_robot * Point2::from(echo), 0.8, [225, 110, 110]);
                }
            }
            _ => {}
        }
    }
}

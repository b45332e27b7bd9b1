//! A simulated robot that explores to the end.

use hierarchy::evaluate::TimedPath;
use hierarchy::{Ended, Errand, Exploration};
use robot_log::{Entry, EntryKind};
use simulator::{Command, Robot, RobotDescription, World};

/// What an exploration left behind.
pub(crate) struct Explored {
    /// All levels of its map.
    pub(crate) exploration: Exploration,
    /// The robot's log.
    pub(crate) entries: Vec<Entry>,
    /// Metres driven.
    pub(crate) driven: f64,
}

/// Lets a robot explore until nothing is left.
///
/// # Errors
///
/// A robot that cannot be in this world, or an entry that its own explorer refuses.
pub(crate) fn explore(
    world: &World,
    robot: &RobotDescription,
    seed: u64,
    mut exploration: Exploration,
) -> Result<Explored, Box<dyn std::error::Error>> {
    let mut robot = Robot::new(world, robot.clone(), seed)?;
    let (mut entries, mut ended) = (Vec::new(), Ended::Well);
    loop {
        let command = match exploration.next(ended)? {
            Errand::Turn { to } => Command::Turn { to },
            Errand::Drive { distance } => Command::Drive { distance },
            Errand::Look { to } => Command::Look { to },
            Errand::Fire => Command::Fire,
            Errand::Done => return Ok(Explored { exploration, entries, driven: robot.path_length() }),
        };
        let before = entries.len();
        ended = if robot.execute(&command, &mut entries).blocked { Ended::Blocked } else { Ended::Well };
        for entry in &entries[before..] {
            exploration.push(entry)?;
        }
    }
}

/// Where the robot truly was.
pub(crate) fn truth(entries: &[Entry]) -> TimedPath {
    TimedPath::new(entries.iter().filter_map(|entry| match entry.kind {
        EntryKind::Truth { map_from_robot } => Some((entry.stamp, map_from_robot)),
        _ => None,
    }))
}

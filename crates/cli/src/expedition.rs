use hierarchy::topo_map::{Change, ExplorerOptions};
use hierarchy::{Config, Ended, Errand, Exploration, ExplorationError};
use robot_log::Entry;
use simulator::{Command, Robot};

use crate::context;
use crate::exit::Exit;
use crate::failure::Failure;

/// A simulated robot that has explored a world: what it recorded, and what became of it.
#[derive(Debug)]
pub(crate) struct Expedition {
    /// The log, with the truth in it.
    pub(crate) entries: Vec<Entry>,
    pub(crate) exploration: Exploration,
    /// Whether it went on until nothing predicted was left, or as long as it should; otherwise the user stopped it.
    pub(crate) complete: bool,
}

/// What an expedition has come to whenever its map has changed.
pub(crate) struct Halt<'a, 'w> {
    pub(crate) robot: &'a Robot<'w>,
    pub(crate) exploration: &'a Exploration,
    pub(crate) entries: &'a [Entry],
    pub(crate) changes: &'a [Change],
}

/// Lets the robot explore until nothing predicted is left, until its clock shows so many seconds, or until the user stops
/// it; `watch` sees every change of the map.
pub(crate) fn explore(
    robot: &mut Robot<'_>,
    until: Option<f64>,
    mut watch: impl FnMut(&Halt<'_, '_>) -> Result<(), Failure>,
) -> Result<Expedition, Failure> {
    let mut exploration = Exploration::new(Config::default(), ExplorerOptions::default()).map_err(failed)?;
    let (mut entries, mut ended) = (Vec::new(), Ended::Well);
    loop {
        let errand = exploration.next(ended).map_err(failed)?;
        let changes = exploration.take_changes();
        if !changes.is_empty() {
            watch(&Halt { robot, exploration: &exploration, entries: &entries, changes: &changes })?;
        }
        let stopped = context::interrupted();
        let over = until.is_some_and(|until| robot.time() >= until);
        let Some(command) = command(errand).filter(|_| !stopped && !over) else {
            return Ok(Expedition { entries, exploration, complete: !stopped });
        };
        let before = entries.len();
        let outcome = robot.execute(&command, &mut entries);
        entries[before..].iter().try_for_each(|entry| exploration.push(entry)).map_err(failed)?;
        ended = if outcome.blocked { Ended::Blocked } else { Ended::Well };
    }
}

fn command(errand: Errand) -> Option<Command> {
    Some(match errand {
        Errand::Turn { to } => Command::Turn { to },
        Errand::Drive { distance } => Command::Drive { distance },
        Errand::Look { to } => Command::Look { to },
        Errand::Fire => Command::Fire,
        Errand::Done => return None,
    })
}

fn failed(error: ExplorationError) -> Failure {
    Failure::new(Exit::Failed, "explore.failed", format!("could not go on exploring: {error}")).because_of(&error)
}

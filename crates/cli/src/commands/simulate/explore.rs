use hierarchy::topo_map::{Change, ExplorerOptions};
use hierarchy::{Ended, Errand, Exploration, ExplorationError};
use robot_log::Entry;
use serde::Serialize;
use simulator::nalgebra::Point2;
use simulator::{Command, Robot};

use super::frames::Frames;
use crate::context::{self, Context};
use crate::exit::Exit;
use crate::failure::Failure;

/// How an exploration went.
#[derive(Debug, Serialize)]
pub(super) struct Explored {
    pub(super) places: usize,
    pub(super) predicted_places: usize,
    pub(super) links: usize,
    /// The share of the reachable floor within a metre of a place.
    pub(super) coverage: f64,
    /// Whether nothing predicted was left; otherwise the user stopped it.
    pub(super) complete: bool,
}

/// Lets the robot explore until nothing predicted is left, or until the user stops it.
pub(super) fn explore(
    robot: &mut Robot<'_>,
    mut frames: Option<&mut Frames>,
    context: &Context,
) -> Result<(Vec<Entry>, Explored), Failure> {
    context::catch_interrupts();
    let mut exploration = Exploration::new(ExplorerOptions::default()).map_err(failed)?;
    let stage = context.progress().stage("exploring", 0);
    let (mut entries, mut framed) = (Vec::new(), 0);
    let mut report = Live { visited: Vec::new(), coverage: 0.0 };
    let mut ended = Ended::Well;
    loop {
        let errand = exploration.next(ended).map_err(failed)?;
        if report.follow(robot, &exploration.take_changes()) {
            stage.at(report.visited.len() as u64, || report.line(&exploration));
            if let Some(frames) = frames.as_deref_mut() {
                frames.add(robot, &entries[framed..])?;
                framed = entries.len();
            }
        }
        let stopped = context::interrupted();
        let Some(command) = command(errand).filter(|_| !stopped) else {
            let map = exploration.map();
            let explored = Explored {
                places: map.n_visited(),
                predicted_places: map.n_predicted(),
                links: passable(&exploration),
                coverage: report.covered(robot),
                complete: !stopped,
            };
            stage.finish(&report.line(&exploration));
            return Ok((entries, explored));
        };
        let before = entries.len();
        let outcome = robot.execute(&command, &mut entries);
        entries[before..].iter().try_for_each(|entry| exploration.push(entry)).map_err(failed)?;
        ended = if outcome.blocked { Ended::Blocked } else { Ended::Well };
    }
}

/// What the user sees while the robot explores.
struct Live {
    /// Where the robot really was when it came to a new place.
    visited: Vec<Point2<f64>>,
    coverage: f64,
}

impl Live {
    /// Notes new places; true if there was one.
    fn follow(&mut self, robot: &Robot<'_>, changes: &[Change]) -> bool {
        let count = changes.iter().filter(|change| matches!(change, Change::PlaceVisited(_))).count();
        let here = Point2::from(robot.map_from_robot().translation.vector);
        self.visited.extend(std::iter::repeat_n(here, count));
        if count > 0 && self.visited.len().is_multiple_of(10) {
            self.coverage = self.covered(robot);
        }
        count > 0
    }

    fn covered(&self, robot: &Robot<'_>) -> f64 {
        let description = robot.description();
        robot.world().coverage(&self.visited, description.radius + description.margin, 1.0)
    }

    fn line(&self, exploration: &Exploration) -> String {
        let map = exploration.map();
        let (places, predicted, links) = (map.n_visited(), map.n_predicted(), passable(exploration));
        format!("{places} places, {predicted} predicted, {links} links, coverage {:.0} %", 100.0 * self.coverage)
    }
}

fn passable(exploration: &Exploration) -> usize {
    exploration.map().links().iter().filter(|link| link.is_measured() && link.is_passable()).count()
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
    Failure::new(Exit::Failed, "simulate.explore", format!("could not go on exploring: {error}")).because_of(&error)
}

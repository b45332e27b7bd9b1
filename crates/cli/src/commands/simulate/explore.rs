use std::time::Instant;

use hierarchy::topo_map::Change;
use hierarchy::{Exploration, Mapper, Metrics};
use robot_log::{Entry, EntryKind};
use serde::Serialize;
use simulator::Robot;
use simulator::nalgebra::Point2;

use super::frames::Frames;
use crate::commands::run;
use crate::context::{self, Context};
use crate::expedition;
use crate::failure::Failure;
use crate::mapping::Fed;
use crate::run_folder::RunFolder;
use crate::run_folder::run_record::RunRecord;

/// How an exploration went.
#[derive(Debug, Serialize)]
pub(super) struct Explored {
    pub(super) places: usize,
    pub(super) predicted_places: usize,
    pub(super) links: usize,
    /// The share of the reachable floor within a metre of a place.
    pub(super) coverage: f64,
    /// Whether it went on until nothing predicted was left, or as long as it was to; otherwise the user stopped it.
    pub(super) complete: bool,
}

/// Lets the robot explore until nothing predicted is left, `until` its clock shows so many seconds, or until the user stops it.
pub(super) fn explore(
    robot: &mut Robot<'_>,
    until: Option<f64>,
    mut frames: Option<&mut Frames>,
    context: &Context,
) -> Result<(Vec<Entry>, Mapper, Explored), Failure> {
    context::catch_interrupts();
    let stage = context.progress().stage("exploring", 0);
    let mut framed = 0;
    let mut live = Live { visited: Vec::new(), coverage: 0.0 };
    let expedition = expedition::explore(robot, until, |halt| {
        if !live.follow(halt.robot, halt.changes) {
            return Ok(());
        }
        stage.at(live.visited.len() as u64, || live.line(halt.exploration));
        let new = framed..halt.entries.len();
        framed = new.end;
        frames.as_deref_mut().map_or(Ok(()), |frames| frames.add(halt.robot, &halt.entries[new]))
    })?;
    live.coverage = live.covered(robot);
    stage.finish(&live.line(&expedition.exploration));
    let map = expedition.exploration.mapper().topology();
    let explored = Explored {
        places: map.n_visited(),
        predicted_places: map.n_predicted(),
        links: passable(&expedition.exploration),
        coverage: live.coverage,
        complete: expedition.complete,
    };
    Ok((expedition.entries, expedition.exploration.into_mapper(), explored))
}

/// Fills a run folder with the map that the robot made for itself: with the places that it expected, and what became of them.
pub(super) fn keep(
    mapper: Mapper,
    entries: &[Entry],
    folder: &RunFolder,
    begun: (RunRecord, Instant),
    context: &Context,
) -> Result<Metrics, Failure> {
    let mut fed = Fed { mapping_s: begun.1.elapsed().as_secs_f64(), ..Fed::default() };
    for entry in entries {
        if let EntryKind::Truth { map_from_robot } = entry.kind {
            fed.truth.push(entry.stamp, map_from_robot);
        }
    }
    run::conclude(mapper, &fed, folder, begun, context)
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
        let map = exploration.mapper().topology();
        let (places, predicted, links) = (map.n_visited(), map.n_predicted(), passable(exploration));
        format!("{places} places, {predicted} predicted, {links} links, coverage {:.0} %", 100.0 * self.coverage)
    }
}

fn passable(exploration: &Exploration) -> usize {
    let links = exploration.mapper().topology().links();
    links.iter().filter(|link| link.is_measured() && link.is_passable()).count()
}

//! A mapper whose robot is carried.

mod afterwards;
mod watch;

use nalgebra::{Isometry2, Matrix2};
use robot_log::local_grid::SensorKind;
use topo_map::{Displacement, Link, LinkId, LinkOrigin, PlaceId, Turn};

use super::{Mapper, MapperError};
use crate::event::{CarriedBy, Event};
use crate::recognize::Closure;
use crate::trajectory::{Anchor, Sample};
pub(super) use watch::CarryWatch;

impl Mapper {
    /// Looks whether the robot was carried shortly before the last sample. If so the map goes on at a place of its own, which
    /// only recognition can join to the rest.
    pub(super) fn notice_carrying(&mut self) -> Result<Vec<Event>, MapperError> {
        let samples = self.trajectory.samples();
        let Some(sample) = samples.last().filter(|sample| self.would_show_carrying(sample)) else {
            return Ok(Vec::new());
        };
        let contradicted = self.front_end.tracker.contradicted();
        match self.watch.see(samples.len() - 1, sample, contradicted) {
            Some(first) => self.go_on_elsewhere(first),
            None => Ok(Vec::new()),
        }
    }

    /// Whether the last scans look rather as if the robot had been carried just now.
    pub(crate) fn may_be_carried(&self) -> bool {
        self.watch.is_in_doubt()
    }

    /// Looks again at the last samples that a session holds; what a compass said then is gone.
    pub(super) fn watch_again(&mut self) {
        let samples = self.trajectory.samples();
        let begin = samples.len().saturating_sub(2 * CarryWatch::SIDE).max(self.set_down.unwrap_or(0));
        for (number, sample) in samples.iter().enumerate().skip(begin) {
            if self.would_show_carrying(sample) {
                self.watch.see(number, sample, 0.0);
            }
        }
    }

    /// Of several sensors the one that holds the pose shows it; a robot without eyes sees nothing, and one without odometry
    /// may always have moved.
    fn would_show_carrying(&self, sample: &Sample) -> bool {
        let is_precise = sample.scan.sensor().kind() == SensorKind::Laser;
        let has_odometry = self.front_end.tracker.last_odometry().is_some();
        has_odometry && !self.eyes.are_shut() && (is_precise || !self.front_end.is_held_by_scans())
    }

    /// The robot was carried just before sample `first`.
    fn go_on_elsewhere(&mut self, first: usize) -> Result<Vec<Event>, MapperError> {
        let Some(last) = self.trajectory.anchors().last().copied() else { return Ok(Vec::new()) };
        let mut events = Vec::new();
        let anchors = self.trajectory.anchors();
        if anchors.len().checked_sub(2).is_some_and(|before_last| anchors[before_last].sample > first) {
            return Ok(Vec::new()); // scans as far apart as places: what was seen from where cannot be told
        }
        let arrived_since = last.sample > first;
        if !arrived_since {
            events.extend(self.complete_place_with(first)?);
        }
        let forgotten = self.recognizer.finish(&self.coordinates);
        events.extend(self.close(forgotten)?);
        self.set_down = Some(first);
        self.front_end.set_down(self.trajectory.samples_from(first))?;
        let link = if arrived_since { self.tie_again(first) } else { Some(self.begin_at(first, &last)?) };
        if let Some(link) = link {
            self.map.carry(link)?;
            events.push(Event::Carried { link, told_by: CarriedBy::Scans });
        }
        self.recognizer.tell_links(&self.map);
        Ok(events)
    }

    /// A new place at sample `first`; answers the link that leads there from the `last` one.
    fn begin_at(&mut self, first: usize, last: &Anchor) -> Result<LinkId, MapperError> {
        let before =
            last.track_from_robot.inverse() * self.trajectory.samples()[first.saturating_sub(1)].track_from_robot;
        let place = self.add_place()?;
        let ends = self.anchor_at(first.saturating_sub(1), last.place, last.place_from_robot * before);
        self.trajectory.push_anchor(Anchor { sample: first, ..ends });
        let turned = turned_like(&self.trajectory.samples()[first]);
        self.trajectory.push_anchor(Anchor { sample: first, ..self.anchor_at(first, place, turned) });
        let last_from_place = ends.place_from_robot * turned.inverse();
        let turn = Turn { change: last_from_place.rotation.angle(), variance: 1.0 };
        let displacement = Displacement {
            vector: last_from_place.translation.vector,
            covariance: Matrix2::identity(),
            turn: (!self.front_end.tracker.has_compass()).then_some(turn),
        };
        let link = self.map.travel(last.place, place, displacement)?;
        self.coordinates.place(place, Some((last.place, &displacement)));
        Ok(link)
    }

    /// The robot has come to its last place since sample `first`: ties the path to where that is now. Answers the link that
    /// leads there.
    fn tie_again(&mut self, first: usize) -> Option<LinkId> {
        let count = self.trajectory.anchors().len();
        let [left, last] = *self.trajectory.anchors().get(count.checked_sub(2)?..)? else { return None };
        let samples = self.trajectory.samples();
        let (before, after) = (&samples[first.checked_sub(1)?], &samples[first]);
        let at_last = &samples[last.sample.checked_sub(1)?];
        let turned = turned_like(at_last);
        let place_from_track = turned * at_last.track_from_robot.inverse();
        let left_from_track = left.place_from_robot * left.track_from_robot.inverse();
        let ends = self.anchor_at(first - 1, left.place, left_from_track * before.track_from_robot);
        let begins = self.anchor_at(first, last.place, place_from_track * after.track_from_robot);
        let tied = Anchor { track_from_robot: at_last.track_from_robot, place_from_robot: turned, ..last };
        *self.trajectory.last_anchor_mut()? = tied;
        self.trajectory.insert_anchor(count - 1, Anchor { sample: first, ..begins });
        self.trajectory.insert_anchor(count - 1, Anchor { sample: first, ..ends });
        let leads_there = |link: &&Link| link.to == last.place && link.origin == LinkOrigin::Traveled;
        self.map.links_of(last.place).find(leads_there).map(|link| link.id)
    }

    /// The robot at the moment of a sample, tied to a place.
    fn anchor_at(&self, sample: usize, place: PlaceId, place_from_robot: Isometry2<f64>) -> Anchor {
        let Sample { stamp, track_from_robot, travelled, .. } = self.trajectory.samples()[sample];
        Anchor { place, sample, stamp, track_from_robot, place_from_robot, travelled }
    }

    /// Moves what the robot has seen since it was carried to where it was recognised.
    pub(super) fn bring_together(&mut self, closure: &Closure) {
        let Some((moving, map_from_map)) = self.recognizer.apart(closure, &self.coordinates) else { return };
        for place in moving {
            let pose = map_from_map * self.coordinates.map_from_place(place);
            self.coordinates.move_to(place, pose);
        }
    }
}

/// The robot at the centre of a place whose axes are those of the track frame.
fn turned_like(sample: &Sample) -> Isometry2<f64> {
    Isometry2::rotation(sample.track_from_robot.rotation.angle())
}

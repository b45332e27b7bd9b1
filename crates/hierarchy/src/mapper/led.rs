//! A mapper whose explorer says by itself where places are.

use std::sync::Arc;

use nalgebra::{Isometry2, Vector2};
use robot_log::Entry;
use robot_log::local_grid::Signature;
use topo_map::{PlaceId, TopoMap};

use super::{Mapper, MapperError, first_since};
use crate::coordinates::Coordinates;
use crate::front_end::tracker::Tracker;
use crate::front_end::{Direction, Sensed};
use crate::recognize::{Closure, Sensing};
use crate::trajectory::Trajectory;

impl Mapper {
    /// Takes in one entry: nothing but the trajectory grows.
    pub(crate) fn follow(&mut self, entry: &Entry) -> Result<(), MapperError> {
        self.tally.check(entry)?;
        self.tally.count(entry);
        match self.front_end.observe(entry)? {
            Sensed::Nothing => {}
            Sensed::FrameTurned(turn) => self.trajectory.rotate(turn),
            Sensed::Scan(sample) => self.trajectory.push_sample(sample),
        }
        Ok(())
    }

    /// The levels that an explorer changes.
    pub(crate) fn charted(&mut self) -> (&mut TopoMap<Arc<Signature>>, &mut Coordinates, &mut Trajectory) {
        (&mut self.map, &mut self.coordinates, &mut self.trajectory)
    }

    /// What the spot where the robot stands looks like, from the scans taken since it had `travelled` so far.
    pub(crate) fn view(&self, travelled: f64) -> Result<Arc<Signature>, MapperError> {
        let here = Isometry2::from_parts(self.track_from_robot().translation, nalgebra::UnitComplex::identity());
        let samples = self.trajectory.samples();
        Ok(self.sight.signature(&here, &samples[first_since(samples, travelled)..])?)
    }

    /// The robot is at a place, `offset` metres from its centre.
    pub(crate) fn stand_at(&mut self, place: PlaceId, offset: Vector2<f64>) {
        let place_from_robot = Isometry2::from_parts(offset.into(), self.track_from_robot().rotation);
        let stamp = self.tally.stamps.map_or(0.0, |(_, last)| last);
        self.anchor(place, stamp, place_from_robot);
    }

    /// Weighs a place just visited against all others.
    pub(crate) fn recognize(&mut self, place: PlaceId) -> Vec<Closure> {
        self.recognizer.tell_links(&self.map); // an explorer measures, merges and rejects as it likes
        self.recognizer.consider(&self.map, &self.coordinates, place, Sensing::Specular, self.front_end.held())
    }

    /// What walls have taught of the building's direction beside a compass.
    pub(crate) fn building(&self) -> Option<Direction> {
        self.front_end.building()
    }

    pub(crate) fn tracker(&self) -> &Tracker {
        &self.front_end.tracker
    }
}

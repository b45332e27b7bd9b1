//! What a mapper holds: its levels, names, paths and gridmaps.

use std::sync::Arc;

use global_grid::{Calculus, GridOptions};
use nalgebra::{Isometry2, Point2};
use robot_log::local_grid::{FuzzyGrid, Signature};
use topo_map::{PlaceId, TopoMap};

use super::{Mapper, MapperError};
use crate::config::Config;
use crate::coordinates::{Coordinates, Relaxation};
use crate::front_end::gyro::{GyroBesideWheels, HeadingDrift};
use crate::live_map::LiveMap;
use crate::mapper::tally::Tally;
use crate::query::floor_plan::FloorPlan;
use crate::recognize::{Closure, Recognizer};
use crate::session::records::StoredTracker;
use crate::trajectory::Trajectory;

impl Mapper {
    /// Every resemblance that was weighed, in the order of the decisions.
    #[must_use]
    pub fn closures(&self) -> &[Closure] {
        &self.closures
    }

    pub(crate) fn recognizer(&self) -> &Recognizer {
        &self.recognizer
    }

    pub(crate) fn track_from_robot(&self) -> Isometry2<f64> {
        self.front_end.tracker.track_from_robot()
    }

    pub(crate) fn tracker_state(&self) -> StoredTracker {
        self.front_end.tracker.state()
    }

    pub(crate) fn travel_along_heading(&self) -> nalgebra::Vector2<f64> {
        self.front_end.tracker.since_place().with_heading
    }

    pub(crate) fn heading_drift(&self) -> HeadingDrift {
        self.front_end.tracker.heading_drift()
    }

    pub(crate) fn gyro_beside_wheels(&self) -> Option<GyroBesideWheels> {
        self.front_end.tracker.gyro_beside_wheels()
    }

    pub(crate) fn is_held_by_scans(&self) -> bool {
        self.front_end.is_held_by_scans()
    }

    /// The names that people gave to places, by place.
    pub fn names(&self) -> impl Iterator<Item = (PlaceId, &str)> + '_ {
        self.names.iter().map(|(place, name)| (*place, name.as_str()))
    }

    /// Gives a place a name, or takes it away with an empty one; answers whether there is such a place.
    pub fn name(&mut self, place: PlaceId, name: &str) -> bool {
        let exists = self.map.place(place).is_some();
        if exists && name.is_empty() {
            self.names.remove(&place);
        } else if exists {
            self.names.insert(place, name.to_owned());
        }
        exists
    }

    /// What is remembered of regions and gateways.
    #[must_use]
    pub fn floor_plan(&self) -> &FloorPlan {
        &self.floor_plan
    }

    /// Takes over what is remembered of regions and gateways from another state of the same map: it holds on to places.
    pub fn remember_floor_plan(&mut self, plan: FloorPlan) {
        self.floor_plan = plan;
    }

    pub(crate) fn floor_plan_mut(&mut self) -> &mut FloorPlan {
        &mut self.floor_plan
    }

    /// The place that `place` is, where a person said that the two are one.
    #[must_use]
    pub fn same_as(&self, place: PlaceId) -> Option<PlaceId> {
        let other = *self.same.get(&place)?;
        Some(self.same_as(other).unwrap_or(other)) // never in a circle: see `declare_same`
    }

    /// Declares `place` to be `other`; what was declared before is followed on both sides.
    pub(crate) fn declare_same(&mut self, place: PlaceId, other: PlaceId) {
        let (place, other) = (self.same_as(place).unwrap_or(place), self.same_as(other).unwrap_or(other));
        if place != other {
            self.same.insert(place, other);
        }
    }

    pub(crate) fn topology_mut(&mut self) -> &mut TopoMap<Arc<Signature>> {
        &mut self.map
    }

    /// Brings the coordinates to the optimum of the links.
    pub(crate) fn relax(&mut self) -> Result<Relaxation, MapperError> {
        Ok(self.coordinates.relax(&self.map)?)
    }

    /// The configuration in use.
    #[must_use]
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The topological level.
    #[must_use]
    pub fn topology(&self) -> &TopoMap<Arc<Signature>> {
        &self.map
    }

    /// Where the places are.
    #[must_use]
    pub fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    /// What was sensed, and where.
    #[must_use]
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// What came in so far.
    #[must_use]
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Time that recognition took, since the program began.
    #[must_use]
    pub fn spent_recognizing(&self) -> std::time::Duration {
        self.recognizer.spent()
    }

    /// Where headings came from so far: `compass`, `compass and structure` (freed of its disturbance by walls), `gyro` (what was taken for one until it drifted), `structure` (the
    /// directions of walls or of travel, and the fit of successive scans) or `odometry`.
    #[must_use]
    pub fn heading_source(&self) -> &'static str {
        let tracker = &self.front_end.tracker;
        if tracker.has_compass() && self.front_end.is_held_by_walls() {
            "compass and structure"
        } else if tracker.has_compass() {
            "compass"
        } else if self.front_end.is_held_by_scans() {
            "structure"
        } else if tracker.has_gyro() {
            "gyro"
        } else if self.front_end.is_held_by_walls() || !self.coordinates.held().is_empty() {
            "structure"
        } else {
            "odometry"
        }
    }

    /// The robot in the map at every sample of the trajectory.
    #[must_use]
    pub fn poses(&self) -> Vec<Isometry2<f64>> {
        self.trajectory.corrected(|place| self.coordinates.map_from_place(place))
    }

    /// Where the robot has been, in order, in metres: ground that its body swept, for
    /// [`PlanOptions::driven`](global_grid::plan::PlanOptions::driven).
    #[must_use]
    pub fn driven(&self) -> Vec<Point2<f64>> {
        self.poses().iter().map(|pose| pose.translation.vector.into()).collect()
    }

    /// The robot in the map, now.
    #[must_use]
    pub fn map_from_robot(&self) -> Isometry2<f64> {
        self.trajectory.anchors().last().map_or_else(Isometry2::identity, |anchor| {
            let travelled = anchor.track_from_robot.inverse() * self.track_from_robot();
            self.coordinates.map_from_place(anchor.place) * anchor.place_from_robot * travelled
        })
    }

    /// All readings at the relaxed poses of their places, in one fuzzy gridmap.
    ///
    /// # Errors
    ///
    /// Nothing was sensed yet, or the map is larger than a dense grid can be.
    pub fn gridmap(&self) -> Result<FuzzyGrid, MapperError> {
        self.gridmap_by(Calculus::Fuzzy)
    }

    /// All readings at the relaxed poses of their places, fused by a calculus: the degrees to which each cell is empty and
    /// occupied, see [`global_grid::GridOptions::degrees`].
    ///
    /// # Errors
    ///
    /// As [`Mapper::gridmap`].
    pub fn gridmap_by(&self, calculus: Calculus) -> Result<FuzzyGrid, MapperError> {
        let mut map = LiveMap::new(GridOptions { calculus, ..self.config.grid.options() })?;
        map.follow(self, 0.0)?;
        Ok(map.map().to_grid()?)
    }

    /// The position of every place as dead reckoning along the traveled links has it, in metres.
    #[must_use]
    pub fn dead_reckoned(&self) -> Vec<Point2<f64>> {
        self.dead_reckoning().iter().map(|pose| pose.translation.vector.into()).collect()
    }

    /// Where dead reckoning along the traveled links puts every place.
    pub(crate) fn dead_reckoning(&self) -> Vec<Isometry2<f64>> {
        let mut coordinates = Coordinates::default();
        if let Some(first) = self.map.places().first() {
            coordinates.place(first.id, None);
        }
        let traveled = self.map.links().iter().filter(|link| link.origin == topo_map::LinkOrigin::Traveled);
        for link in traveled.filter(|link| link.from < link.to) {
            coordinates.place(link.to, Some((link.from, &link.displacement)));
        }
        coordinates.padded(&self.map)
    }
}

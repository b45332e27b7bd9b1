use local_grid::Heading;
use nalgebra::Point2;
use robot_log::Entry;

use crate::{Command, Robot};

/// How a robot is driven along given points by somebody who sees where it goes.
#[derive(Debug, Clone, PartialEq)]
pub struct TourOptions {
    /// Metres between two stops at which the sensors fire.
    pub stop_every: f64,
    /// Headings that the turret takes in turn, one per stop, in radians, as the robot believes them. Three steps of a
    /// third of the sonars' spacing give 48 directions per place from a ring of 16.
    pub looks: Vec<f64>,
    /// How often the sensors fire at a stop, one look each.
    pub firings: usize,
    /// Seconds to wait for something in the way to go.
    pub patience: f64,
}

impl Default for TourOptions {
    fn default() -> Self {
        let step = 7.5f64.to_radians();
        Self { stop_every: 1.0, looks: vec![0.0, step, 2.0 * step], firings: 3, patience: 60.0 }
    }
}

/// Why a tour ended early.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TourError {
    /// Something stood in the way and did not go.
    #[error("waypoint {waypoint} at ({x:.2}, {y:.2}): blocked {left:.2} m before it")]
    Blocked {
        /// The waypoint that was not reached, from 1.
        waypoint: usize,
        /// Its coordinates in the map frame.
        x: f64,
        /// Its coordinates in the map frame.
        y: f64,
        /// Metres that were missing.
        left: f64,
    },
    /// The distance between stops must be one.
    #[error("the distance between stops must be positive and finite, got {0}")]
    StopEvery(f64),
}

/// Nearer than this a waypoint is reached, in metres.
const REACHED: f64 = 0.02;

impl Robot<'_> {
    /// Drives to each of `points` (map frame) in a straight line, stopping to fire the sensors on the way.
    ///
    /// The driver sees the building, so the robot really gets there, whatever its odometry believes. `entries` gets
    /// each stop's entries.
    ///
    /// # Errors
    ///
    /// A waypoint that cannot be reached in a straight line, or a distance between stops that is not positive.
    pub fn drive_tour(
        &mut self,
        points: &[Point2<f64>],
        options: &TourOptions,
        mut entries: impl FnMut(&Self, Vec<Entry>),
    ) -> Result<(), TourError> {
        if !(options.stop_every > 0.0 && options.stop_every.is_finite()) {
            return Err(TourError::StopEvery(options.stop_every));
        }
        let _span = tracing::debug_span!("tour", waypoints = points.len()).entered();
        let mut stops = 0;
        let mut until_stop = 0.0;
        for (waypoint, &point) in (1..).zip(points) {
            loop {
                let mut log = Vec::new();
                if until_stop <= REACHED {
                    self.stop(options, &mut stops, &mut log);
                    until_stop = options.stop_every;
                }
                let way = point - Point2::from(self.map_from_robot().translation.vector);
                if way.norm() <= REACHED {
                    entries(self, log);
                    break;
                }
                let to = self.believed(Heading::of(way));
                self.execute(&Command::Turn { to }, &mut log);
                let distance = until_stop.min(way.norm());
                let driven = self.push_on(distance, options.patience, &mut log);
                until_stop -= driven;
                entries(self, log);
                if driven < distance - REACHED {
                    return Err(TourError::Blocked { waypoint, x: point.x, y: point.y, left: way.norm() - driven });
                }
            }
        }
        Ok(())
    }

    /// Fires the sensors, each time with the turret's next look.
    fn stop(&mut self, options: &TourOptions, stops: &mut usize, log: &mut Vec<Entry>) {
        for _ in 0..options.firings {
            if !options.looks.is_empty() {
                let to = Heading::from_radians(options.looks[*stops % options.looks.len()]);
                self.execute(&Command::Look { to }, log);
            }
            *stops += 1;
            self.execute(&Command::Fire, log);
        }
    }

    /// Drives ahead; what is in the way may take its time to go.
    fn push_on(&mut self, distance: f64, patience: f64, log: &mut Vec<Entry>) -> f64 {
        let mut driven = 0.0;
        let until = self.time() + patience;
        loop {
            let outcome = self.execute(&Command::Drive { distance: distance - driven }, log);
            driven += outcome.driven;
            if !outcome.blocked || self.time() >= until {
                return driven;
            }
            self.execute(&Command::Wait { seconds: 1.0 }, log);
        }
    }
}

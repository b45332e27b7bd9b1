use std::time::{Duration, Instant};

use nalgebra::{Isometry2, Point2};
use topo_map::{Displacement, PlaceId, PlaceState, TopoMap};

use crate::directions::HeldHeading;
use crate::problem::{Problem, RelaxationError};

/// Where the places are in the map: what relaxation makes of the links.
///
/// Relaxation itself is posed in [`Problem`], the one place where links become springs. A place that no measured link
/// reaches keeps the coordinates at which it was put.
#[derive(Debug, Clone, Default)]
pub struct Coordinates {
    map_from_place: Vec<Isometry2<f64>>,
    sweeps: usize,
    held: Vec<HeldHeading>,
    /// Time that relaxation took.
    spent: Duration,
}

/// How one relaxation went.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Relaxation {
    /// Sweeps spent; 0 where the optimum was solved directly.
    pub sweeps: usize,
    /// Energy before, each link counted once.
    pub energy_before: f64,
    /// Energy after.
    pub energy_after: f64,
    /// Largest shift of a place, in metres.
    pub max_shift: f64,
}

/// Headings in radians that differ by less are the same.
const SAME_HEADING: f64 = 1e-6;

impl Coordinates {
    pub(crate) fn restored(map_from_place: Vec<Isometry2<f64>>, sweeps: usize) -> Self {
        Self { map_from_place, sweeps, ..Self::default() }
    }

    /// The headings that the building holds; empty where a compass holds them all, or nothing does.
    #[must_use]
    pub fn held(&self) -> &[HeldHeading] {
        &self.held
    }

    /// Lets the building hold these headings from now on; answers whether that is news.
    pub(crate) fn hold(&mut self, held: Vec<HeldHeading>) -> bool {
        let same = |(a, b): (&HeldHeading, &HeldHeading)| {
            a.place == b.place && relaxation::wrap(a.heading - b.heading).abs() < SAME_HEADING
        };
        let news = held.len() != self.held.len() || !held.iter().zip(&self.held).all(same);
        self.held = held;
        news
    }

    /// Puts every place somewhere else: a start from which to relax.
    pub(crate) fn put(&mut self, map_from_place: Vec<Isometry2<f64>>) {
        self.map_from_place = map_from_place;
    }

    /// Where a place is and how its axes are turned; the identity for one that has never been placed.
    #[must_use]
    pub fn map_from_place(&self, place: PlaceId) -> Isometry2<f64> {
        self.map_from_place.get(place.index()).copied().unwrap_or_else(Isometry2::identity)
    }

    /// The position of every place in the map, in metres.
    #[must_use]
    pub fn positions(&self) -> Vec<Point2<f64>> {
        self.map_from_place.iter().map(|pose| pose.translation.vector.into()).collect()
    }

    /// Gauss-Seidel sweeps made so far.
    #[must_use]
    pub fn sweeps(&self) -> usize {
        self.sweeps
    }

    /// Time that all relaxations took.
    #[must_use]
    pub fn spent(&self) -> Duration {
        self.spent
    }

    /// Puts a place where a known one and the displacement from it say; without one, at the origin.
    pub fn place(&mut self, place: PlaceId, seen_from: Option<(PlaceId, &Displacement)>) {
        let pose = seen_from.map_or_else(Isometry2::identity, |(from, displacement)| {
            self.map_from_place(from) * displacement.from_place_from_to_place()
        });
        if self.map_from_place.len() <= place.index() {
            self.map_from_place.resize(place.index() + 1, Isometry2::identity());
        }
        self.map_from_place[place.index()] = pose;
    }

    /// The measured links as a problem for `relaxation`.
    ///
    /// # Errors
    ///
    /// A link that is no spring, which the topological map should have refused.
    pub fn problem<S>(&self, map: &TopoMap<S>) -> Result<Problem, RelaxationError> {
        Problem::held(map, &self.held)
    }

    /// One sweep over all places: the paper's share of relaxation for each added place.
    ///
    /// # Errors
    ///
    /// As [`Coordinates::problem`].
    pub fn sweep<S>(&mut self, map: &TopoMap<S>) -> Result<Relaxation, RelaxationError> {
        let begun = Instant::now();
        let problem = self.problem(map)?;
        let before = self.padded(map);
        let after = problem.swept(&before)?;
        self.sweeps += 1;
        Ok(self.accept(&problem, &before, &after, (1, begun)))
    }

    /// The coordinates of least energy.
    ///
    /// # Errors
    ///
    /// As [`Coordinates::problem`].
    pub fn relax<S>(&mut self, map: &TopoMap<S>) -> Result<Relaxation, RelaxationError> {
        let begun = Instant::now();
        let problem = self.problem(map)?;
        let before = self.padded(map);
        let after = problem.relaxed(&before)?;
        Ok(self.accept(&problem, &before, &after, (0, begun)))
    }

    /// Takes over the positions of visited places, by their index, and puts all others where the map expects them: a
    /// predicted place as seen from the place that saw it, a merged one within the place that it is.
    pub(crate) fn settle<S>(&mut self, map: &TopoMap<S>, positions: &[Point2<f64>]) {
        self.map_from_place.resize(map.places().len(), Isometry2::identity());
        for (pose, place) in self.map_from_place.iter_mut().zip(map.places()) {
            if let Some(at) = positions.get(place.id.index()).filter(|_| place.is_visited()) {
                pose.translation.vector = at.coords;
            }
        }
        for place in map.places() {
            let expected = match place.state {
                PlaceState::Predicted { seen_from, .. } => {
                    let from = map.resolve(seen_from);
                    let link = map.links_between(from, place.id).next();
                    link.map(|link| (from, link.displacement_from(from).vector))
                }
                PlaceState::Merged { into, offset } => Some((into, offset)),
                PlaceState::Visited { .. } | PlaceState::Refuted => None,
            };
            if let Some((from, offset)) = expected {
                let at = self.map_from_place(from).translation.vector + offset;
                self.map_from_place[place.id.index()].translation.vector = at;
            }
        }
    }

    /// One pose for each place of the map.
    pub(crate) fn padded<S>(&self, map: &TopoMap<S>) -> Vec<Isometry2<f64>> {
        map.places().iter().map(|place| self.map_from_place(place.id)).collect()
    }

    fn accept(
        &mut self,
        problem: &Problem,
        before: &[Isometry2<f64>],
        after: &[Isometry2<f64>],
        (sweeps, begun): (usize, Instant),
    ) -> Relaxation {
        self.map_from_place = after.to_vec();
        self.spent += begun.elapsed();
        let shift =
            |(from, to): (&Isometry2<f64>, &Isometry2<f64>)| (to.translation.vector - from.translation.vector).norm();
        let max_shift = before.iter().zip(after).map(shift).fold(0.0, f64::max);
        Relaxation { sweeps, energy_before: problem.energy(before), energy_after: problem.energy(after), max_shift }
    }
}

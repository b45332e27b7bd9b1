pub(crate) mod directions;
mod part;
pub(crate) mod problem;
mod spots;

use std::time::{Duration, Instant};

use nalgebra::{Isometry2, Point2};
use part::{Moved, Part};
use spots::Spots;
use topo_map::{Displacement, Link, LinkId, LinkOrigin, PlaceId, PlaceState, TopoMap};

use crate::coordinates::directions::HeldHeading;
use crate::coordinates::problem::{Problem, RelaxationError};

/// Where the places are in the map: what relaxation makes of the links.
///
/// Relaxation itself is posed in [`Problem`], the one place where links become springs. A place that no measured link
/// reaches keeps the coordinates at which it was put.
#[derive(Debug, Clone, Default)]
pub struct Coordinates {
    map_from_place: Vec<Isometry2<f64>>,
    spots: Spots,
    sweeps: usize,
    held: Vec<HeldHeading>,
    /// The energy of all links after the last relaxation, if nothing has moved the places since.
    energy: Option<f64>,
    /// Time that relaxation took.
    spent: Duration,
    /// Links in all relaxations, each counted as often as it was relaxed.
    links_relaxed: usize,
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

/// Maps of fewer places than this are relaxed as a whole.
const WHOLE: usize = 512;
/// So many places are let go first; four times as many when they were not enough.
const FIRST_PART: usize = 64;
/// Headings in radians that differ by less are the same.
const SAME_HEADING: f64 = 1e-6;

impl Coordinates {
    pub(crate) fn restored(map_from_place: Vec<Isometry2<f64>>, sweeps: usize) -> Self {
        let mut restored = Self { sweeps, ..Self::default() };
        restored.put(map_from_place);
        restored
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
        self.spots = Spots::of(map_from_place.iter().map(|pose| pose.translation.vector));
        self.map_from_place = map_from_place;
        self.energy = None;
    }

    /// Puts one place somewhere else; answers where it was.
    fn put_one(&mut self, place: PlaceId, pose: Isometry2<f64>) -> Isometry2<f64> {
        let before = std::mem::replace(&mut self.map_from_place[place.index()], pose);
        self.spots.shift(place, before.translation.vector, pose.translation.vector);
        before
    }

    /// The places within `radius` metres of a point of the map, by number.
    pub(crate) fn near(&self, at: Point2<f64>, radius: f64) -> Vec<PlaceId> {
        let mut places = self.spots.around(at, radius);
        places.retain(|place| (self.map_from_place(*place).translation.vector - at.coords).norm() <= radius);
        places
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

    /// Links in all relaxations so far, each counted as often as it was relaxed: the work, whatever the machine.
    #[must_use]
    pub fn links_relaxed(&self) -> usize {
        self.links_relaxed
    }

    /// Puts a place where a known one and the displacement from it say; without one, at the origin.
    pub fn place(&mut self, place: PlaceId, seen_from: Option<(PlaceId, &Displacement)>) {
        let pose = seen_from.map_or_else(Isometry2::identity, |(from, displacement)| {
            self.map_from_place(from) * displacement.from_place_from_to_place()
        });
        for next in (0..=place.0).skip(self.map_from_place.len()).map(PlaceId) {
            self.map_from_place.push(Isometry2::identity());
            self.spots.put(next, nalgebra::Vector2::zeros());
        }
        self.put_one(place, pose);
    }

    /// Moves a place to where it is known to be, before relaxation.
    pub(crate) fn move_to(&mut self, place: PlaceId, map_from_place: Isometry2<f64>) {
        self.energy = None;
        if place.index() < self.map_from_place.len() {
            self.put_one(place, map_from_place);
        }
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
        self.links_relaxed += map.links().len();
        let before = self.padded(map);
        let after = problem.relaxed(&before)?;
        Ok(self.accept(&problem, &before, &after, (0, begun)))
    }

    /// The same after some links were measured or taken back, which touches no more of the map than moves; also which links
    /// are how far from their measurements now, as far as that can have changed.
    ///
    /// Small maps are relaxed as a whole.
    ///
    /// # Errors
    ///
    /// As [`Coordinates::problem`].
    pub(crate) fn relax_around<S>(
        &mut self,
        map: &TopoMap<S>,
        changed: &[LinkId],
    ) -> Result<(Relaxation, Vec<(LinkId, f64)>), RelaxationError> {
        let begun = Instant::now();
        let mut count = FIRST_PART;
        while self.held.is_empty() && WHOLE.max(2 * count) <= map.places().len() {
            let part = Part::around(map, changed, count);
            self.links_relaxed += part.len();
            let moved = part.relaxed(|place| self.map_from_place(place))?;
            if moved.is_enough {
                let relaxation = self.take_over(map, changed, &moved)?;
                self.spent += begun.elapsed();
                return Ok((relaxation, moved.chi2));
            }
            count *= 4;
        }
        let relaxation = self.relax(map)?;
        let residuals = self.problem(map)?.residuals(&self.padded(map));
        let measured = map.links().iter().filter(|link| link.is_measured()).map(|link| link.id);
        Ok((relaxation, measured.zip(residuals).collect()))
    }

    /// The recognised links that truncated least squares leaves out, with how far each is from its measurement, squared and
    /// normalised: `bound` is the most that one may have without being suspected.
    ///
    /// What is suspected is judged with as much of the map as letting go of closures moves, the rest held, however large the map
    /// is. That is final where nothing falls but what was `just_made`. Links on which the map rests are taken back by the
    /// whole map alone: false ones may have bent what is around them, and would outvote the truth there.
    ///
    /// # Errors
    ///
    /// As [`Coordinates::problem`].
    pub(crate) fn outvoted_around<S>(
        &mut self,
        map: &TopoMap<S>,
        suspected: &[LinkId],
        just_made: &[LinkId],
        bound: f64,
    ) -> Result<Vec<(LinkId, f64)>, RelaxationError> {
        let mut count = FIRST_PART;
        while self.held.is_empty() && WHOLE.max(2 * count) <= map.places().len() {
            let part = Part::around(map, suspected, count);
            self.links_relaxed += part.len();
            let pose = |place| self.map_from_place(place);
            let outvoted = part.outvoted(pose, bound)?;
            if !outvoted.links.iter().all(|id| just_made.contains(id)) {
                break;
            }
            if outvoted.is_enough {
                let links = outvoted.links.iter().filter_map(|id| map.link(*id));
                return Ok(links.map(|link| (link.id, part::chi2(link, pose))).collect());
            }
            count *= 4;
        }
        self.outvoted(map, bound)
    }

    /// The same, judged by the whole map.
    ///
    /// # Errors
    ///
    /// As [`Coordinates::problem`].
    pub(crate) fn outvoted<S>(&mut self, map: &TopoMap<S>, bound: f64) -> Result<Vec<(LinkId, f64)>, RelaxationError> {
        let problem = self.problem(map)?;
        let measured: Vec<&Link> = map.links().iter().filter(|link| link.is_measured()).collect();
        self.links_relaxed += measured.len();
        let residuals = problem.residuals(&self.padded(map));
        let trusted: Vec<bool> = measured.iter().map(|link| link.origin != LinkOrigin::Recognized).collect();
        let rejected = problem.outvoted(&trusted, bound)?;
        Ok(rejected.into_iter().map(|k| (measured[k].id, residuals[k])).collect())
    }

    /// Takes over the places that moved. Links that were driven since the last relaxation hold no energy, since their places
    /// were put where they say; those that `changed` hold what they hold now, or held before they were taken back.
    fn take_over<S>(
        &mut self,
        map: &TopoMap<S>,
        changed: &[LinkId],
        moved: &Moved,
    ) -> Result<Relaxation, RelaxationError> {
        let known = self.energy.map(|energy| {
            let links = changed.iter().filter_map(|id| map.link(*id));
            let chi2 = |link: &Link| {
                let chi2 = part::chi2(link, |place| self.map_from_place(place));
                if link.is_measured() { chi2 } else { -chi2 }
            };
            energy + links.map(chi2).sum::<f64>()
        });
        let energy_before = match known {
            Some(energy) => energy,
            None => self.problem(map)?.energy(&self.padded(map)),
        };
        let mut max_shift: f64 = 0.0;
        for (place, pose) in &moved.poses {
            let before = self.put_one(*place, *pose);
            max_shift = max_shift.max((pose.translation.vector - before.translation.vector).norm());
        }
        let energy_after = energy_before - moved.chi2_before + moved.chi2.iter().map(|(_, chi2)| chi2).sum::<f64>();
        self.energy = Some(energy_after);
        Ok(Relaxation { sweeps: 0, energy_before, energy_after, max_shift })
    }

    /// Takes over the positions of visited places, by their index, and puts all others where the map expects them: a
    /// predicted place as seen from the place that saw it, a merged one within the place that it is.
    pub(crate) fn settle<S>(&mut self, map: &TopoMap<S>, positions: &[Point2<f64>]) {
        self.energy = None;
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
        let settled = std::mem::take(&mut self.map_from_place);
        self.put(settled);
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
        self.put(after.to_vec());
        self.spent += begun.elapsed();
        let shift =
            |(from, to): (&Isometry2<f64>, &Isometry2<f64>)| (to.translation.vector - from.translation.vector).norm();
        let max_shift = before.iter().zip(after).map(shift).fold(0.0, f64::max);
        let energy_after = problem.energy(after);
        self.energy = Some(energy_after);
        Relaxation { sweeps, energy_before: problem.energy(before), energy_after, max_shift }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Vector2};
    use topo_map::Turn;

    use super::*;

    /// A robot that drives `rounds` times round a square of 25 places a side: without a compass veering a little, with one
    /// slipping a little.
    fn rounds(rounds: u32, compass: bool) -> (TopoMap<()>, Coordinates) {
        let (mut map, mut coordinates) = (TopoMap::new(), Coordinates::default());
        let mut last = map.add_place(()).unwrap();
        coordinates.place(last, None);
        for number in 1..rounds * 100 {
            let change = if number % 25 == 0 { std::f64::consts::FRAC_PI_2 } else { 0.0 } + 1e-4;
            let turn = (!compass).then_some(Turn { change, variance: 1e-5 });
            let ahead = Vector2::new(1.0, 0.0);
            let side = f64::from(number / 25) * std::f64::consts::FRAC_PI_2;
            let slipped = Isometry2::rotation(side) * ahead + Vector2::new(1e-4, 0.0);
            let vector = if compass { slipped } else { ahead };
            let step = Displacement { vector, covariance: Matrix2::identity() * 1e-4, turn };
            let next = map.add_place(()).unwrap();
            map.travel(last, next, step).unwrap();
            coordinates.place(next, Some((last, &step)));
            last = next;
        }
        (map, coordinates)
    }

    /// Every third place from the second round on is where it was a round before.
    fn close(map: &mut TopoMap<()>, number: u32, compass: bool) -> LinkId {
        let turn = (!compass).then_some(Turn { change: 0.0, variance: 1e-5 });
        let same = Displacement { vector: Vector2::zeros(), covariance: Matrix2::identity() * 1e-4, turn };
        map.recognize(PlaceId(number), PlaceId(number - 100), same).unwrap()
    }

    #[test]
    fn relaxing_around_a_closure_is_relaxing_the_map() {
        relaxes_as_a_whole(false);
    }

    #[test]
    fn so_it_is_where_a_compass_holds_the_headings() {
        relaxes_as_a_whole(true);
    }

    fn relaxes_as_a_whole(compass: bool) {
        let (mut map, mut part) = rounds(8, compass);
        let (mut places, mut whole) = (Vec::new(), part.clone());
        for number in (100..800).step_by(3) {
            let link = close(&mut map, number, compass);
            let (relaxation, misfits) = part.relax_around(&map, &[link]).unwrap();
            whole.relax(&map).unwrap();
            // The energy that is carried on from part to part is that of the map.
            let energy = part.problem(&map).unwrap().energy(&part.padded(&map));
            approx::assert_relative_eq!(relaxation.energy_after, energy, max_relative = 1e-6, epsilon = 1e-9);
            places.push(misfits.len());
        }
        let off = |place: &topo_map::Place<()>| {
            let (a, b) = (part.map_from_place(place.id), whole.map_from_place(place.id));
            (a.translation.vector - b.translation.vector).norm()
        };
        let worst = map.places().iter().map(off).fold(0.0, f64::max);
        let most = if compass { 0.03 } else { 0.02 };
        assert!(worst < most, "{worst} m");
        let near = |at: Point2<f64>| part.near(at, 3.0);
        for place in map.places() {
            let at: Point2<f64> = part.map_from_place(place.id).translation.vector.into();
            let off = |other: &&topo_map::Place<()>| part.map_from_place(other.id).translation.vector - at.coords;
            let all: Vec<PlaceId> =
                map.places().iter().filter(|other| off(other).norm() <= 3.0).map(|p| p.id).collect();
            assert_eq!(near(at), all);
        }
        let links = map.links().len();
        assert!(places.iter().filter(|touched| **touched < links / 2).count() > places.len() / 4, "{places:?}");
    }

    /// Links relaxed up to the end of each row by a robot that mows a meadow in rows of 40 places, 1 m apart, veering or
    /// slipping a little, and that recognises each place from the one beside it in the row before, every fiftieth wrongly.
    fn mown(rows: u32, compass: bool) -> Vec<usize> {
        const ROW: u32 = 40;
        let (mut map, mut coordinates) = (TopoMap::new(), Coordinates::default());
        let pose = |number: u32| {
            let (row, step) = (number / ROW, f64::from(number % ROW));
            let there = row.is_multiple_of(2);
            let x = if there { step } else { f64::from(ROW - 1) - step };
            Isometry2::new(Vector2::new(x, f64::from(row)), if there { 0.0 } else { std::f64::consts::PI })
        };
        let between = |a: u32, b: u32, error: f64| {
            let (a, b) = (pose(a), pose(b));
            let seen = a.inv_mul(&b);
            let vector = if compass { b.translation.vector - a.translation.vector } else { seen.translation.vector };
            let turn = Turn { change: seen.rotation.angle() + 0.1 * error, variance: 1e-5 };
            let vector = vector + Vector2::new(error, 0.0);
            Displacement { vector, covariance: Matrix2::identity() * 1e-4, turn: (!compass).then_some(turn) }
        };
        let (mut done, mut rejected) = (Vec::new(), 0);
        for number in 0..rows * ROW {
            let place = map.add_place(()).unwrap();
            let from = number.checked_sub(1).map(|before| (PlaceId(before), between(before, number, 1e-4)));
            if let Some((before, step)) = from {
                map.travel(before, place, step).unwrap();
            }
            coordinates.place(place, from.as_ref().map(|(before, step)| (*before, step)));
            if number >= ROW {
                let beside = number / ROW * ROW - 1 - number % ROW;
                let error = if number % 50 == 7 { 1.0 } else { 0.0 };
                let link = map.recognize(place, PlaceId(beside), between(number, beside, error)).unwrap();
                let (_, misfits) = coordinates.relax_around(&map, &[link]).unwrap();
                if misfits.iter().any(|(_, chi2)| *chi2 > 16.27) {
                    for (link, _) in coordinates.outvoted_around(&map, &[link], &[link], 16.27).unwrap() {
                        map.set_link_state(link, topo_map::LinkState::Rejected).unwrap();
                        coordinates.relax_around(&map, &[link]).unwrap();
                        rejected += 1;
                    }
                }
            }
            if number % ROW == ROW - 1 {
                done.push(coordinates.links_relaxed());
            }
        }
        let wrong = (ROW..rows * ROW).filter(|number| number % 50 == 7).count();
        assert_eq!(rejected, wrong);
        done
    }

    #[test]
    fn closures_cost_no_more_where_the_map_is_larger() {
        for compass in [false, true] {
            let done = mown(60, compass);
            let work = |rows: std::ops::Range<usize>| done[rows.end - 1] - done[rows.start - 1];
            // From 800 to 2,400 places: if the work grew with the map it would be more than twice as much.
            let (early, late) = (work(20..30), work(50..60));
            assert!(late < early + early / 3, "compass {compass}: {early} links relaxed, then {late}");
        }
    }
}

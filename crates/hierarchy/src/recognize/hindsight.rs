//! Whether the robot was carried at a moment that is past.

use std::cell::OnceCell;
use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::{Isometry2, Matrix2, Point2, Rotation2, Vector2};
use robot_log::local_grid::Signature;
use topo_map::{Place, PlaceId, TopoMap};

use super::stretch::{Agreement, Doubt, Hypothesis, OVERLAP, View, Weighing};
use super::{AGREEMENT_ANYWHERE, BELIEVED, Closure, Gate, Recognizer, STRETCH, Verdict};
use crate::coordinates::Coordinates;
use crate::recognize::reach::Held;

/// What later views say of being carried.
///
/// Where a robot is set down where it looks alike, no scan tells that it was carried. But then what it sees from there on fits
/// the old places not where the chain of links has them, but all moved by one motion `u`, however far. So the last
/// [`WALK`] places are remembered with the old places that the index of signatures finds most alike, wherever they lie. Where
/// many of these ask for one motion, the views are compared with the old places there, and weighed:
///
/// ```text
///            P(carried) · max_t [ Λ_t · Π_{n ≥ t} L_n(u) ] / N
/// odds  =  ─────────────────────────────────────────────────────────────────
///           max_v p(v) Π L_n(v)  +  Π min(1, L_n(0)) · max(1, A · Π L_n(u))  +  other motions
/// ```
///
/// `Λ_t` is what the scans say of the moment `t` (the likelihood ratio of the watch over scans), `L_n` what view `n` says of a motion, `N` the
/// number of old places, `v` a motion that the drift of the chain explains, with its density `p`, and `A` the probability that
/// another part of the building looks like an old one throughout: views of a twin agree however many there are, so that they
/// alone prove nothing, unless the places that the robot would be at do not look like what it sees.
#[derive(Debug, Default)]
pub(super) struct Hindsight {
    walk: VecDeque<Passed>,
}

/// A place of the walk.
#[derive(Debug)]
struct Passed {
    view: View,
    /// The old places that look most alike, the most alike first.
    alike: Vec<PlaceId>,
    /// Logarithm of the odds that the robot was carried on its way there, as scans have it; absent until it was asked for.
    by_scans: OnceCell<f64>,
}

/// That the robot was carried on its way to a place.
#[derive(Debug)]
pub(crate) struct Found {
    /// The first place since.
    pub(crate) first: PlaceId,
    /// How everything since has to be moved in the map.
    pub(crate) motion: Isometry2<f64>,
    /// How many views say so, and the logarithm of the odds.
    pub(crate) agreed: usize,
    pub(crate) log_odds: f64,
    /// Where it is since.
    pub(crate) closures: Vec<Closure>,
}

/// Places that are remembered.
const WALK: usize = 200;
/// Places that came so many before a view are old enough to be compared with it.
const OLD: u32 = 20;
/// Of so many last views...
const VOTERS: usize = 20;
/// ...so many must find an old place where a motion puts them, within so many metres, before it is looked at.
const VOTES: usize = 13;
const VOTED_WITHIN: f64 = 1.5;
/// So many must then look like the old places there.
const AGREE: usize = 10;
/// How far the turn between two views may differ from that of a motion, in radians.
const TURNED_WITHIN: f64 = 0.4;
/// The most that a view says of a motion, about, and by how much better the last views must fit elsewhere at best to be looked at.
const MOST_SAID: f64 = 1.5;
const GAIN: f64 = 15.0;
/// Comparisons for each place that comes, where a compass holds the axes and where nothing does: the rest waits for the next.
const COMPARED: [usize; 2] = [32, 3];
/// Motions that are looked at, at most.
const LOOKED_AT: usize = 3;
/// Old places that may be the one, as the index has them: a share of all, so that chance votes for nothing, between these bounds.
const ALIKE_OF: u32 = 16;
const ALIKE: (usize, usize) = (4, 64);
/// The same of either end where a motion follows from two views, since nothing holds the heading.
const ALIKE_AT_AN_END: usize = 16;
/// Places between such two views.
const APART: usize = 8;
/// Logarithm of the probability that a part of the building looks like another throughout.
const TWIN: f64 = -12.0;

impl Recognizer {
    /// Whether the robot was carried on its way to one of the last places, now that the last one has been considered; `scans`
    /// tells the logarithm of the odds that the scans taken on the way to a place give.
    pub(crate) fn look_back(
        &mut self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        held: Held,
        scans: impl Fn(PlaceId) -> f64,
    ) -> Option<Found> {
        let begun = std::time::Instant::now();
        self.pass(map);
        let found = self.carried_before(map, coordinates, held, scans);
        self.spent += begun.elapsed();
        found
    }

    /// Remembers the last completed place with the old places that look like it.
    fn pass(&mut self, map: &TopoMap<Arc<Signature>>) {
        let Some(view) = self.stretch.back().filter(|_| self.pieces.is_whole()).cloned() else {
            self.hindsight.walk.clear();
            return;
        };
        let signature = map.place(view.place).and_then(|place| place.signature());
        let is_old = |known| is_older(known, view.place);
        let count = usize::try_from(view.place.0 / ALIKE_OF).unwrap_or(usize::MAX).clamp(ALIKE.0, ALIKE.1);
        let alike = signature.map(|new| self.alike(new, turns(map, view.place), count, is_old));
        self.hindsight.walk.push_back(Passed { view, alike: alike.unwrap_or_default(), by_scans: OnceCell::new() });
        let outgrown = self.hindsight.walk.len().saturating_sub(WALK);
        self.hindsight.walk.drain(..outgrown);
    }

    fn carried_before(
        &mut self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        held: Held,
        scans: impl Fn(PlaceId) -> f64,
    ) -> Option<Found> {
        let newest = self.hindsight.walk.back()?;
        let is_known = newest.view.likenesses.iter().any(|likeness| likeness.decided);
        if is_known || self.hindsight.walk.len() < AGREEMENT_ANYWHERE {
            return None; // where it is recognised it was not carried
        }
        let turned = turns(map, newest.view.place);
        if self.said_of_late(coordinates, &Isometry2::identity()).iter().map(|says| MOST_SAID - says).sum::<f64>()
            < GAIN
        {
            return None; // it looks as it should
        }
        let mut found: Vec<Carried> = Vec::new();
        let mut budget = COMPARED[usize::from(turned)];
        for motion in self.hindsight.elected(coordinates, turned) {
            self.compare_there(map, coordinates, &motion, turned, (VOTERS, &mut budget));
            let agree = self.said_of_late(coordinates, &motion).iter().filter(|says| **says > 0.0).count();
            if agree >= AGREE {
                self.compare_there(map, coordinates, &motion, turned, (WALK, &mut budget));
                found.extend(self.carried_by(map, coordinates, held, &motion, &scans));
            }
        }
        found.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let mut found = found.into_iter();
        let best = found.next()?;
        let others: f64 = found.map(|other| (other.weight - best.weight).exp()).sum();
        let against = best.against.exp() + best.lost.exp();
        let log_odds = best.weight - (against + others * best.weight.exp()).ln();
        (log_odds > BELIEVED).then(|| self.found(coordinates, best, log_odds))
    }

    /// Compares so many of the last views with the old places next to which a motion puts them.
    fn compare_there(
        &mut self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        motion: &Isometry2<f64>,
        turned: bool,
        (count, budget): (usize, &mut usize),
    ) {
        let turn = motion.rotation.angle().abs() + TURNED_WITHIN;
        let turn_window = if turned { turn.min(std::f64::consts::PI) } else { 0.0 };
        let mut walk = std::mem::take(&mut self.hindsight.walk);
        for Passed { view, .. } in walk.iter_mut().rev().take(count) {
            let spot = motion * coordinates.map_from_place(view.place);
            let at = |place: PlaceId| coordinates.map_from_place(place).translation.vector;
            let off = |known: &PlaceId| (at(*known) - spot.translation.vector).norm();
            let mut near = coordinates.near(spot.translation.vector.into(), OVERLAP);
            near.retain(|known| is_older(*known, view.place) && map.place(*known).is_some_and(Place::is_visited));
            let Some(known) = near.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))) else { continue };
            if *budget == 0 || view.likenesses.iter().any(|likeness| likeness.known == known) {
                continue;
            }
            *budget -= 1;
            let signature = |place: PlaceId| map.place(place).and_then(|place| place.signature());
            let (Some(new), Some(old)) = (signature(view.place), signature(known)) else { continue };
            let gate = Gate { known, distance: 0.0, slack: OVERLAP, turn_window };
            view.likenesses.push(self.look(new, old, &gate, &Matrix2::zeros()));
        }
        self.hindsight.walk = walk;
    }

    /// What each of the last views says of a motion.
    fn said_of_late(&self, coordinates: &Coordinates, motion: &Isometry2<f64>) -> Vec<f64> {
        let last = self.hindsight.since(self.hindsight.walk.len().saturating_sub(VOTERS));
        let weighing = Weighing::new(last, |_| true, coordinates, Doubt::Anywhere(1));
        weighing.said(motion)
    }

    /// What speaks for having been carried by about a motion, and against it.
    fn carried_by(
        &self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        held: Held,
        motion: &Isometry2<f64>,
        scans: &impl Fn(PlaceId) -> f64,
    ) -> Option<Carried> {
        let walk = &self.hindsight.walk;
        let views = |begin: usize| self.hindsight.since(begin);
        let all = Weighing::new(views(0), |_| true, coordinates, Doubt::Anywhere(1));
        let (said, stay) = (all.said(&all.near(motion)?.motion), all.said(&Isometry2::identity()));
        if said.iter().filter(|says| **says > 0.0).count() < AGREEMENT_ANYWHERE {
            return None;
        }
        let since = |values: &[f64], begin: usize| values[begin..].iter().sum::<f64>();
        let begins = (1..walk.len()).map(|begin| {
            let place = walk[begin].view.place;
            let by_scans = *walk[begin].by_scans.get_or_init(|| scans(place));
            (begin, by_scans, by_scans + since(&said, begin) - since(&stay, begin))
        });
        let (begin, by_scans, _) = begins.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let first = walk[begin].view.place;
        let places = usize::try_from(first.0).unwrap_or(usize::MAX);
        let weighing = Weighing::new(views(begin), |known| known < first, coordinates, Doubt::Anywhere(places));
        let hypothesis = weighing.near(motion).filter(|found| found.agreeing.len() >= AGREEMENT_ANYWHERE)?;
        let here = Point2::from(coordinates.map_from_place(walk.back()?.view.place).translation.vector);
        if (hypothesis.motion * here - here).norm() < VOTED_WITHIN {
            return None; // where the coordinates have it
        }
        let log_ratio = since(&weighing.said(&hypothesis.motion), 0);
        let unlike: f64 = weighing.said(&Isometry2::identity()).iter().map(|says| says.min(0.0)).sum();
        let drifted = self.drifted(map, coordinates, held, begin);
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2⁵² places")]
        let weight = by_scans + log_ratio - (places.max(1) as f64).ln();
        let against = drifted.max(unlike + (log_ratio + TWIN).max(0.0));
        Some(Carried { begin, hypothesis, weight, against, lost: by_scans })
    }

    /// Logarithm of the likeliest motion since view number `begin` that the drift of the chain explains: one of those that the
    /// last views propose.
    fn drifted(&self, map: &TopoMap<Arc<Signature>>, coordinates: &Coordinates, held: Held, begin: usize) -> f64 {
        let walk = &self.hindsight.walk;
        let first = walk[begin].view.place;
        let reach = self.reach_of(map, walk.iter().skip(begin).map(|passed| &passed.view));
        let weighing = |begin: usize| {
            let views = self.hindsight.since(begin);
            Weighing::new(views, |known| known < first, coordinates, Doubt::Held(held, &reach))
        };
        let all = weighing(begin);
        let proposed = weighing(begin.max(walk.len().saturating_sub(STRETCH))).hypotheses();
        let motions = proposed.iter().map(|near| near.motion).chain([Isometry2::identity()]);
        motions.filter_map(|motion| all.near(&motion)).map(|near| near.log_weight).fold(f64::NEG_INFINITY, f64::max)
    }

    fn found(&mut self, coordinates: &Coordinates, best: Carried, log_odds: f64) -> Found {
        let walk = std::mem::take(&mut self.hindsight.walk);
        let agreed = best.hypothesis.agreeing.len();
        let verdict = Verdict::Accepted { agreed, log_odds };
        let firm = best.hypothesis.agreeing.iter().filter(|at| at.is_firm);
        let closure = |at: &Agreement| {
            let view = &walk[at.view].view;
            let likeness = view.likenesses[at.likeness].clone();
            likeness.closure(view.place, coordinates, verdict).filter(|_| !view.likenesses[at.likeness].decided)
        };
        let closures = firm.filter_map(closure).collect();
        self.stretch.clear(); // what it was compared with lies elsewhere now
        Found { first: walk[best.begin].view.place, motion: best.hypothesis.motion, agreed, log_odds, closures }
    }
}

/// A motion by which the robot may have been carried.
struct Carried {
    /// Number of the first view since.
    begin: usize,
    hypothesis: Hypothesis,
    /// Logarithms of what speaks for it, and for all else together.
    weight: f64,
    against: f64,
    /// The logarithm of what speaks for having been carried to a place never seen.
    lost: f64,
}

impl Hindsight {
    /// The views from number `begin` on, numbered.
    fn since(&self, begin: usize) -> impl Iterator<Item = (usize, &View)> {
        self.walk.iter().map(|passed| &passed.view).enumerate().skip(begin)
    }

    /// The motions for which most views find an old place that looks like them, the most first.
    fn elected(&self, coordinates: &Coordinates, turned: bool) -> Vec<Isometry2<f64>> {
        let Some(newest) = self.walk.back() else { return Vec::new() };
        let at = |place: PlaceId| coordinates.map_from_place(place).translation.vector;
        let here = Point2::from(at(newest.view.place));
        let voters: Vec<&Passed> = self.walk.iter().rev().take(VOTERS).collect();
        let votes = |motion: &Isometry2<f64>| {
            let is_there = |voter: &&&Passed| {
                let spot = motion * Point2::from(at(voter.view.place));
                voter.alike.iter().any(|known| (at(*known) - spot.coords).norm_squared() < VOTED_WITHIN.powi(2))
            };
            voters.iter().filter(is_there).count()
        };
        let moves = |motion: &Isometry2<f64>| (motion * here - here).norm() > VOTED_WITHIN;
        let proposed = if turned { self.turning(&at) } else { self.shifting(&at) };
        let counted = proposed.into_iter().filter(moves).map(|motion| (votes(&motion), motion));
        let mut counted: Vec<(usize, Isometry2<f64>)> = counted.filter(|(votes, _)| *votes >= VOTES).collect();
        counted.sort_by_key(|(votes, _)| std::cmp::Reverse(*votes));
        let mut elected: Vec<Isometry2<f64>> = Vec::new();
        for (_, motion) in counted {
            let is_new = |other: &Isometry2<f64>| (motion * here - other * here).norm() > VOTED_WITHIN;
            if elected.len() < LOOKED_AT && elected.iter().all(is_new) {
                elected.push(motion);
            }
        }
        elected
    }

    /// Motions without a turn that put one of the last views on an old place that looks like it.
    fn shifting(&self, at: &impl Fn(PlaceId) -> Vector2<f64>) -> Vec<Isometry2<f64>> {
        let last = self.walk.iter().rev().take(2);
        let shifts = last.flat_map(|passed| passed.alike.iter().map(|known| at(*known) - at(passed.view.place)));
        shifts.map(|shift| Isometry2::translation(shift.x, shift.y)).collect()
    }

    /// Motions that put both the newest view and an earlier one on old places that look like them.
    fn turning(&self, at: &impl Fn(PlaceId) -> Vector2<f64>) -> Vec<Isometry2<f64>> {
        let mut last = self.walk.iter().rev();
        let (Some(newest), Some(earlier)) = (last.next(), last.nth(APART)) else { return Vec::new() };
        let (here, there) = (at(newest.view.place), at(earlier.view.place));
        let way = here - there;
        let mut motions = Vec::new();
        for a in newest.alike.iter().take(ALIKE_AT_AN_END) {
            for b in earlier.alike.iter().take(ALIKE_AT_AN_END) {
                let old_way = at(*a) - at(*b);
                if (old_way.norm() - way.norm()).abs() < VOTED_WITHIN && way.norm() > 2.0 * VOTED_WITHIN {
                    let rotation = Rotation2::rotation_between(&way, &old_way);
                    let shift = 0.5 * (at(*a) + at(*b)) - rotation * (0.5 * (here + there));
                    motions.push(Isometry2::new(shift, rotation.angle()));
                }
            }
        }
        motions
    }
}

/// Whether a place came long enough before another to be compared with it.
fn is_older(known: PlaceId, place: PlaceId) -> bool {
    known.0 + OLD < place.0
}

/// Whether nothing holds the axes of a place.
fn turns(map: &TopoMap<Arc<Signature>>, place: PlaceId) -> bool {
    map.links_of(place).any(|link| link.displacement.turn.is_some())
}

#[cfg(test)]
mod tests {
    use topo_map::Displacement;

    use super::*;

    /// Forty old places along a line, a metre apart, and thirty new ones that the coordinates have 7 m beside it.
    fn coordinates() -> Coordinates {
        let mut coordinates = Coordinates::default();
        coordinates.place(PlaceId(0), None);
        for number in 1..70_u32 {
            let (x, y) = if number < 40 { (number, 0.0) } else { (number - 40, 7.0) };
            let at = Displacement::isotropic(Vector2::new(f64::from(x), y), 0.01);
            coordinates.place(PlaceId(number), Some((PlaceId(0), &at)));
        }
        coordinates
    }

    /// A walk over the new places, each of which looks like the old ones that `alike` names.
    fn walk(alike: impl Fn(u32) -> Vec<u32>) -> Hindsight {
        let passed = |number: u32| Passed {
            view: View { place: PlaceId(40 + number), likenesses: Vec::new(), most_agreed: 0 },
            alike: alike(number).into_iter().map(PlaceId).collect(),
            by_scans: OnceCell::new(),
        };
        Hindsight { walk: (0..30).map(passed).collect() }
    }

    #[test]
    fn a_motion_that_most_views_ask_for_is_elected() {
        // Two of three views find the place 5 m farther along the line, among others.
        let walk = walk(|number| if number % 3 == 0 { vec![3, 35] } else { vec![20, number + 5] });
        let shift = |motion: &Isometry2<f64>| motion.translation.vector;
        let by_compass: Vec<Vector2<f64>> = walk.elected(&coordinates(), false).iter().map(shift).collect();
        assert_eq!(by_compass, [Vector2::new(5.0, -7.0)]);
        let turning = walk.elected(&coordinates(), true);
        approx::assert_relative_eq!(shift(&turning[0]), Vector2::new(5.0, -7.0), epsilon = 1.5);
    }

    #[test]
    fn views_that_look_like_this_and_that_elect_nothing() {
        let walk = walk(|number| vec![(number * 17) % 40, (number * 29 + 11) % 40]);
        assert!(walk.elected(&coordinates(), false).is_empty());
        assert!(walk.elected(&coordinates(), true).is_empty());
    }
}

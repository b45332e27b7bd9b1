mod anywhere;
mod closure;
pub(crate) mod hindsight;
mod pieces;
pub(crate) mod proposals;
pub(crate) mod reach;
pub(crate) mod sight;
mod stretch;
pub(crate) mod verify;

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::{Isometry2, Matrix2};
use robot_log::local_grid::{AlignOptions, Alignment, Ambiguity, Descriptor, Signature, align, unseen_by_sonar};
use topo_map::{Displacement, LinkId, Place, PlaceId, SignatureIndex, TopoMap, Turn};

use crate::config::Config;
use crate::coordinates::Coordinates;
use crate::recognize::reach::{Chains, Held, Reach, reach_from};
pub use closure::{Closure, Verdict};
use hindsight::Hindsight;
use pieces::Pieces;
use stretch::{Agreement, Doubt, Hypothesis, OVERLAP, UNLIKE, Weighing};
pub(crate) use stretch::{Likeness, View};

/// Decides which places are the same: gate by coordinates, look by signature, wait for agreement.
///
/// A false recognition is the worst error of the whole system, and a single view proves nothing: corridors look like
/// corridors. So the recognizer weighs a whole **stretch**, the last few places together. If the robot is somewhere
/// that it knows, one motion `u` (a shift, and a turn where no compass holds it) moves the whole stretch onto old places;
/// every view in it is evidence for some motions and against others:
///
/// ```text
/// log p(u | views) = −½ uᵀ Σ⁻¹ u + Σ_n  max_c [ log Λ(n, c) − ½ |z_nc ⊖ u|²_C ]      c: old places near x_n moved by u
/// ```
///
/// `Λ` is the likelihood ratio of the alignment's score, `z_nc` the displacement that the alignment measures and `C` its
/// covariance, long along a corridor; `Σ` is how far the coordinates may be wrong, which follows from what holds the robot's
/// pose ([`Held`]) and shrinks as loops close. Two views agree on one motion exactly where the loop through both closes, so
/// that this is the test of pairwise consistency (Mangelson et al. 2018), with each view weighed instead of voting; the
/// coordinates hold nothing yet of what is weighed. A view that fails to look like an old place on top of which it would lie
/// speaks against. What is believed must be a hundred times likelier than all other motions and "never been here" together.
#[derive(Debug)]
pub(crate) struct Recognizer {
    floor: f64,
    agreement: usize,
    gate_sigma: f64,
    spacing: f64,
    align: AlignOptions,
    stretch: VecDeque<View>,
    hindsight: Hindsight,
    /// What every completed place looks like, in few numbers: for headings that hold, and in ones that no turn changes.
    oriented: SignatureIndex,
    unturned: SignatureIndex,
    pieces: Pieces,
    chains: Chains,
    spent: Duration,
}

/// How far views can be believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sensing {
    /// Walls are seen where they are.
    Faithful,
    /// Walls echo only at the foot of the perpendicular: along a corridor nothing is seen, see [`unseen_by_sonar`].
    Specular,
}

/// Where an old place lies and how far from there it may be looked for, in metres and radians.
#[derive(Debug, Clone, Copy)]
struct Gate {
    known: PlaceId,
    distance: f64,
    slack: f64,
    turn_window: f64,
}

/// Places apart by less than this many spacings of travel have nothing to tell each other.
const RECENT_SPACINGS: f64 = 8.0;
/// The farthest that a place is looked for beyond its expected spot, in metres.
const WIDEST_GATE: f64 = 6.0;
/// Places closer than this lie on one spot, in metres.
const SAME_SPOT: f64 = 0.5;
/// Where the robot is known this well, in metres, the old places nearest to it say enough...
const SURE: f64 = 0.6;
/// ...and so many of them.
const ENOUGH: usize = 2;
/// So many more are looked at, the most alike: a bound on the work where very many places may be the one. Far fewer would
/// lose closures (8 lose every seventh on simulated sonar), since what is recognised is a stretch, not its best view.
const LIKELY: usize = 24;
/// The same where the robot was carried, so that any place may be the one; and where its heading is unknown as well, which makes
/// comparing costly.
const LIKELY_ANYWHERE: [usize; 2] = [64, 8];
/// Headings known this well, in radians, do not blur a descriptor: half of one of its 16 sectors.
const ORIENTED: f64 = 0.2;
/// Places in a stretch.
const STRETCH: usize = 10;
/// The same after the robot was carried: offices have rooms that look alike, each of some ten views, but not many in a row.
const STRETCH_ANYWHERE: usize = 30;
/// Views that must agree then.
const AGREEMENT_ANYWHERE: usize = 15;
/// The same where they say that it was not carried after all.
const AGREEMENT_UNMOVED: usize = 8;
/// The least standard deviation of an alignment: half a cell and the walls' own roughness, in metres.
const ALIGNMENT_FLOOR: f64 = 0.12;
/// What the alignment of two sonar views errs by beyond that, in metres: the echoes travel along with the robot.
const SNAP: f64 = 0.3;
/// What the alignment of two sonar views errs by in the turn beyond what it says, in radians: on a log explored without a
/// compass half of the closures by less than 2.3°, a tenth by more than 6°, one in a hundred by more than 13°.
const TURN_ERROR: f64 = 0.1;
/// Log odds against all else from which a motion is believed: one in a hundred.
const BELIEVED: f64 = 4.6;
/// The same where any place may be the one: one in ten thousand.
const BELIEVED_ANYWHERE: f64 = 9.2;

impl Recognizer {
    pub(crate) fn new(config: &Config) -> Self {
        let recognition = &config.recognition;
        Self {
            floor: recognition.floor,
            agreement: recognition.agreement,
            gate_sigma: recognition.gate_sigma,
            spacing: config.places.spacing_m,
            align: AlignOptions::default(),
            stretch: VecDeque::new(),
            hindsight: Hindsight::default(),
            oriented: index(),
            unturned: index(),
            pieces: Pieces::default(),
            chains: Chains::default(),
            spent: Duration::ZERO,
        }
    }

    /// The stretch that ends at the last completed place.
    pub(crate) fn stretch(&self) -> impl Iterator<Item = &View> {
        self.stretch.iter()
    }

    /// Goes on from a stretch.
    pub(crate) fn recall(&mut self, stretch: Vec<View>) {
        self.stretch = stretch.into();
    }

    /// Weighs a completed place, and with it the stretch that ends there; answers the resemblances decided by now.
    pub(crate) fn consider(
        &mut self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        place: PlaceId,
        sensing: Sensing,
        held: Held,
    ) -> Vec<Closure> {
        let begun = Instant::now();
        self.chains.follow(map);
        let mut decided = Vec::new();
        let longest = if self.pieces.is_whole() { STRETCH } else { STRETCH_ANYWHERE };
        let outgrown = (self.stretch.len() + 1).saturating_sub(longest);
        let outgrown = self.stretch.drain(..outgrown);
        decided.extend(outgrown.filter_map(|view| view.forgotten(coordinates, self.agreement)));
        let likenesses = self.compare(map, coordinates, place, sensing, held);
        if let Some(signature) = map.place(place).and_then(|place| place.signature()) {
            self.learn(place, signature);
        }
        self.stretch.push_back(View { place, likenesses, most_agreed: 0 });
        decided.extend(self.decide(map, coordinates, held));
        self.spent += begun.elapsed();
        decided
    }

    /// Time that all recognition took.
    pub(crate) fn spent(&self) -> Duration {
        self.spent
    }

    /// Nothing more will come: what still waits is refused.
    pub(crate) fn finish(&mut self, coordinates: &Coordinates) -> Vec<Closure> {
        let agreement = self.agreement;
        self.stretch.drain(..).filter_map(|view| view.forgotten(coordinates, agreement)).collect()
    }

    /// Compares a place with the old places on which it may lie.
    fn compare(
        &self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        place: PlaceId,
        sensing: Sensing,
        held: Held,
    ) -> Vec<Likeness> {
        // What sonars cannot see along a corridor is the same against every old place.
        let unseen = |new: &Signature| match sensing {
            Sensing::Specular => unseen_by_sonar(new) + Matrix2::identity() * SNAP.powi(2),
            Sensing::Faithful => Matrix2::zeros(),
        };
        let Some(new) = map.place(place).and_then(|place| place.signature()) else { return Vec::new() };
        let at = |place| coordinates.map_from_place(place).translation.vector;
        let here = at(place);
        let is_old = |known: &PlaceId| {
            *known != place && self.pieces.are_one(*known, place) && map.place(*known).is_some_and(Place::is_visited)
        };
        let mut near = coordinates.near(here.into(), WIDEST_GATE + OVERLAP);
        near.retain(is_old);
        let mut gates: Vec<Gate> = Vec::new();
        for (known, reach) in near.iter().zip(reach_from(map, &self.chains, place, &near)) {
            // A spot that was visited many times is compared once, with its first visit that has something to tell.
            let spot = at(*known);
            if gates.iter().all(|other| (at(other.known) - spot).norm() >= SAME_SPOT) {
                gates.extend(reach.and_then(|reach| self.gate(*known, (spot - here).norm(), &reach, held)));
            }
        }
        let by_distance = |a: &Gate, b: &Gate| a.distance.total_cmp(&b.distance).then(a.known.cmp(&b.known));
        gates.sort_by(by_distance);
        if gates.iter().all(|gate| gate.slack < SURE) {
            gates.truncate(ENOUGH);
        }
        self.keep_likely(&mut gates, new);
        gates.extend(self.elsewhere(map, coordinates, place, new));
        let signature = |gate: &Gate| map.place(gate.known).and_then(|known| known.signature());
        let unseen = unseen(new);
        gates.iter().filter_map(|gate| Some(self.look(new, signature(gate)?, gate, &unseen))).collect()
    }

    /// Where coordinates say nothing, since the robot was carried, places are looked for by their looks alone.
    fn elsewhere(
        &self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        place: PlaceId,
        new: &Signature,
    ) -> Vec<Gate> {
        if self.pieces.is_whole() {
            return Vec::new();
        }
        let turns = map.links_of(place).any(|link| link.displacement.turn.is_some());
        let turn_window = if turns { std::f64::consts::PI } else { 0.0 };
        let apart = |known: PlaceId| !self.pieces.are_one(known, place);
        let mut gates: Vec<Gate> = Vec::new();
        // Perhaps it was not carried.
        let here = coordinates.map_from_place(place).translation.vector;
        let distance = |known: PlaceId| (coordinates.map_from_place(known).translation.vector - here).norm();
        let mut near = coordinates.near(here.into(), OVERLAP);
        near.retain(|known| apart(*known) && map.place(*known).is_some_and(Place::is_visited));
        near.sort_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        let turn_as_before = if turns { ORIENTED } else { 0.0 };
        let gate = |known| Gate { known, distance: distance(known), slack: OVERLAP, turn_window: turn_as_before };
        gates.extend(near.into_iter().take(ENOUGH).map(gate));
        for known in self.alike(new, turns, LIKELY_ANYWHERE[usize::from(turns)], apart) {
            let at = |place| coordinates.map_from_place(place).translation.vector;
            let is_new = |other: &Gate| (at(other.known) - at(known)).norm() >= SAME_SPOT;
            if gates.iter().all(is_new) {
                gates.push(Gate { known, distance: 0.0, slack: OVERLAP, turn_window });
            }
        }
        gates
    }

    /// The places that look most alike, in headings that may be turned or not.
    fn alike(&self, new: &Signature, turned: bool, count: usize, wanted: impl Fn(PlaceId) -> bool) -> Vec<PlaceId> {
        let (index, descriptor) = self.looks(new, turned);
        let found = index.nearest(&descriptor.0, count, wanted).unwrap_or_default();
        found.into_iter().map(|found| found.place).collect()
    }

    /// What a place looks like in few numbers, and the index of these.
    fn looks(&self, new: &Signature, turned: bool) -> (&SignatureIndex, Descriptor) {
        match turned {
            true => (&self.unturned, new.turn_invariant_descriptor()),
            false => (&self.oriented, new.descriptor()),
        }
    }

    /// Says which places hang together by measured links, and how, after links of any kind have changed: the robot was carried.
    pub(crate) fn tell_links(&mut self, map: &TopoMap<Arc<Signature>>) {
        self.pieces = Pieces::of(map);
        self.chains = Chains::of(map);
    }

    /// The same after closures were taken back, which costs what they are, unless they may hold the map together.
    pub(crate) fn tell_taken_back(&mut self, map: &TopoMap<Arc<Signature>>, closures: &[LinkId]) {
        closures.iter().filter_map(|id| map.link(*id)).for_each(|link| self.chains.forget(map, link));
        if self.pieces.hang_on_closures() {
            self.pieces = Pieces::of(map);
        }
    }

    /// The same after two places were found to be one.
    pub(crate) fn tell_joined(&mut self, map: &TopoMap<Arc<Signature>>, place: PlaceId, known: PlaceId) {
        if !self.pieces.are_one(place, known) {
            self.pieces = Pieces::of(map);
        }
    }

    /// Where a closure joins pieces that did not hang together: the places to be moved, and how.
    pub(crate) fn apart(&self, closure: &Closure, coordinates: &Coordinates) -> Option<(Vec<PlaceId>, Isometry2<f64>)> {
        let Closure { place, known, displacement, .. } = closure;
        if self.pieces.are_one(*place, *known) {
            return None;
        }
        let (at, there) = (coordinates.map_from_place(*place), coordinates.map_from_place(*known));
        let measured = displacement.from_place_from_to_place();
        let motion = stretch::motion(&at, &there, &measured, displacement.turn.is_some());
        // The first place holds the map where it is.
        let (moves, motion) =
            if self.pieces.are_one(*place, PlaceId(0)) { (known, motion.inverse()) } else { (place, motion) };
        let count = u32::try_from(coordinates.positions().len()).unwrap_or(u32::MAX);
        let moving = (0..count).map(PlaceId).filter(|other| self.pieces.are_one(*other, *moves));
        Some((moving.collect(), motion))
    }

    /// How far a place may lie from an old one; `None` where they cannot be the same or have nothing to tell each other.
    fn gate(&self, known: PlaceId, distance: f64, reach: &Reach, held: Held) -> Option<Gate> {
        let slack = (self.gate_sigma * held.variance(reach).sqrt()).min(WIDEST_GATE);
        let turn_window = (3.0 * reach.turn_variance.sqrt()).min(std::f64::consts::PI);
        let possible = reach.path >= RECENT_SPACINGS * self.spacing && distance <= slack + OVERLAP;
        possible.then_some(Gate { known, distance, slack, turn_window })
    }

    /// Of many gates those nearest by coordinates, and those that the index of signatures finds most alike.
    fn keep_likely(&self, gates: &mut Vec<Gate>, new: &Signature) {
        if gates.len() <= ENOUGH + LIKELY {
            return;
        }
        let turned = gates.iter().any(|gate| gate.turn_window > ORIENTED);
        let (index, descriptor) = self.looks(new, turned);
        let alike = index.nearest_among(&descriptor.0, LIKELY, gates.iter().map(|gate| gate.known)).unwrap_or_default();
        let mut kept = 0;
        gates.retain(|gate| {
            kept += 1;
            kept <= ENOUGH || alike.iter().any(|found| found.place == gate.known)
        });
    }

    /// Remembers what a completed place looks like.
    pub(crate) fn learn(&mut self, place: PlaceId, signature: &Signature) {
        let learnt = self.oriented.insert(place, &signature.descriptor().0);
        let learnt = learnt.and(self.unturned.insert(place, &signature.turn_invariant_descriptor().0));
        debug_assert!(learnt.is_ok(), "descriptors have one length and finite numbers");
    }

    /// Compares two signatures near their centres, whatever the coordinates say: those judge the shift, not the view.
    fn look(&self, new: &Signature, old: &Signature, gate: &Gate, unseen: &Matrix2<f64>) -> Likeness {
        let reach = (gate.distance + gate.slack).min(OVERLAP) + 0.4;
        let alignment = align(new, old, &AlignOptions { reach, turn_window: gate.turn_window, ..self.align.clone() });
        let log_ratio = self.log_ratio(&alignment);
        let displacement = (log_ratio > 0.0).then(|| measured(&alignment, gate.turn_window > 0.0, unseen));
        Likeness { known: gate.known, displacement, log_ratio, score: alignment.score, decided: false }
    }

    /// How many times likelier such a view is at the same place than at another one, as a logarithm.
    ///
    /// Scores of the same place spread around 0.68 ± 0.09, those of others around 0.50 ± 0.16 (measured on simulated
    /// sonar in an office; lasers separate better, so this errs on the side of caution).
    fn log_ratio(&self, alignment: &Alignment) -> f64 {
        if alignment.score < self.floor || alignment.ambiguity == Ambiguity::Everywhere {
            return UNLIKE;
        }
        let normal = |mean: f64, deviation: f64| {
            -0.5 * ((alignment.score.min(0.72) - mean) / deviation).powi(2) - deviation.ln()
        };
        let contradicted = -12.0 * (alignment.contradiction - 0.02).max(0.0);
        (normal(0.68, 0.09) - normal(0.50, 0.16) + contradicted).max(UNLIKE)
    }

    /// Looks for the one motion that explains the stretch, and believes it if nothing else comes near.
    fn decide(&mut self, map: &TopoMap<Arc<Signature>>, coordinates: &Coordinates, held: Held) -> Vec<Closure> {
        let Some(Likeliest { agreeing, log_odds, is_known, stays }) = self.likeliest(map, coordinates, held) else {
            return Vec::new();
        };
        for &Agreement { view, .. } in &agreeing {
            self.stretch[view].most_agreed = self.stretch[view].most_agreed.max(agreeing.len());
        }
        let (agreement, believed) = match is_known {
            true => (self.agreement, BELIEVED),
            false if stays => (self.agreement.max(AGREEMENT_UNMOVED), BELIEVED),
            false => (self.agreement.max(AGREEMENT_ANYWHERE), BELIEVED_ANYWHERE),
        };
        if agreeing.len() < agreement || log_odds < believed {
            return Vec::new();
        }
        let verdict = Verdict::Accepted { agreed: agreeing.len(), log_odds };
        let mut decided = Vec::new();
        for Agreement { view, likeness, .. } in agreeing.into_iter().filter(|at| at.is_firm) {
            let view = &mut self.stretch[view];
            if std::mem::replace(&mut view.likenesses[likeness].decided, true) {
                continue;
            }
            let likeness = view.likenesses[likeness].clone();
            let mut closure = likeness.closure(view.place, coordinates, verdict);
            if held != Held::Scans
                && let Some(turn) = closure.as_mut().and_then(|closure| closure.displacement.turn.as_mut())
            {
                turn.variance += TURN_ERROR.powi(2);
            }
            decided.extend(closure);
        }
        decided
    }

    /// How surely the old places that look like some views are known from the newest of them.
    fn reach_of<'a>(
        &self,
        map: &TopoMap<Arc<Signature>>,
        views: impl DoubleEndedIterator<Item = &'a View> + Clone,
    ) -> HashMap<PlaceId, Reach> {
        let Some(newest) = views.clone().next_back() else { return HashMap::new() };
        let likenesses = views.flat_map(|view| &view.likenesses);
        let alike = likenesses.filter(|likeness| likeness.displacement.is_some()).map(|likeness| likeness.known);
        let known: Vec<PlaceId> = BTreeSet::from_iter(alike).into_iter().collect();
        let reach = known.iter().copied().zip(reach_from(map, &self.chains, newest.place, &known));
        reach.filter_map(|(place, reach)| Some((place, reach?))).collect()
    }

    /// The likeliest motion of the stretch.
    fn likeliest(&self, map: &TopoMap<Arc<Signature>>, coordinates: &Coordinates, held: Held) -> Option<Likeliest> {
        let newest = self.stretch.back()?.place;
        let reach = self.reach_of(map, self.stretch.iter());
        let weigh = |weighing: Weighing<'_>| weighing.hypotheses().into_iter();
        let begin = self.stretch.len().saturating_sub(STRETCH);
        let views = self.stretch.iter().enumerate().skip(begin);
        let near =
            Weighing::new(views, |known| self.pieces.are_one(known, newest), coordinates, Doubt::Held(held, &reach));
        let mut hypotheses: Vec<Hypothesis> = weigh(near).collect();
        if !self.pieces.is_whole() {
            let (views, doubt) = (self.stretch.iter().enumerate(), Doubt::Anywhere(self.pieces.others(newest)));
            hypotheses.extend(weigh(Weighing::new(
                views,
                |known| !self.pieces.are_one(known, newest),
                coordinates,
                doubt,
            )));
            hypotheses.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
        }
        let mut hypotheses = hypotheses.into_iter();
        let best = hypotheses.next()?;
        let against = 1.0 + hypotheses.map(|other| other.log_weight.exp()).sum::<f64>();
        let is_known = best.agreeing.iter().all(|at| self.pieces.are_one(at.known, newest));
        Some(Likeliest {
            log_odds: best.log_weight - against.ln(),
            agreeing: best.agreeing,
            is_known,
            stays: best.stays,
        })
    }
}

/// What agrees with the likeliest motion of a stretch.
struct Likeliest {
    agreeing: Vec<Agreement>,
    /// Logarithm of its odds against all other motions and none.
    log_odds: f64,
    /// Whether links lead to a place that agrees, so that the coordinates had their say.
    is_known: bool,
    /// Whether the robot would be where its wheels believe, so that it was not carried after all.
    stays: bool,
}

fn index() -> SignatureIndex {
    SignatureIndex::new(Descriptor::LENGTH, 0.0..=1.0).expect("32 numbers between 0 and 1")
}

/// The displacement that an alignment measures.
fn measured(alignment: &Alignment, turns: bool, unseen: &Matrix2<f64>) -> Displacement {
    let floor = Matrix2::identity() * ALIGNMENT_FLOOR.powi(2) + unseen;
    let covariance = alignment.covariance.fixed_view::<2, 2>(0, 0).into_owned() + floor;
    let turn = turns.then(|| Turn { change: alignment.turn, variance: alignment.covariance[(2, 2)] + 1e-4 });
    Displacement { vector: alignment.offset, covariance, turn }.symmetric()
}

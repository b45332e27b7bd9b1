mod closure;
pub(crate) mod proposals;
pub(crate) mod reach;
pub(crate) mod sight;
mod stretch;
pub(crate) mod verify;

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::Matrix2;
use robot_log::local_grid::{AlignOptions, Alignment, Ambiguity, Descriptor, Signature, align, unseen_by_sonar};
use topo_map::{Displacement, PlaceId, SignatureIndex, TopoMap, Turn};

use crate::config::Config;
use crate::coordinates::Coordinates;
use crate::recognize::reach::{Held, Reach, reach_from};
pub use closure::{Closure, Verdict};
use stretch::{Agreement, OVERLAP, UNLIKE, Weighing};
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
    /// What every completed place looks like, in few numbers: for headings that hold, and in ones that no turn changes.
    oriented: SignatureIndex,
    unturned: SignatureIndex,
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
/// Headings known this well, in radians, do not blur a descriptor: half of one of its 16 sectors.
const ORIENTED: f64 = 0.2;
/// Places in a stretch.
const STRETCH: usize = 10;
/// The least standard deviation of an alignment: half a cell and the walls' own roughness, in metres.
const ALIGNMENT_FLOOR: f64 = 0.12;
/// What the alignment of two sonar views errs by beyond that, in metres: the echoes travel along with the robot.
const SNAP: f64 = 0.3;
/// Log odds against all else from which a motion is believed: one in a hundred.
const BELIEVED: f64 = 4.6;

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
            oriented: index(),
            unturned: index(),
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
        let mut decided = Vec::new();
        if self.stretch.len() == STRETCH
            && let Some(view) = self.stretch.pop_front()
        {
            decided.extend(view.forgotten(coordinates, self.agreement));
        }
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
        let near = |known: &PlaceId| (at(*known) - here).norm() <= WIDEST_GATE + OVERLAP;
        let old = map.places().iter().filter(|known| known.id != place && known.is_visited()).map(|known| known.id);
        let near: Vec<PlaceId> = old.filter(near).collect();
        let mut gates: Vec<Gate> = Vec::new();
        for (known, reach) in near.iter().zip(reach_from(map, place, &near)) {
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
        let signature = |gate: &Gate| map.place(gate.known).and_then(|known| known.signature());
        let unseen = unseen(new);
        gates.iter().filter_map(|gate| Some(self.look(new, signature(gate)?, gate, &unseen))).collect()
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
        let gated: Vec<PlaceId> = gates.iter().map(|gate| gate.known).collect();
        let turned = gates.iter().any(|gate| gate.turn_window > ORIENTED);
        let (index, descriptor) = match turned {
            true => (&self.unturned, new.turn_invariant_descriptor()),
            false => (&self.oriented, new.descriptor()),
        };
        let alike = index.nearest(&descriptor.0, LIKELY, |place| gated.contains(&place)).unwrap_or_default();
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
        let Some((agreeing, log_odds)) = self.likeliest(map, coordinates, held) else { return Vec::new() };
        for &Agreement { view, .. } in &agreeing {
            self.stretch[view].most_agreed = self.stretch[view].most_agreed.max(agreeing.len());
        }
        if agreeing.len() < self.agreement || log_odds < BELIEVED {
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
            decided.extend(likeness.closure(view.place, coordinates, verdict));
        }
        decided
    }

    /// What agrees with the likeliest motion of the stretch, and the logarithm of its odds against all others and none.
    fn likeliest(
        &self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        held: Held,
    ) -> Option<(Vec<Agreement>, f64)> {
        let newest = self.stretch.back()?.place;
        let likenesses = self.stretch.iter().flat_map(|view| &view.likenesses);
        let alike = likenesses.filter(|likeness| likeness.displacement.is_some()).map(|likeness| likeness.known);
        let known: Vec<PlaceId> = BTreeSet::from_iter(alike).into_iter().collect();
        let reach = known.iter().copied().zip(reach_from(map, newest, &known));
        let reach: HashMap<PlaceId, Reach> = reach.filter_map(|(place, reach)| Some((place, reach?))).collect();
        let mut hypotheses = Weighing::new(&self.stretch, coordinates, &reach, held).hypotheses().into_iter();
        let best = hypotheses.next()?;
        let against = 1.0 + hypotheses.map(|other| other.log_weight.exp()).sum::<f64>();
        Some((best.agreeing, best.log_weight - against.ln()))
    }
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

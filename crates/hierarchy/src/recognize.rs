use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::{Matrix2, Vector2};
use robot_log::local_grid::{AlignOptions, Alignment, Ambiguity, Descriptor, Signature, align, unseen_by_sonar};
use topo_map::{Displacement, PlaceId, SignatureIndex, TopoMap, Turn};

use crate::config::Config;
use crate::coordinates::Coordinates;
use crate::reach::{Reach, reach_from};

/// Decides which places are the same: gate by coordinates, look by signature, wait for agreement.
///
/// A false recognition is the worst error of the whole system, and a single view proves nothing: corridors look like
/// corridors. So the recognizer weighs a whole **stretch**, the last few places together. If the robot is somewhere
/// that it knows, one shift `Δ` moves the whole stretch onto old places; every view in it is evidence for some shifts
/// and against others:
///
/// ```text
/// log p(Δ | views) = −|Δ|² / 2σ² + Σ_n  max_c [ log Λ(n, c) − ½ |Δ − Δ_nc|²_C ]      c: old places near x_n + Δ
/// ```
///
/// `Λ` is the likelihood ratio of the alignment's score, `Δ_nc` the shift that the alignment measures and `C` its
/// covariance, long along a corridor. Two views agree on one shift exactly where the loop through both closes, so that this
/// is the test of pairwise consistency (Mangelson et al. 2018), with each view weighed instead of voting; the coordinates
/// hold nothing yet of what is weighed. A view that fails to look like an old place on top of which it would lie speaks
/// against. The best shift must be likely by itself and much likelier than any other.
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

/// What was weighed: a place that looks like an older one, and what became of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closure {
    /// The place reached now.
    pub place: PlaceId,
    /// The older place that it looks like.
    pub known: PlaceId,
    /// Where `known` lies as seen from `place`, by the alignment of the two views.
    pub displacement: Displacement,
    /// Similarity of the views, in `[0, 1]`.
    pub score: f64,
    /// Distance between where the alignment and where the coordinates of that moment put the place, in metres.
    pub shift: f64,
    /// Whether it is believed.
    pub verdict: Verdict,
}

/// Whether a resemblance is believed, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Verdict {
    /// So many successive views agree, with these odds (natural logarithm) against chance and against the next best.
    Accepted {
        /// Views that agree.
        agreed: usize,
        /// Logarithm of the odds against chance.
        log_odds: f64,
    },
    /// A proposal of the robot's own recogniser that the map which explains most of them contradicts.
    Contradicted {
        /// The squared distance at which that map has the two moments, in σ of "the same spot".
        chi2: f64,
    },
    /// Too few successive views agreed while they were remembered.
    NoAgreement {
        /// The most that did.
        agreed: usize,
    },
    /// The views agreed, but the laser scans of the one place do not fit the walls of the other.
    WallsDiffer {
        /// How well they fit, in `[0, 1]`.
        score: f64,
    },
}

impl Closure {
    /// Whether it is believed.
    #[must_use]
    pub fn is_accepted(&self) -> bool {
        matches!(self.verdict, Verdict::Accepted { .. })
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Accepted { agreed, log_odds } => write!(f, "{agreed} views agree, log odds {log_odds:.1}"),
            Self::Contradicted { chi2 } => write!(f, "the map has the two {:.1} σ apart", chi2.sqrt()),
            Self::NoAgreement { agreed } => write!(f, "only {agreed} successive views agreed"),
            Self::WallsDiffer { score } => write!(f, "the walls differ: scans fit with {score:.2}"),
        }
    }
}

/// A place of the stretch with everything that it was compared with.
#[derive(Debug, Clone)]
pub(crate) struct View {
    pub(crate) place: PlaceId,
    pub(crate) likenesses: Vec<Likeness>,
    pub(crate) most_agreed: usize,
}

/// One comparison of a place with an older one.
#[derive(Debug, Clone)]
pub(crate) struct Likeness {
    pub(crate) known: PlaceId,
    /// `known` as seen from the place; absent where the two do not look alike at all.
    pub(crate) displacement: Option<Displacement>,
    pub(crate) log_ratio: f64,
    pub(crate) score: f64,
    pub(crate) decided: bool,
}

/// Where an old place lies and how far from there it may be looked for, in metres and radians.
#[derive(Debug, Clone, Copy)]
struct Gate {
    known: PlaceId,
    distance: f64,
    slack: f64,
    turn_window: f64,
}

/// A shift of the stretch and what speaks for it.
#[derive(Debug, Clone)]
struct Hypothesis {
    shift: Vector2<f64>,
    log_odds: f64,
    agreeing: Vec<(usize, usize)>,
}

/// Places apart by less than this many spacings of travel have nothing to tell each other.
const RECENT_SPACINGS: f64 = 8.0;
/// Share of the path driven that an unknown robot's odometry may be wrong by in the long run: wheels wear, carpets pull.
const SYSTEMATIC: f64 = 0.03;
/// The farthest that a place is looked for beyond its expected spot, in metres.
const WIDEST_GATE: f64 = 6.0;
/// Two signatures share enough to be compared when their centres are no farther apart than this, in metres.
const OVERLAP: f64 = 1.2;
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
/// 99 % of the χ² distribution with two degrees of freedom.
const CHI2_99: f64 = 9.21;
/// Log odds against chance from which a shift is believed: one in a hundred.
const BELIEVED: f64 = 4.6;
/// Log odds by which it must beat any other shift: one in twenty.
const CLEAR: f64 = 3.0;
/// Shifts closer than this are the same, in metres.
const SAME_SHIFT: f64 = 0.8;
/// What a view says that does not look like the old place on which it would lie.
const UNLIKE: f64 = -1.5;

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
    ) -> Vec<Closure> {
        let begun = Instant::now();
        let mut decided = Vec::new();
        if self.stretch.len() == STRETCH
            && let Some(view) = self.stretch.pop_front()
        {
            decided.extend(view.forgotten(coordinates));
        }
        let likenesses = self.compare(map, coordinates, place, sensing);
        if let Some(signature) = map.place(place).and_then(|place| place.signature()) {
            self.learn(place, signature);
        }
        self.stretch.push_back(View { place, likenesses, most_agreed: 0 });
        decided.extend(self.decide(coordinates));
        self.spent += begun.elapsed();
        decided
    }

    /// Time that all recognition took.
    pub(crate) fn spent(&self) -> Duration {
        self.spent
    }

    /// Nothing more will come: what still waits is refused.
    pub(crate) fn finish(&mut self, coordinates: &Coordinates) -> Vec<Closure> {
        self.stretch.drain(..).filter_map(|view| view.forgotten(coordinates)).collect()
    }

    /// Compares a place with the old places on which it may lie.
    fn compare(
        &self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        place: PlaceId,
        sensing: Sensing,
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
                gates.extend(reach.and_then(|reach| self.gate(*known, (spot - here).norm(), &reach)));
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
    fn gate(&self, known: PlaceId, distance: f64, reach: &Reach) -> Option<Gate> {
        let slack = (self.gate_sigma * sigma(reach)).min(WIDEST_GATE);
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

    /// Looks for the one shift that explains the stretch, and believes it if nothing else comes near.
    fn decide(&mut self, coordinates: &Coordinates) -> Vec<Closure> {
        let mut hypotheses = self.hypotheses(coordinates);
        hypotheses.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        let Some(best) = hypotheses.first().map(|best| self.refined(best, coordinates)) else { return Vec::new() };
        for &(view, _) in &best.agreeing {
            self.stretch[view].most_agreed = self.stretch[view].most_agreed.max(best.agreeing.len());
        }
        let rival = hypotheses.iter().find(|other| (other.shift - best.shift).norm() > SAME_SHIFT);
        let clear = rival.is_none_or(|rival| best.log_odds - rival.log_odds.max(0.0) >= CLEAR);
        if best.agreeing.len() < self.agreement || best.log_odds < BELIEVED || !clear {
            return Vec::new();
        }
        let verdict = Verdict::Accepted { agreed: best.agreeing.len(), log_odds: best.log_odds };
        let mut decided = Vec::new();
        for (view, likeness) in best.agreeing {
            let view = &mut self.stretch[view];
            if std::mem::replace(&mut view.likenesses[likeness].decided, true) {
                continue;
            }
            let likeness = view.likenesses[likeness].clone();
            decided.extend(likeness.closure(view.place, coordinates, verdict));
        }
        decided
    }

    /// The shift that each likeness of the stretch proposes, judged by the whole stretch.
    fn hypotheses(&self, coordinates: &Coordinates) -> Vec<Hypothesis> {
        let proposals = self.stretch.iter().flat_map(|view| {
            view.likenesses.iter().filter_map(|likeness| {
                likeness
                    .displacement
                    .as_ref()
                    .map(|measured| shift(view.place, likeness.known, measured, coordinates).0)
            })
        });
        let proposals: Vec<Vector2<f64>> = proposals.collect();
        proposals.into_iter().map(|shift| self.judge(shift, coordinates)).collect()
    }

    /// The shift that the agreeing views mean together, if it explains the stretch better than that of one view.
    fn refined(&self, best: &Hypothesis, coordinates: &Coordinates) -> Hypothesis {
        let (mut information, mut sum) = (Matrix2::zeros(), Vector2::zeros());
        for &(view, likeness) in &best.agreeing {
            let view = &self.stretch[view];
            let likeness = &view.likenesses[likeness];
            let Some(measured) = &likeness.displacement else { continue };
            let (own, covariance) = shift(view.place, likeness.known, measured, coordinates);
            let weight = covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
            information += weight;
            sum += weight * own;
        }
        let mean = information.try_inverse().map_or(best.shift, |covariance| covariance * sum);
        let refined = self.judge(mean, coordinates);
        if refined.log_odds > best.log_odds { refined } else { best.clone() }
    }

    fn judge(&self, proposed: Vector2<f64>, coordinates: &Coordinates) -> Hypothesis {
        let mut hypothesis = Hypothesis { shift: proposed, log_odds: 0.0, agreeing: Vec::new() };
        for (index, view) in self.stretch.iter().enumerate() {
            let lands = coordinates.map_from_place(view.place).translation.vector + proposed;
            let mut best: Option<(f64, Option<usize>)> = None;
            for (number, likeness) in view.likenesses.iter().enumerate() {
                let apart = (coordinates.map_from_place(likeness.known).translation.vector - lands).norm();
                if apart > OVERLAP {
                    continue;
                }
                let (says, agrees) = likeness.says(view.place, proposed, coordinates);
                if best.is_none_or(|(other, _)| says > other) {
                    best = Some((says, agrees.then_some(number)));
                }
            }
            let Some((says, agrees)) = best else { continue };
            hypothesis.log_odds += says;
            hypothesis.agreeing.extend(agrees.map(|number| (index, number)));
        }
        hypothesis
    }
}

impl View {
    /// What becomes of the resemblances that never found agreement: the most alike one is reported as refused.
    fn forgotten(self, coordinates: &Coordinates) -> Option<Closure> {
        let accepted = self.likenesses.iter().any(|likeness| likeness.decided);
        let verdict = if accepted { return None } else { Verdict::NoAgreement { agreed: self.most_agreed.max(1) } };
        let alike = self.likenesses.into_iter().filter(|likeness| likeness.displacement.is_some());
        let best = alike.max_by(|a, b| a.score.total_cmp(&b.score).then(b.known.cmp(&a.known)))?;
        best.closure(self.place, coordinates, verdict)
    }
}

impl Likeness {
    /// What this comparison says of a shift, and whether it agrees with it.
    fn says(&self, place: PlaceId, proposed: Vector2<f64>, coordinates: &Coordinates) -> (f64, bool) {
        let Some(measured) = &self.displacement else { return (UNLIKE, false) };
        let (own, covariance) = shift(place, self.known, measured, coordinates);
        let off = proposed - own;
        let chi2 = covariance.try_inverse().map_or(f64::INFINITY, |i| (off.transpose() * i * off)[0]);
        ((self.log_ratio - 0.5 * chi2).max(UNLIKE), chi2 < CHI2_99)
    }

    fn closure(self, place: PlaceId, coordinates: &Coordinates, verdict: Verdict) -> Option<Closure> {
        let displacement = self.displacement?;
        let shift = shift(place, self.known, &displacement, coordinates).0.norm();
        Some(Closure { place, known: self.known, displacement, score: self.score, shift, verdict })
    }
}

fn index() -> SignatureIndex {
    SignatureIndex::new(Descriptor::LENGTH, 0.0..=1.0).expect("32 numbers between 0 and 1")
}

/// By how much a place would have to move, in the map, for an alignment to hold; with its covariance.
fn shift(
    place: PlaceId,
    known: PlaceId,
    measured: &Displacement,
    coordinates: &Coordinates,
) -> (Vector2<f64>, Matrix2<f64>) {
    let (map_from_place, map_from_known) = (coordinates.map_from_place(place), coordinates.map_from_place(known));
    // The old place's axes hold; those of the new one follow from the measured turn.
    let turn = map_from_known.rotation.angle() - measured.turn.map_or(0.0, |turn| turn.change);
    let turn = nalgebra::Rotation2::new(if measured.turn.is_some() { turn } else { map_from_place.rotation.angle() });
    let lands = map_from_known.translation.vector - turn * measured.vector;
    let covariance = turn.matrix() * measured.covariance * turn.matrix().transpose();
    (lands - map_from_place.translation.vector, covariance)
}

/// How uncertain the relative position of two places is, in metres.
fn sigma(reach: &Reach) -> f64 {
    (reach.position_variance + (SYSTEMATIC * reach.path).powi(2)).sqrt()
}

/// The displacement that an alignment measures.
fn measured(alignment: &Alignment, turns: bool, unseen: &Matrix2<f64>) -> Displacement {
    let floor = Matrix2::identity() * ALIGNMENT_FLOOR.powi(2) + unseen;
    let covariance = alignment.covariance.fixed_view::<2, 2>(0, 0).into_owned() + floor;
    let turn = turns.then(|| Turn { change: alignment.turn, variance: alignment.covariance[(2, 2)] + 1e-4 });
    Displacement { vector: alignment.offset, covariance, turn }.symmetric()
}

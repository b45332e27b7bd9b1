mod clique;
mod closure;

use crate::{Displacement, PathTree, PlaceId};

pub use clique::largest_consistent_set;
pub use closure::{Closure, Reason, Verdict};

/// The settings of the loop test.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct LoopOptions {
    /// The greatest squared Mahalanobis distance between a recognition and what odometry says of the same two places.
    pub odometry_gate: f64,
    /// The same between two recognitions and the two ways that join them.
    pub pairwise_gate: f64,
    /// How many recognitions must agree, each at a place of its own, before they are believed.
    pub agreement: usize,
    /// Recognitions that confirm each other lie at least this far apart, in metres: one view is no witness of itself.
    pub separation: f64,
    /// Recognitions that confirm each other lie at most so many steps of the way apart: over long ways odometry grows
    /// so uncertain that almost anything would agree.
    pub span: usize,
    /// After so many further places a recognition that found no agreement is rejected.
    pub patience: usize,
}

impl Default for LoopOptions {
    /// The 99 % points of χ² with three degrees of freedom for pairs (they are read with two where headings are known),
    /// 99.9 % against odometry, and two recognitions that agree.
    fn default() -> Self {
        Self { odometry_gate: 16.266, pairwise_gate: 11.345, agreement: 2, separation: 0.5, span: 12, patience: 8 }
    }
}

/// The robot's view at `from` looks like that of `to`: a loop that is not believed yet.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LoopCandidate {
    /// Where the robot was when it saw the likeness.
    pub from: PlaceId,
    /// The older place that it looked like.
    pub to: PlaceId,
    /// Where `to` lies as seen from `from`, by the alignment of the two views.
    pub displacement: Displacement,
    /// How well the views fit, in the units of the caller; for reports, and to choose between equals.
    pub score: f64,
}

/// Collects recognitions that would close a loop, and lets through only those that odometry and other recognitions bear
/// out: pairwise consistency (Mangelson et al. 2018), and agreement over successive places.
///
/// For two recognitions `a → b` and `c → d` the loop `a → c → d → b → a` must close. In a compass frame, with `o` the
/// displacement along the way driven and `t` that of the recognition,
///
/// ```text
/// e = (o_ac + t_cd) − (t_ab + o_bd),   eᵀ C⁻¹ e < gate
/// ```
///
/// where `C` is the sum of the four covariances; where headings are uncertain `e` is composed in SE(2) and has the
/// error of the turn for a third number. Way that both sides share makes `C` too large, which errs on the side of caution
/// only as long as `C` stays small against the map: [`LoopOptions::span`] sees to that.
#[derive(Debug, Clone)]
pub struct LoopPool {
    options: LoopOptions,
    pending: Vec<Pending>,
    accepted: Vec<LoopCandidate>,
    /// How many places the robot has come to.
    clock: usize,
}

#[derive(Debug, Clone, Copy)]
struct Pending {
    candidate: LoopCandidate,
    residual: f64,
    since: usize,
}

/// How many of the latest believed loops a new group is compared with; bounds the time that a recognition takes.
const COMPARED: usize = 64;

impl LoopPool {
    /// A pool without recognitions.
    #[must_use]
    pub fn new(options: LoopOptions) -> Self {
        Self { options, pending: Vec::new(), accepted: Vec::new(), clock: 0 }
    }

    /// The recognitions that were believed, in the order in which they were.
    #[must_use]
    pub fn accepted(&self) -> &[LoopCandidate] {
        &self.accepted
    }

    /// The recognitions that wait for others to agree.
    pub fn pending(&self) -> impl Iterator<Item = &LoopCandidate> + '_ {
        self.pending.iter().map(|pending| &pending.candidate)
    }

    /// The robot has come to the next place: recognitions that waited too long are rejected.
    pub fn advance(&mut self) -> Vec<Closure> {
        self.clock += 1;
        let oldest = self.clock.saturating_sub(self.options.patience);
        self.reject_older_than(oldest)
    }

    /// Nothing more will come: all that wait are rejected.
    pub fn finish(&mut self) -> Vec<Closure> {
        self.reject_older_than(usize::MAX)
    }

    fn reject_older_than(&mut self, oldest: usize) -> Vec<Closure> {
        let (late, waiting): (Vec<_>, Vec<_>) = self.pending.iter().partition(|pending| pending.since < oldest);
        self.pending = waiting;
        late.iter().map(|pending| Closure::rejected(pending.candidate, pending.residual, Reason::NoAgreement)).collect()
    }

    /// A new recognition: answers what is decided by it, for itself and for those that waited.
    ///
    /// Nothing decided means that it waits for others to agree.
    pub fn push(&mut self, candidate: LoopCandidate, path: &PathTree) -> Vec<Closure> {
        let _span = tracing::debug_span!("loop_test", pending = self.pending.len()).entered();
        let refused = |residual, reason| vec![Closure::rejected(candidate, residual, reason)];
        if candidate.from == candidate.to || candidate.displacement.check().is_err() {
            return refused(f64::NAN, Reason::NoMeasurement);
        }
        let Some(odometry) = path.between(candidate.from, candidate.to) else {
            return refused(f64::NAN, Reason::NoWay);
        };
        let residual = mismatch(&odometry, &candidate.displacement);
        if residual > self.options.odometry_gate {
            return refused(residual, Reason::Odometry { gate: self.options.odometry_gate });
        }
        self.pending.push(Pending { candidate, residual, since: self.clock });
        self.settle(path)
    }

    /// Believes the largest group around the newest recognition, if it is large enough and contradicts nothing older.
    fn settle(&mut self, path: &PathTree) -> Vec<Closure> {
        let group = self.group_of_newest(path);
        if group.len() < self.options.agreement.max(1) {
            return Vec::new();
        }
        let members: Vec<Pending> = group.iter().map(|&index| self.pending[index]).collect();
        if let Some(reason) = self.contradiction(&members, path) {
            let newest = self.pending.pop();
            return newest.map(|late| Closure::rejected(late.candidate, late.residual, reason)).into_iter().collect();
        }
        let mut index = 0;
        self.pending.retain(|_| {
            index += 1;
            !group.contains(&(index - 1))
        });
        self.accepted.extend(members.iter().map(|member| member.candidate));
        let agreed = members.len();
        members.iter().map(|member| Closure::accepted(member.candidate, member.residual, agreed)).collect()
    }

    /// The largest set of waiting recognitions that agree with each other and hold the newest, as indices.
    fn group_of_newest(&self, path: &PathTree) -> Vec<usize> {
        let Some(newest) = self.pending.len().checked_sub(1) else { return Vec::new() };
        let all = |i: usize| &self.pending[i].candidate;
        let near: Vec<usize> = (0..newest).filter(|&i| self.supports(all(i), all(newest), path)).collect();
        let chosen = largest_consistent_set(near.len(), |i, j| self.supports(all(near[i]), all(near[j]), path));
        chosen.into_iter().map(|i| near[i]).chain([newest]).collect()
    }

    /// Whether two recognitions confirm each other: apart, but not too far, and consistent.
    fn supports(&self, one: &LoopCandidate, two: &LoopCandidate, path: &PathTree) -> bool {
        let near = |a, b| path.steps_between(a, b).is_some_and(|steps| steps <= self.options.span);
        let apart = path.between(one.from, two.from).is_some_and(|way| way.vector.norm() >= self.options.separation);
        let residual = pairwise_mismatch(one, two, path);
        apart
            && near(one.from, two.from)
            && near(one.to, two.to)
            && residual.is_some_and(|residual| residual <= self.options.pairwise_gate)
    }

    /// Why a group cannot be believed: it contradicts more of the latest believed loops than it agrees with.
    fn contradiction(&self, members: &[Pending], path: &PathTree) -> Option<Reason> {
        let newest = members.last()?.candidate;
        let latest = &self.accepted[self.accepted.len().saturating_sub(COMPARED)..];
        let residuals = latest.iter().filter_map(|known| pairwise_mismatch(&newest, known, path));
        let (mut against, mut total) = (0, 0);
        for residual in residuals {
            total += 1;
            against += usize::from(residual > self.options.pairwise_gate);
        }
        (2 * against > total).then_some(Reason::Contradicted { against, total })
    }
}

/// The squared Mahalanobis length of `(o_ac ∘ t_cd)` against `(t_ab ∘ o_bd)`; `None` where no way joins the two loops.
#[must_use]
pub fn pairwise_mismatch(one: &LoopCandidate, two: &LoopCandidate, path: &PathTree) -> Option<f64> {
    let (ac, bd) = (path.between(one.from, two.from)?, path.between(one.to, two.to)?);
    Some(mismatch(&ac.followed_by(&two.displacement), &one.displacement.followed_by(&bd)))
}

/// The squared Mahalanobis distance of two measurements of one displacement, turns included where there are any.
fn mismatch(one: &Displacement, two: &Displacement) -> f64 {
    let turned = match (one.turn, two.turn) {
        (None, None) => 0.0,
        (a, b) => {
            let change = |turn: Option<crate::Turn>| turn.map_or(0.0, |turn| turn.change);
            let variance = |turn: Option<crate::Turn>| turn.map_or(0.0, |turn| turn.variance);
            let apart = nalgebra::UnitComplex::new(change(b) - change(a)).angle();
            apart * apart / (variance(a) + variance(b))
        }
    };
    one.disagreement(two) + turned
}

use std::collections::BTreeMap;

use nalgebra::{Isometry2, Matrix2, Matrix3, Vector2};
use relaxation::{
    Pose, PoseGraph, PoseOptions, PoseSpring, RobustMethod, RobustOptions, descend, relax_poses_robustly,
};
use topo_map::{Displacement, PlaceId, TopoMap, Turn};

use crate::coordinates::problem::{RelaxationError, isometries, pose_spring};
use crate::evaluate::TimedPath;
use crate::recognize::{Closure, Verdict};
use crate::trajectory::{Anchor, Trajectory};

/// What the robot's own recogniser proposed and nobody has weighed yet.
///
/// Such a recogniser says only that two moments look alike, with a similarity on a scale of its own, and is mostly
/// wrong where that is low. So a proposal is never believed by itself: the largest part of all proposals that one map
/// can explain is looked for, by truncated least squares over the whole pose graph:
///
/// ```text
/// min  χ²(travelled links) + Σ_k min(|p_k|² / σ², c²)        p_k: how far apart the map has the two moments
/// ```
///
/// Similarities count by their rank alone. A few of the most alike give a beginning (graduated non-convexity, which
/// needs no good start); then ever more are let in, twice as many each time, and believed where the map so far has them
/// within `c σ`. Several beginnings are tried, and the one that explains most is kept; but nothing is believed where it
/// explains hardly more than wrong proposals would fit by chance.
#[derive(Debug, Default)]
pub(crate) struct Proposals {
    pending: Vec<Proposal>,
}

/// Two moments that look alike.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Proposal {
    pub(crate) stamp: f64,
    pub(crate) earlier: f64,
    pub(crate) similarity: f64,
}

/// What became of the proposals, and the map that decided.
#[derive(Debug)]
pub(crate) struct Weighed {
    pub(crate) closures: Vec<Closure>,
    /// `None` where nothing is believed.
    pub(crate) poses: Option<Vec<Isometry2<f64>>>,
}

/// A proposal between two places: where the robot stood, as seen from either.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    place: PlaceId,
    known: PlaceId,
    place_from_robot: Vector2<f64>,
    known_from_robot: Vector2<f64>,
    similarity: f64,
}

/// A map and the candidates that it explains.
struct Explanation {
    poses: Vec<Pose>,
    believed: Vec<bool>,
    cost: f64,
}

/// Places apart by less than this many spacings of travel have nothing to tell each other.
const RECENT_SPACINGS: f64 = 8.0;
/// The same in places, which lie a spacing apart.
const RECENT_PLACES: usize = 8;
/// 99 % of the χ² distribution with two degrees of freedom.
const BOUND: f64 = 9.21;
/// Variance in rad² of a turn of which nothing is known: uniform on the circle.
const ANY_TURN: f64 = std::f64::consts::PI * std::f64::consts::PI / 3.0;
/// So many of the most alike proposals make a beginning.
const BEGINNINGS: [usize; 8] = [32, 45, 64, 91, 128, 181, 256, 362];
/// Beginnings that must lead to the same map before no other is tried.
const SAME_END: usize = 3;
/// Standard deviations by which the proposals that a map explains must outnumber those that fit any map by chance.
const BEYOND_CHANCE: f64 = 5.0;
/// Rounds of believing and relaxing for each number of proposals let in.
const ROUNDS: usize = 20;
/// Believed proposals support each other where both of their ends lie within so many places.
const NEAR: u32 = 10;

impl Proposals {
    pub(crate) fn restored(pending: Vec<Proposal>) -> Self {
        Self { pending }
    }

    pub(crate) fn pending(&self) -> &[Proposal] {
        &self.pending
    }

    pub(crate) fn push(&mut self, stamp: f64, earlier: f64, similarity: f64) {
        self.pending.push(Proposal { stamp, earlier, similarity });
    }

    /// Decides all that was proposed; `None` where nothing was, or nothing that says anything.
    pub(crate) fn weigh<S>(
        &mut self,
        map: &TopoMap<S>,
        trajectory: &Trajectory,
        spacing: f64,
    ) -> Result<Option<Weighed>, RelaxationError> {
        let candidates = candidates(&std::mem::take(&mut self.pending), trajectory, spacing);
        if candidates.is_empty() {
            return Ok(None);
        }
        let weighing = Weighing::new(map, candidates, spacing);
        let Some(best) = weighing.best()? else { return Ok(None) };
        let mut closures = weighing.closures(&best);
        if weighing.is_beyond_chance(&best) {
            return Ok(Some(Weighed { closures, poses: Some(isometries(&best.poses)) }));
        }
        let agreed = best.believed.iter().filter(|believed| **believed).count();
        closures.iter_mut().for_each(|closure| closure.verdict = Verdict::NoAgreement { agreed });
        Ok(Some(Weighed { closures, poses: None }))
    }
}

/// The proposals as candidates between places, the most alike first, one for each pair of places.
fn candidates(proposals: &[Proposal], trajectory: &Trajectory, spacing: f64) -> Vec<Candidate> {
    let samples = trajectory.samples().iter();
    let track = TimedPath::new(samples.map(|sample| (sample.stamp, sample.track_from_robot)));
    let mut best: BTreeMap<(PlaceId, PlaceId), Candidate> = BTreeMap::new();
    for proposal in proposals {
        let Some((from, to)) = stood(trajectory, &track, proposal.stamp)
            .zip(stood(trajectory, &track, proposal.earlier))
            .filter(|((from, _), (to, _))| from.travelled - to.travelled >= RECENT_SPACINGS * spacing)
        else {
            continue;
        };
        let candidate = Candidate {
            place: from.0.place,
            known: to.0.place,
            place_from_robot: from.1,
            known_from_robot: to.1,
            similarity: proposal.similarity,
        };
        let slot = best.entry((candidate.place, candidate.known)).or_insert(candidate);
        if candidate.similarity > slot.similarity {
            *slot = candidate;
        }
    }
    let mut candidates: Vec<Candidate> = best.into_values().collect();
    candidates.sort_by(|a, b| b.similarity.total_cmp(&a.similarity));
    candidates
}

/// The anchor at whose place the robot was nearest at a stamp, and where it stood in that place's frame.
fn stood<'a>(trajectory: &'a Trajectory, track: &TimedPath, stamp: f64) -> Option<(&'a Anchor, Vector2<f64>)> {
    let track_from_robot = track.at(stamp)?;
    let after = trajectory.anchors().partition_point(|anchor| anchor.stamp <= stamp);
    let near = trajectory.anchors().get(after.saturating_sub(1)..(after + 1).min(trajectory.anchors().len()))?;
    let seen = |anchor: &'a Anchor| {
        let place_from_track = anchor.place_from_robot * anchor.track_from_robot.inverse();
        (anchor, (place_from_track * track_from_robot).translation.vector)
    };
    near.iter().map(seen).min_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))
}

/// The travelled links and the candidates of one decision.
struct Weighing {
    nodes: usize,
    travelled: Vec<PoseSpring>,
    candidates: Vec<Candidate>,
    /// Whether headings are unknown.
    turns: bool,
    /// Variance of "the same spot", in m²: recognisers tell spots apart that lie about a spacing from each other.
    variance: f64,
}

impl Weighing {
    fn new<S>(map: &TopoMap<S>, candidates: Vec<Candidate>, spacing: f64) -> Self {
        let turns = map.links().iter().any(|link| link.displacement.turn.is_some());
        let travelled = map.links().iter().filter(|link| link.is_measured()).map(pose_spring).collect();
        Self { nodes: map.places().len(), travelled, candidates, turns, variance: (0.5 * spacing).powi(2) }
    }

    /// The explanation of least cost among those that the beginnings lead to.
    fn best(&self) -> Result<Option<Explanation>, RelaxationError> {
        let mut best: Option<Explanation> = None;
        let (mut last, mut same) = (0, 0);
        for count in BEGINNINGS.map(|count| count.min(self.candidates.len())) {
            if count == last {
                break; // all of them have begun already
            }
            last = count;
            let found = self.extend(self.begin(count)?, count)?;
            same += usize::from(best.as_ref().is_some_and(|best| best.believed == found.believed));
            if best.as_ref().is_none_or(|best| found.cost < best.cost && found.believed != best.believed) {
                (best, same) = (Some(found), 1);
            }
            if same == SAME_END {
                break;
            }
        }
        Ok(best)
    }

    /// Whether a map explains clearly more candidates than would fit it if all of them were wrong.
    ///
    /// A wrong candidate joins any two moments, so it fits by chance as often as two places of the map, far apart along
    /// the way, lie on one spot. Warping the map to more of them is what the margin is for.
    fn is_beyond_chance(&self, found: &Explanation) -> bool {
        let reach = BOUND * self.variance;
        let spots: Vec<Vector2<f64>> = found.poses.iter().map(|pose| pose.translation()).collect();
        let (mut pairs, mut near) = (0u64, 0u64);
        for (index, spot) in spots.iter().enumerate() {
            let far = &spots[..index.saturating_sub(RECENT_PLACES)];
            pairs += far.len() as u64;
            near += far.iter().filter(|other| (spot - *other).norm_squared() <= reach).count() as u64;
        }
        #[expect(clippy::cast_precision_loss, reason = "counts below 2⁵³")]
        let by_chance = self.candidates.len() as f64 * near as f64 / pairs.max(1) as f64;
        #[expect(clippy::cast_precision_loss, reason = "counts below 2⁵³")]
        let believed = found.believed.iter().filter(|believed| **believed).count() as f64;
        believed >= by_chance + BEYOND_CHANCE * by_chance.sqrt()
    }

    /// The map that the `count` most alike candidates make among themselves.
    fn begin(&self, count: usize) -> Result<Vec<Pose>, RelaxationError> {
        let chain = PoseGraph::new(self.nodes, &self.travelled)?;
        let odometry = chain.odometry();
        let springs = self.springs(&odometry, |index| index < count);
        let trusted: Vec<bool> = (0..springs.len()).map(|spring| spring < self.travelled.len()).collect();
        let graph = PoseGraph::new(self.nodes, &springs)?;
        let options =
            RobustOptions { method: RobustMethod::TruncatedLeastSquares { bound: BOUND }, ..RobustOptions::default() };
        Ok(relax_poses_robustly(&graph, &trusted, &options, &PoseOptions::default())?.poses)
    }

    /// Lets in the others, twice as many each time.
    fn extend(&self, mut poses: Vec<Pose>, mut count: usize) -> Result<Explanation, RelaxationError> {
        loop {
            let mut believed = Vec::new();
            for _ in 0..ROUNDS {
                let fits = |index: usize| index < count && self.chi2(index, &poses) <= BOUND;
                let now: Vec<bool> = (0..self.candidates.len()).map(fits).collect();
                if now == believed {
                    break;
                }
                believed = now;
                let graph = PoseGraph::new(self.nodes, &self.springs(&poses, |index| believed[index]))?;
                poses = descend(&graph, &poses, &PoseOptions::default())?.poses;
            }
            if count == self.candidates.len() {
                let cost = self.cost(&poses);
                return Ok(Explanation { poses, believed, cost });
            }
            count = (2 * count).min(self.candidates.len());
        }
    }

    /// The truncated cost of all links and candidates.
    fn cost(&self, poses: &[Pose]) -> f64 {
        let driven = self.travelled.iter().map(|spring| spring.chi2(poses[spring.from], poses[spring.to]));
        driven.sum::<f64>() + (0..self.candidates.len()).map(|index| self.chi2(index, poses).min(BOUND)).sum::<f64>()
    }

    /// The squared distance in σ at which a map has the two moments of a candidate.
    fn chi2(&self, index: usize, poses: &[Pose]) -> f64 {
        let candidate = &self.candidates[index];
        let spot = |place: PlaceId, seen: Vector2<f64>| {
            let pose = poses[place.index()];
            pose.translation() + nalgebra::Rotation2::new(pose.heading) * seen
        };
        let here = spot(candidate.place, candidate.place_from_robot);
        (here - spot(candidate.known, candidate.known_from_robot)).norm_squared() / self.variance
    }

    /// The travelled links, and those candidates that are `wanted` as the poses let them be seen.
    fn springs(&self, poses: &[Pose], wanted: impl Fn(usize) -> bool) -> Vec<PoseSpring> {
        let mut springs = self.travelled.clone();
        let diagonal = [1.0 / self.variance, 1.0 / self.variance, 1.0 / ANY_TURN];
        let information = Matrix3::from_diagonal(&diagonal.into());
        springs.extend((0..self.candidates.len()).filter(|index| wanted(*index)).map(|index| {
            let candidate = &self.candidates[index];
            let (from, to) = (candidate.place.index(), candidate.known.index());
            PoseSpring { from, to, from_to: candidate.measured(poses), information }
        }));
        springs
    }

    /// What became of every candidate.
    fn closures(&self, found: &Explanation) -> Vec<Closure> {
        let believed: Vec<&Candidate> =
            self.candidates.iter().zip(&found.believed).filter(|(_, believed)| **believed).map(|(of, _)| of).collect();
        let closure = |(index, candidate): (usize, &Candidate)| {
            let (pose, chi2) = (candidate.measured(&found.poses), self.chi2(index, &found.poses));
            let verdict = if found.believed[index] {
                let agreed = believed.iter().filter(|other| candidate.is_near(other)).count();
                Verdict::Accepted { agreed, log_odds: 0.5 * (BOUND - chi2) }
            } else {
                Verdict::Contradicted { chi2 }
            };
            let displacement = Displacement {
                vector: pose.translation(),
                covariance: Matrix2::identity() * self.variance,
                turn: self.turns.then_some(Turn { change: pose.heading, variance: ANY_TURN }),
            };
            let shift = (chi2 * self.variance).sqrt();
            let Candidate { place, known, similarity, .. } = *candidate;
            Closure { place, known, displacement, score: similarity, shift, verdict }
        };
        self.candidates.iter().enumerate().map(closure).collect()
    }
}

impl Candidate {
    /// The known place as seen from the other one if the robot stood on one spot at both moments, turned as in `poses`.
    fn measured(&self, poses: &[Pose]) -> Pose {
        let turn = relaxation::wrap(poses[self.known.index()].heading - poses[self.place.index()].heading);
        let at = self.place_from_robot - nalgebra::Rotation2::new(turn) * self.known_from_robot;
        Pose::new(at.x, at.y, turn)
    }

    /// Whether two candidates speak of the same stretches of way; every one does with itself.
    fn is_near(&self, other: &Self) -> bool {
        self.place.0.abs_diff(other.place.0) <= NEAR && self.known.0.abs_diff(other.known.0) <= NEAR
    }
}

//! Relaxing a map only as far as a change reaches.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use nalgebra::{Isometry2, Matrix3, Point2, Vector2};
use relaxation::{
    Auto, Network, Pose, PoseGraph, PoseOptions, PoseSpring, RobustMethod, RobustOptions, Solver, Spring, descend,
    relax_poses_robustly_from, relax_robustly,
};
use topo_map::{Link, LinkId, LinkOrigin, PlaceId, TopoMap};

use crate::coordinates::problem::{RelaxationError, pose_spring, spring};

/// The surroundings of a change: places that may move, and those around them that hold still.
///
/// A closure that says what the map knows already moves little, and little of the map: then only these are relaxed, and
/// what lies beyond is held. Whether that was enough shows at the rim: where places next to the held ones moved by more
/// than [`STILL`], more of the map must be let go.
pub(super) struct Part<'a> {
    /// The places that move, then those that are held.
    places: Vec<PlaceId>,
    moving: usize,
    links: Vec<&'a Link>,
}

/// What became of a part.
pub(super) struct Moved {
    /// Where the places that moved are now.
    pub(super) poses: Vec<(PlaceId, Isometry2<f64>)>,
    /// χ² of all links of the part before, and of each of them after.
    pub(super) chi2_before: f64,
    pub(super) chi2: Vec<(LinkId, f64)>,
    /// Whether nothing beyond would have moved, to speak of.
    pub(super) is_enough: bool,
}

/// What truncated least squares says of a part.
pub(super) struct Outvoted {
    /// Recognised links that the others contradict.
    pub(super) links: Vec<LinkId>,
    /// Whether nothing beyond would have moved, to speak of.
    pub(super) is_enough: bool,
}

/// Information in 1/m² and 1/rad² of what nothing moves: a tenth of a millimetre.
const RIGID: f64 = 1e8;
/// What counts as not having moved at the rim of a part of so many places, in metres and radians: a tenth of what a scan
/// knows. It grows with the breadth of a part, since what is left undone at its rim strains the links in between the less the
/// more there are.
const STILL: (f64, f64) = (0.001, 0.001);
const SMALL: f64 = 64.0;
/// The same where a compass holds the headings, since a link knows less of the distance then.
const STILL_BY_COMPASS: f64 = 0.005;
/// The same where it is only to be judged which links contradict the rest: what a scan knows.
const STILL_TO_JUDGE: (f64, f64) = (0.02, 0.01);

impl<'a> Part<'a> {
    /// At most `count` places around the ends of some links, and their rim.
    pub(super) fn around<S>(map: &'a TopoMap<S>, changed: &[LinkId], count: usize) -> Self {
        let ends = changed.iter().filter_map(|id| map.link(*id)).flat_map(|link| [link.from, link.to]);
        let mut seen: BTreeSet<PlaceId> = ends.collect();
        let mut queue: VecDeque<PlaceId> = seen.iter().copied().collect();
        let mut places = Vec::new();
        while let Some(place) = queue.pop_front().filter(|_| places.len() < count) {
            places.push(place);
            for link in map.links_of(place).filter(|link| link.is_measured()) {
                let next = link.other_end(place);
                if seen.insert(next) {
                    queue.push_back(next);
                }
            }
        }
        // The first place holds the map where it is.
        let origin = PlaceId(0);
        places.retain(|place| *place != origin);
        let moving = places.len();
        let inside: BTreeSet<PlaceId> = places.iter().copied().collect();
        let measured = places.iter().flat_map(|place| map.links_of(*place)).filter(|link| link.is_measured());
        let links: BTreeMap<LinkId, &Link> = measured.map(|link| (link.id, link)).collect();
        let rim = links.values().flat_map(|link| [link.from, link.to]).filter(|place| !inside.contains(place));
        let rim: BTreeSet<PlaceId> = rim.collect();
        places.extend(rim);
        Self { places, moving, links: links.into_values().collect() }
    }

    /// How many links there are.
    pub(super) fn len(&self) -> usize {
        self.links.len()
    }

    /// The poses of least energy, given those of the rim.
    pub(super) fn relaxed(&self, pose: impl Fn(PlaceId) -> Isometry2<f64>) -> Result<Moved, RelaxationError> {
        let number = self.numbers();
        let springs: Vec<PoseSpring> = self.links.iter().map(|link| number.spring(link)).collect();
        let before: Vec<Pose> = self.places.iter().map(|place| plain(&pose(*place))).collect();
        let after = if self.turns() { self.descended(&springs, &before)? } else { self.solved(&springs, &before)? };
        let is_enough = self.is_still(&springs, &before, &after, self.still());
        let chi2 = |spring: &PoseSpring, at: &[Pose]| spring.chi2(at[spring.from], at[spring.to]);
        let ids = self.links.iter().map(|link| link.id);
        Ok(Moved {
            poses: self.places[..self.moving]
                .iter()
                .zip(&after)
                .map(|(place, pose)| (*place, Isometry2::new(pose.translation(), pose.heading)))
                .collect(),
            chi2_before: springs.iter().map(|spring| chi2(spring, &before)).sum(),
            chi2: ids.zip(&springs).map(|(id, spring)| (id, chi2(spring, &after))).collect(),
            is_enough,
        })
    }

    /// Which recognised links truncated least squares leaves out when the rim holds still, and whether letting them go would move
    /// nothing beyond.
    pub(super) fn outvoted(
        &self,
        pose: impl Fn(PlaceId) -> Isometry2<f64>,
        bound: f64,
    ) -> Result<Outvoted, RelaxationError> {
        let options =
            RobustOptions { method: RobustMethod::TruncatedLeastSquares { bound }, ..RobustOptions::default() };
        let number = self.numbers();
        let springs: Vec<PoseSpring> = self.links.iter().map(|link| number.spring(link)).collect();
        let before: Vec<Pose> = self.places.iter().map(|place| plain(&pose(*place))).collect();
        let mut trusted: Vec<bool> = self.links.iter().map(|link| link.origin != LinkOrigin::Recognized).collect();
        let (rejected, after) = if self.turns() {
            let (graph, start) = self.with_rest(&springs, &before)?;
            trusted.resize(graph.springs().len(), true);
            let robust = relax_poses_robustly_from(&graph, &start, &trusted, &options, &PoseOptions::default())?;
            (robust.rejected, robust.poses[1..].to_vec())
        } else {
            let (network, _) = self.contracted(&springs, &before)?;
            let robust = relax_robustly(&network, &trusted, &options)?;
            (robust.rejected, self.put(&before, &robust.positions))
        };
        let links = rejected.into_iter().map(|k| self.links[k].id).collect();
        Ok(Outvoted { links, is_enough: self.is_still(&springs, &before, &after, STILL_TO_JUDGE) })
    }

    fn turns(&self) -> bool {
        self.links.iter().any(|link| link.displacement.turn.is_some())
    }

    fn numbers(&self) -> Numbers {
        Numbers(self.places.iter().copied().zip(0..).collect())
    }

    /// Whether nothing next to the rim has moved farther than that, in metres and radians; there must be a rim.
    fn is_still(&self, springs: &[PoseSpring], before: &[Pose], after: &[Pose], still: (f64, f64)) -> bool {
        let shifted = |place: usize| {
            let (a, b) = (&before[place], &after[place]);
            let off = (a.translation() - b.translation()).norm();
            off > still.0 || relaxation::wrap(a.heading - b.heading).abs() > still.1
        };
        let mut at_rim = springs.iter().filter(|spring| spring.from.max(spring.to) >= self.moving);
        let has_rim = self.moving < self.places.len();
        has_rim && !at_rim.any(|spring| shifted(spring.from) || shifted(spring.to))
    }

    /// What counts as not having moved: see [`STILL`].
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2⁵² places")]
    fn still(&self) -> (f64, f64) {
        let farther = (self.moving as f64 / SMALL).sqrt().max(1.0);
        let still = if self.turns() { STILL.0 * farther } else { STILL_BY_COMPASS.max(STILL.0 * farther) };
        (still, STILL.1 * farther)
    }

    /// The graph with one node more, the first, that stands for the rest of the map: the rim hangs on it by springs that nothing
    /// moves, so that a loop through the rest is a loop.
    fn with_rest(&self, springs: &[PoseSpring], before: &[Pose]) -> Result<(PoseGraph, Vec<Pose>), RelaxationError> {
        let mut all: Vec<PoseSpring> =
            springs.iter().map(|spring| PoseSpring { from: spring.from + 1, to: spring.to + 1, ..*spring }).collect();
        let rim = self.moving..self.places.len();
        all.extend(rim.map(|place| PoseSpring {
            from: 0,
            to: place + 1,
            from_to: before[place],
            information: Matrix3::from_diagonal_element(RIGID),
        }));
        let start = std::iter::once(Pose::default()).chain(before.iter().copied()).collect();
        Ok((PoseGraph::new(self.places.len() + 1, &all)?, start))
    }

    /// The poses of least energy near some others.
    fn descended(&self, springs: &[PoseSpring], before: &[Pose]) -> Result<Vec<Pose>, RelaxationError> {
        let held: Vec<(usize, Pose)> = before.iter().copied().enumerate().skip(self.moving).collect();
        let graph = PoseGraph::new(self.places.len(), springs)?.with_held(&held)?;
        Ok(descend(&graph, before, &PoseOptions::default())?.poses)
    }

    /// The same where a compass holds the headings, which is linear.
    fn solved(&self, springs: &[PoseSpring], before: &[Pose]) -> Result<Vec<Pose>, RelaxationError> {
        let (network, start) = self.contracted(springs, before)?;
        Ok(self.put(before, &Auto.solve(&network, &start).positions))
    }

    /// The network in which the rim is one node, the first, at the origin, and each spring to it is longer by where its place
    /// lies; and where the nodes are.
    fn contracted(
        &self,
        springs: &[PoseSpring],
        before: &[Pose],
    ) -> Result<(Network, Vec<Point2<f64>>), RelaxationError> {
        let node = |place: usize| if place < self.moving { place + 1 } else { 0 };
        let lies = |place: usize| if place < self.moving { Vector2::zeros() } else { before[place].translation() };
        let moved = |(ends, link): (&PoseSpring, &&Link)| {
            let measured = spring(link);
            let rest = measured.rest + lies(ends.from) - lies(ends.to);
            Spring { from: node(ends.from), to: node(ends.to), rest, ..measured }
        };
        let network = Network::from_vec(self.moving + 1, springs.iter().zip(&self.links).map(moved).collect())?;
        let moving = before[..self.moving].iter().map(|pose| pose.translation().into());
        Ok((network, std::iter::once(Point2::origin()).chain(moving).collect()))
    }

    /// The poses with the positions of the contracted network's nodes.
    fn put(&self, before: &[Pose], nodes: &[Point2<f64>]) -> Vec<Pose> {
        let mut after = before.to_vec();
        for (pose, at) in after[..self.moving].iter_mut().zip(&nodes[1..]) {
            *pose = Pose::new(at.x, at.y, pose.heading);
        }
        after
    }
}

/// The number of each place in a part.
struct Numbers(BTreeMap<PlaceId, usize>);

impl Numbers {
    fn spring(&self, link: &Link) -> PoseSpring {
        PoseSpring { from: self.0[&link.from], to: self.0[&link.to], ..pose_spring(link) }
    }
}

/// How far a link is from its measurement.
pub(super) fn chi2(link: &Link, pose: impl Fn(PlaceId) -> Isometry2<f64>) -> f64 {
    pose_spring(link).chi2(plain(&pose(link.from)), plain(&pose(link.to)))
}

fn plain(pose: &Isometry2<f64>) -> Pose {
    let at = pose.translation.vector;
    Pose::new(at.x, at.y, pose.rotation.angle())
}

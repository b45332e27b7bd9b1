//! Relaxing a map only as far as a change reaches.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use nalgebra::{Isometry2, Point2, Vector2};
use relaxation::{Auto, Network, Pose, PoseGraph, PoseOptions, PoseSpring, Solver, Spring, descend};
use topo_map::{Link, LinkId, PlaceId, TopoMap};

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

/// What counts as not having moved, in metres and radians: a tenth of what a scan knows...
const STILL: (f64, f64) = (0.001, 0.001);
/// ...and of what a link knows of which a compass holds the heading, since it knows less of the distance.
const STILL_BY_COMPASS: f64 = 0.005;

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

    /// The poses of least energy, given those of the rim.
    pub(super) fn relaxed(&self, pose: impl Fn(PlaceId) -> Isometry2<f64>) -> Result<Moved, RelaxationError> {
        let turns = self.links.iter().any(|link| link.displacement.turn.is_some());
        let number: BTreeMap<PlaceId, usize> = self.places.iter().copied().zip(0..).collect();
        let spring = |link: &&Link| PoseSpring { from: number[&link.from], to: number[&link.to], ..pose_spring(link) };
        let springs: Vec<PoseSpring> = self.links.iter().map(spring).collect();
        let before: Vec<Pose> = self.places.iter().map(|place| plain(&pose(*place))).collect();
        let after = if turns { self.descended(&springs, &before)? } else { self.solved(&springs, &before)? };
        let still = if turns { STILL.0 } else { STILL_BY_COMPASS };
        let shifted = |place: usize| {
            let (a, b) = (&before[place], &after[place]);
            let off = (a.translation() - b.translation()).norm();
            off > still || relaxation::wrap(a.heading - b.heading).abs() > STILL.1
        };
        let reaches_rim = |spring: &&PoseSpring| spring.from.max(spring.to) >= self.moving;
        let has_rim = self.moving < self.places.len();
        let is_enough =
            has_rim && !springs.iter().filter(reaches_rim).any(|spring| shifted(spring.from) || shifted(spring.to));
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

    /// The poses of least energy near some others.
    fn descended(&self, springs: &[PoseSpring], before: &[Pose]) -> Result<Vec<Pose>, RelaxationError> {
        let held: Vec<(usize, Pose)> = before.iter().copied().enumerate().skip(self.moving).collect();
        let graph = PoseGraph::new(self.places.len(), springs)?.with_held(&held)?;
        Ok(descend(&graph, before, &PoseOptions::default())?.poses)
    }

    /// The same where a compass holds the headings, which is linear: the rim is one node at the origin, and each spring to it
    /// is longer by where its place lies.
    fn solved(&self, springs: &[PoseSpring], before: &[Pose]) -> Result<Vec<Pose>, RelaxationError> {
        let node = |place: usize| if place < self.moving { place + 1 } else { 0 };
        let lies = |place: usize| if place < self.moving { Vector2::zeros() } else { before[place].translation() };
        let moved = |(ends, link): (&PoseSpring, &&Link)| {
            let measured = spring(link);
            let rest = measured.rest + lies(ends.from) - lies(ends.to);
            Spring { from: node(ends.from), to: node(ends.to), rest, ..measured }
        };
        let network = Network::new(self.moving + 1, &springs.iter().zip(&self.links).map(moved).collect::<Vec<_>>())?;
        let moving = before[..self.moving].iter().map(|pose| pose.translation().into());
        let start: Vec<Point2<f64>> = std::iter::once(Point2::origin()).chain(moving).collect();
        let mut after = before.to_vec();
        for (pose, at) in after.iter_mut().zip(Auto.solve(&network, &start).positions.iter().skip(1)) {
            *pose = Pose::new(at.x, at.y, pose.heading);
        }
        Ok(after)
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

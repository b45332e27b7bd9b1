use std::collections::BTreeSet;

use nalgebra::{Isometry2, Point2};
use topo_map::{Displacement, Link, LinkOrigin, Place, PlaceId, PlaceState, TopoMap};

use crate::config::RelaxationPolicy;
use crate::coordinates::Coordinates;
use crate::mapper::{Mapper, MapperError};

/// How the map grew: where each place was put when the robot came to it, and what each relaxation made of them.
///
/// Nothing of this is stored. The links are numbered in the order in which they came, so the growth is what mapping did
/// when it is done again: a place is put where its first link says, and the places are relaxed after each group of loops
/// that was closed together (or once for each place, as the paper does).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Growth {
    /// Where each place was put when it was new, in metres, in the coordinates of that moment.
    pub arrivals: Vec<Point2<f64>>,
    /// Relaxations in the order in which they happened, the last one with the coordinates that the map has now.
    pub relaxations: Vec<Regrown>,
    /// How many relaxations there were; more than [`Growth::relaxations`] where only some of them were asked for.
    pub n_relaxations: usize,
}

/// The map after one relaxation.
#[derive(Debug, Clone, PartialEq)]
pub struct Regrown {
    /// How many links there were, of any kind and state: the first so many of the map.
    pub links: usize,
    /// Where the places were then, in metres; as many as there were.
    pub positions: Vec<Point2<f64>>,
    /// Energy before it, each link counted once.
    pub energy_before: f64,
    /// Energy after it.
    pub energy_after: f64,
    /// What the energy is expected to be where the covariances are right: measured numbers less free ones.
    pub degrees_of_freedom: usize,
}

impl Mapper {
    /// How the map grew, with at most about `budget` positions over all relaxations that are told of.
    ///
    /// Where that does not suffice, relaxations are left out evenly. With a compass this changes none of the others,
    /// since there is one optimum whatever the start.
    ///
    /// # Errors
    ///
    /// Links that cannot be relaxed.
    pub fn growth(&self, budget: usize) -> Result<Growth, MapperError> {
        let map = self.topology();
        let ends = group_ends(map.links(), self.config().relaxation.policy);
        let count = (budget.saturating_mul(2) / map.places().len().max(1)).clamp(2, ends.len().max(2));
        let told =
            |group: usize| group + 1 == ends.len() || group * count / ends.len() != (group + 1) * count / ends.len();
        let mut replay = Replay::new(map);
        for (group, &end) in ends.iter().enumerate() {
            replay.advance(map, end);
            if told(group) {
                replay.relax(map, self.config().relaxation.policy)?;
            }
        }
        let mut growth = replay.finish(map, ends.len());
        if let Some(last) = growth.relaxations.last_mut() {
            // What people edited, or a relaxation of another kind, is in no replay.
            let poses = self.coordinates().padded(map);
            last.links = map.links().len();
            last.energy_after = self.coordinates().problem(map)?.energy(&poses);
            last.positions = positions(&poses);
        }
        Ok(growth)
    }
}

/// After how many links the places were relaxed.
fn group_ends(links: &[Link], policy: RelaxationPolicy) -> Vec<usize> {
    let closing = closing(links);
    let is_last = |index: usize| match policy {
        RelaxationPolicy::OneSweep => links[index].origin == LinkOrigin::Traveled,
        RelaxationPolicy::Converge => closing[index] && !closing.get(index + 1).is_some_and(|closes| *closes),
    };
    let mut ends: Vec<usize> = (0..links.len()).filter(|&index| is_last(index)).map(|index| index + 1).collect();
    if ends.last() != Some(&links.len()) {
        ends.push(links.len()); // mapping ends with a relaxation, whatever came last
    }
    ends
}

/// Which links close a loop: what was recognised does, and so does driving to a place that was known already.
fn closing(links: &[Link]) -> Vec<bool> {
    let mut reached = PlaceId(0);
    let closes = |link: &Link| {
        let end = link.from.max(link.to);
        let known = end <= reached;
        reached = reached.max(end);
        link.is_measured() && (known || link.origin == LinkOrigin::Recognized)
    };
    links.iter().map(closes).collect()
}

/// Mapping done again, without looking at anything but links.
struct Replay {
    coordinates: Coordinates,
    /// Whether each place that is known of has been put anywhere.
    placed: Vec<bool>,
    links: usize,
    growth: Growth,
}

impl Replay {
    fn new<S>(map: &TopoMap<S>) -> Self {
        let mut replay =
            Self { coordinates: Coordinates::default(), placed: Vec::new(), links: 0, growth: Growth::default() };
        if let Some(first) = map.places().first() {
            replay.know_of(1);
            replay.put(first.id, None);
        }
        replay
    }

    /// Takes in links up to `end`, and the places that they lead to: of an explored map not always the newest.
    fn advance<S>(&mut self, map: &TopoMap<S>, end: usize) {
        for link in &map.links()[self.links..end] {
            self.know_of(link.from.max(link.to).index() + 1);
            for (known, new) in [(link.from, link.to), (link.to, link.from)] {
                if self.placed[known.index()] && !self.placed[new.index()] {
                    self.put(new, Some((known, &link.displacement_from(known))));
                }
            }
        }
        self.links = end;
    }

    fn know_of(&mut self, places: usize) {
        if self.placed.len() < places {
            self.placed.resize(places, false);
            self.growth.arrivals.resize(places, Point2::origin());
        }
    }

    fn put(&mut self, place: PlaceId, seen_from: Option<(PlaceId, &Displacement)>) {
        self.coordinates.place(place, seen_from);
        self.placed[place.index()] = true;
        self.growth.arrivals[place.index()] = self.coordinates.map_from_place(place).translation.vector.into();
    }

    fn relax<S>(&mut self, map: &TopoMap<S>, policy: RelaxationPolicy) -> Result<(), MapperError> {
        let places = map.places()[..self.placed.len()].iter().map(plain).collect();
        let part = TopoMap::from_parts(places, map.links()[..self.links].to_vec())?;
        let relaxed = match policy {
            RelaxationPolicy::OneSweep => self.coordinates.sweep(&part)?,
            RelaxationPolicy::Converge => self.coordinates.relax(&part)?,
        };
        let measured = || part.links().iter().filter(|link| link.is_measured());
        let turns = measured().any(|link| link.displacement.turn.is_some());
        let reached: BTreeSet<PlaceId> = measured().flat_map(|link| [link.from, link.to]).collect();
        let loops = (measured().count() + 1).saturating_sub(reached.len());
        self.growth.relaxations.push(Regrown {
            links: self.links,
            positions: positions(&self.coordinates.padded(&part)),
            energy_before: relaxed.energy_before,
            energy_after: relaxed.energy_after,
            degrees_of_freedom: loops * if turns { 3 } else { 2 },
        });
        Ok(())
    }

    fn finish<S>(mut self, map: &TopoMap<S>, n_relaxations: usize) -> Growth {
        self.advance(map, map.links().len());
        self.know_of(map.places().len());
        Growth { n_relaxations, ..self.growth }
    }
}

/// The place alone: what it is recognised by does not matter here, nor what became of it later.
fn plain<S>(place: &Place<S>) -> Place<()> {
    Place { id: place.id, state: PlaceState::Visited { signature: () }, visits: place.visits }
}

fn positions(poses: &[Isometry2<f64>]) -> Vec<Point2<f64>> {
    poses.iter().map(|pose| pose.translation.vector.into()).collect()
}

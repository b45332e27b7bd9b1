use local_grid::Heading;
use nalgebra::{Matrix2, Vector2};

use crate::{Displacement, DisplacementError, Link, LinkId, LinkOrigin, LinkState, Place, PlaceId, PlaceState};

/// Places and the links between them: the topological map, without any coordinates.
///
/// Places and links are numbered from 0 in the order in which they came, and nothing is ever renumbered: a place that
/// proved false is `Refuted`, one that proved to be another is `Merged`, a false link is `Rejected`. So slices with one
/// entry per place or link, as the levels above keep them, stay valid.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawMap<S>", into = "RawMap<S>"))]
#[cfg_attr(feature = "serde", serde(bound(serialize = "S: Clone + serde::Serialize")))]
#[cfg_attr(feature = "serde", serde(bound(deserialize = "S: serde::Deserialize<'de>")))]
pub struct TopoMap<S> {
    places: Vec<Place<S>>,
    links: Vec<Link>,
    /// The links of each place, in the order in which they came.
    incident: Vec<Vec<LinkId>>,
    /// How many places are visited, kept along because every step of the localizer asks.
    visited: usize,
}

/// The map as a file holds it: reading goes through [`TopoMap::from_parts`].
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct RawMap<S> {
    places: Vec<Place<S>>,
    links: Vec<Link>,
}

/// Why the map refuses a change.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// There is no such place.
    #[error("{place} does not exist: the map has {count} places")]
    NoPlace {
        /// The place named.
        place: PlaceId,
        /// How many there are.
        count: usize,
    },
    /// There is no such link.
    #[error("{link} does not exist: the map has {count} links")]
    NoLink {
        /// The link named.
        link: LinkId,
        /// How many there are.
        count: usize,
    },
    /// A link needs two places.
    #[error("a link cannot lead from {0} to itself")]
    Loop(PlaceId),
    /// The measurement is none.
    #[error("link from {from} to {to}")]
    Displacement {
        /// Where the link would begin.
        from: PlaceId,
        /// Where it would end.
        to: PlaceId,
        /// What is wrong with the measurement.
        #[source]
        source: DisplacementError,
    },
    /// Places that proved false, or to be another place, take no links any more.
    #[error("{0} is refuted or merged into another place")]
    Gone(PlaceId),
    /// Only a place that was visited can do this.
    #[error("{0} was not visited")]
    NotVisited(PlaceId),
    /// Only a predicted place can do this.
    #[error("{0} is not predicted")]
    NotPredicted(PlaceId),
    /// The link is of another origin than the change needs.
    #[error("{link} is {found:?}")]
    Origin {
        /// The link.
        link: LinkId,
        /// Its origin.
        found: LinkOrigin,
    },
    /// A confidence is a probability.
    #[error("confidence must lie in [0, 1], got {0}")]
    Confidence(f64),
    /// The parts of a map that was read do not fit together.
    #[error("{what} at index {index} is numbered {number}")]
    Numbering {
        /// `place` or `link`.
        what: &'static str,
        /// Where it stood.
        index: usize,
        /// Its number.
        number: u32,
    },
    /// Numbers have 32 bits.
    #[error("a map holds at most {} places and as many links", u32::MAX)]
    Full,
}

/// A place next to another, and the link between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbor {
    /// The place.
    pub place: PlaceId,
    /// The link that leads there.
    pub link: LinkId,
    /// Where the place lies as seen from the place that was asked for.
    pub displacement: Displacement,
}

impl<S> Default for TopoMap<S> {
    fn default() -> Self {
        Self { places: Vec::new(), links: Vec::new(), incident: Vec::new(), visited: 0 }
    }
}

impl<S> TopoMap<S> {
    /// A map without places.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A map of given places and links, each numbered by its index.
    ///
    /// # Errors
    ///
    /// A number that is not the index, a link to a place that does not exist, a measurement that cannot be one.
    pub fn from_parts(places: Vec<Place<S>>, links: Vec<Link>) -> Result<Self, MapError> {
        let visited = places.iter().filter(|place| place.is_visited()).count();
        let incident = vec![Vec::new(); places.len()];
        let mut map = Self { places, links: Vec::with_capacity(links.len()), incident, visited };
        for (index, place) in map.places.iter().enumerate() {
            if place.id.index() != index {
                return Err(MapError::Numbering { what: "place", index, number: place.id.0 });
            }
            match place.state {
                PlaceState::Predicted { seen_from: other, .. } | PlaceState::Merged { into: other, .. } => {
                    map.check_place(other)?;
                }
                PlaceState::Visited { .. } | PlaceState::Refuted => {}
            }
        }
        for (index, link) in links.into_iter().enumerate() {
            if link.id.index() != index {
                return Err(MapError::Numbering { what: "link", index, number: link.id.0 });
            }
            map.check_measurement(link.from, link.to, &link.displacement)?;
            map.insert(link);
        }
        Ok(map)
    }

    /// All places, by number.
    #[must_use]
    pub fn places(&self) -> &[Place<S>] {
        &self.places
    }

    /// All links, by number.
    #[must_use]
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// The place of that number, if there is one.
    #[must_use]
    pub fn place(&self, place: PlaceId) -> Option<&Place<S>> {
        self.places.get(place.index())
    }

    /// The link of that number, if there is one.
    #[must_use]
    pub fn link(&self, link: LinkId) -> Option<&Link> {
        self.links.get(link.index())
    }

    /// How many places the robot has visited (and not recognised as others since).
    #[must_use]
    pub fn n_visited(&self) -> usize {
        self.visited
    }

    /// How many places are predicted and neither verified nor refuted yet.
    #[must_use]
    pub fn n_predicted(&self) -> usize {
        self.places.iter().filter(|place| place.is_predicted()).count()
    }

    /// The links of `place` in any state, in the order in which they came; none if there is no such place.
    pub fn links_of(&self, place: PlaceId) -> impl Iterator<Item = &Link> + '_ {
        let ids = self.incident.get(place.index()).map_or(&[][..], Vec::as_slice);
        ids.iter().map(|link| &self.links[link.index()])
    }

    /// The places that can be reached from `place` over one passable link, in the order in which the links came.
    pub fn neighbors(&self, place: PlaceId) -> impl Iterator<Item = Neighbor> + '_ {
        self.links_of(place).filter(|link| link.is_passable()).map(move |link| Neighbor {
            place: link.other_end(place),
            link: link.id,
            displacement: link.displacement_from(place),
        })
    }

    /// The links between two places, in either direction and any state.
    pub fn links_between(&self, a: PlaceId, b: PlaceId) -> impl Iterator<Item = &Link> + '_ {
        self.links_of(a).filter(move |link| link.other_end(a) == b)
    }

    /// The place that `place` is: itself, or the one that it was merged into.
    #[must_use]
    pub fn resolve(&self, place: PlaceId) -> PlaceId {
        let mut at = place;
        // A merge always leads to a place that was not merged itself at that time, so the chain ends.
        for _ in 0..self.places.len() {
            match self.place(at).map(|place| &place.state) {
                Some(PlaceState::Merged { into, .. }) => at = *into,
                _ => break,
            }
        }
        at
    }

    /// Adds a place that the robot is visiting now for the first time.
    ///
    /// # Errors
    ///
    /// The map is full.
    pub fn add_place(&mut self, signature: S) -> Result<PlaceId, MapError> {
        self.push_place(PlaceState::Visited { signature }, 1)
    }

    /// Adds a place that is expected `displacement` away from a visited one, and the predicted link to it.
    ///
    /// # Errors
    ///
    /// `seen_from` does not exist or was not visited, the confidence lies outside `[0, 1]`, the displacement is none.
    pub fn predict_place(
        &mut self,
        seen_from: PlaceId,
        displacement: Displacement,
        confidence: f64,
    ) -> Result<(PlaceId, LinkId), MapError> {
        self.check_visited(seen_from)?;
        if !(0.0..=1.0).contains(&confidence) {
            return Err(MapError::Confidence(confidence));
        }
        let next = PlaceId(self.next_number(self.places.len())?);
        displacement.check().map_err(|source| MapError::Displacement { from: seen_from, to: next, source })?;
        let toward = Heading::of(displacement.vector);
        let place = self.push_place(PlaceState::Predicted { seen_from, toward, confidence }, 0)?;
        let link = self.add_link(seen_from, place, displacement, LinkOrigin::Predicted)?;
        Ok((place, link))
    }

    /// The robot has reached a predicted place: it is a visited one from now on.
    ///
    /// # Errors
    ///
    /// The place does not exist or is not predicted.
    pub fn verify(&mut self, place: PlaceId, signature: S) -> Result<(), MapError> {
        self.check_predicted(place)?;
        let known = &mut self.places[place.index()];
        known.state = PlaceState::Visited { signature };
        known.visits = 1;
        self.visited += 1;
        Ok(())
    }

    /// The robot has found that a predicted place cannot be reached; its links are blocked.
    ///
    /// # Errors
    ///
    /// The place does not exist or is not predicted.
    pub fn refute(&mut self, place: PlaceId) -> Result<(), MapError> {
        self.check_predicted(place)?;
        self.places[place.index()].state = PlaceState::Refuted;
        for link in self.incident[place.index()].clone() {
            let link = &mut self.links[link.index()];
            if link.state == LinkState::Open {
                link.state = LinkState::Blocked;
            }
        }
        Ok(())
    }

    /// Replaces what a visited place is recognised by: its surroundings have been seen better since.
    ///
    /// # Errors
    ///
    /// The place does not exist or was not visited.
    pub fn describe(&mut self, place: PlaceId, signature: S) -> Result<(), MapError> {
        self.check_visited(place)?;
        self.places[place.index()].state = PlaceState::Visited { signature };
        Ok(())
    }

    /// The robot has come to a visited place again.
    ///
    /// # Errors
    ///
    /// The place does not exist or was not visited before.
    pub fn revisit(&mut self, place: PlaceId) -> Result<(), MapError> {
        self.check_visited(place)?;
        let visits = &mut self.places[place.index()].visits;
        *visits = visits.saturating_add(1);
        Ok(())
    }

    /// Adds a link between two places, whatever links they have already.
    ///
    /// # Errors
    ///
    /// A place does not exist or is gone, both are the same, or the displacement is none.
    pub fn add_link(
        &mut self,
        from: PlaceId,
        to: PlaceId,
        displacement: Displacement,
        origin: LinkOrigin,
    ) -> Result<LinkId, MapError> {
        self.check_measurement(from, to, &displacement)?;
        self.check_alive(from)?;
        self.check_alive(to)?;
        let id = LinkId(self.next_number(self.links.len())?);
        let traversals = u32::from(origin == LinkOrigin::Traveled);
        let displacement = displacement.symmetric();
        self.insert(Link { id, from, to, displacement, origin, state: LinkState::Open, traversals });
        Ok(id)
    }

    /// The robot has gone from one visited place to another: a new link, or one more measurement of a traveled one.
    ///
    /// Repeated traversals are fused by inverse variance, those in the other direction with their sign flipped; a
    /// predicted link between the two becomes a traveled one, and a blocked one opens again.
    ///
    /// # Errors
    ///
    /// As [`Self::add_link`]; and both places must have been visited.
    pub fn travel(&mut self, from: PlaceId, to: PlaceId, displacement: Displacement) -> Result<LinkId, MapError> {
        self.check_measurement(from, to, &displacement)?;
        self.check_visited(from)?;
        self.check_visited(to)?;
        let usable = |link: &&Link| link.state != LinkState::Rejected && link.origin != LinkOrigin::Recognized;
        let Some(id) = self.links_between(from, to).filter(usable).map(|link| link.id).next() else {
            return self.add_link(from, to, displacement, LinkOrigin::Traveled);
        };
        let link = &mut self.links[id.index()];
        let measured = if link.from == from { displacement } else { displacement.reversed() };
        let fused = match link.origin {
            LinkOrigin::Traveled => link.displacement.fused(&measured),
            LinkOrigin::Recognized | LinkOrigin::Predicted => None,
        };
        link.displacement = fused.unwrap_or(measured).symmetric();
        link.origin = LinkOrigin::Traveled;
        link.state = LinkState::Open;
        link.traversals = link.traversals.saturating_add(1);
        Ok(id)
    }

    /// The robot did not go over a traveled link but was carried: what it measured is forgotten.
    ///
    /// # Errors
    ///
    /// The link does not exist.
    pub fn carry(&mut self, link: LinkId) -> Result<(), MapError> {
        self.check_link(link)?;
        let link = &mut self.links[link.index()];
        link.displacement = link.displacement.carried();
        Ok(())
    }

    /// Two visited places were recognised as lying `displacement` apart: a link that can be rejected again by itself.
    ///
    /// # Errors
    ///
    /// As [`Self::add_link`]; and both places must have been visited.
    pub fn recognize(&mut self, from: PlaceId, to: PlaceId, displacement: Displacement) -> Result<LinkId, MapError> {
        self.check_visited(from)?;
        self.check_visited(to)?;
        self.add_link(from, to, displacement, LinkOrigin::Recognized)
    }

    /// Opens, blocks or rejects a link.
    ///
    /// # Errors
    ///
    /// The link does not exist.
    pub fn set_link_state(&mut self, link: LinkId, state: LinkState) -> Result<(), MapError> {
        self.check_link(link)?;
        self.links[link.index()].state = state;
        Ok(())
    }

    /// `absorbed` turned out to be `kept`, its centre lying `offset` (m, in the axes of `kept`) from that of `kept`, known to
    /// `covariance` (m²).
    ///
    /// The links of `absorbed` are bent to end at the centre of `kept`, and are as much less sure as the offset is unsure; a
    /// link between the two loses its meaning and is rejected. This cannot be undone: what should stay revocable is a [`Self::recognize`].
    ///
    /// # Errors
    ///
    /// A place does not exist or is gone, both are the same, `kept` was not visited, or the offset is not finite.
    pub fn merge(
        &mut self,
        absorbed: PlaceId,
        kept: PlaceId,
        offset: Vector2<f64>,
        covariance: Matrix2<f64>,
    ) -> Result<(), MapError> {
        self.check_measurement(absorbed, kept, &Displacement::isotropic(offset, 1.0))?;
        self.check_alive(absorbed)?;
        self.check_visited(kept)?;
        for id in std::mem::take(&mut self.incident[absorbed.index()]) {
            let link = &mut self.links[id.index()];
            if link.other_end(absorbed) == kept {
                link.state = LinkState::Rejected;
                self.incident[absorbed.index()].push(id);
                continue;
            }
            // Seen from its far end, the link's tip moves from the centre of `absorbed` to that of `kept`.
            let (far, mut seen) = (link.other_end(absorbed), link.displacement_from(link.other_end(absorbed)));
            let turn = seen.turn.map_or(0.0, |turn| turn.change);
            let turn = nalgebra::Rotation2::new(turn);
            seen.vector -= turn * offset;
            seen.covariance += turn * covariance * turn.transpose();
            (link.from, link.to, link.displacement) = (far, kept, seen);
            self.incident[kept.index()].push(id);
        }
        self.incident[kept.index()].sort_unstable(); // in the order in which they came, again
        self.visited -= usize::from(self.places[absorbed.index()].is_visited());
        let visits = self.places[absorbed.index()].visits;
        let survivor = &mut self.places[kept.index()];
        survivor.visits = survivor.visits.saturating_add(visits);
        self.places[absorbed.index()].state = PlaceState::Merged { into: kept, offset };
        Ok(())
    }

    /// Turns the whole map by `turn` radians: all headings by which it was measured were wrong by so much.
    ///
    /// For places that share the axes of those headings; a link between places that have axes of their own
    /// ([`Displacement::turn`]) stays as it is.
    pub fn turn(&mut self, turn: f64) {
        let links = self.links.iter_mut().filter(|link| link.displacement.turn.is_none());
        links.for_each(|link| link.displacement = link.displacement.in_axes_turned_by(-turn));
        self.places.iter_mut().for_each(|place| place.state.turn(turn));
    }

    fn push_place(&mut self, state: PlaceState<S>, visits: u32) -> Result<PlaceId, MapError> {
        let id = PlaceId(self.next_number(self.places.len())?);
        self.visited += usize::from(matches!(state, PlaceState::Visited { .. }));
        self.places.push(Place { id, state, visits });
        self.incident.push(Vec::new());
        Ok(id)
    }

    fn insert(&mut self, link: Link) {
        self.incident[link.from.index()].push(link.id);
        self.incident[link.to.index()].push(link.id);
        self.links.push(link);
    }

    fn next_number(&self, count: usize) -> Result<u32, MapError> {
        u32::try_from(count).map_err(|_| MapError::Full)
    }

    fn check_place(&self, place: PlaceId) -> Result<&Place<S>, MapError> {
        self.place(place).ok_or(MapError::NoPlace { place, count: self.places.len() })
    }

    fn check_link(&self, link: LinkId) -> Result<&Link, MapError> {
        self.link(link).ok_or(MapError::NoLink { link, count: self.links.len() })
    }

    fn check_alive(&self, place: PlaceId) -> Result<(), MapError> {
        match self.check_place(place)?.state {
            PlaceState::Refuted | PlaceState::Merged { .. } => Err(MapError::Gone(place)),
            PlaceState::Predicted { .. } | PlaceState::Visited { .. } => Ok(()),
        }
    }

    fn check_visited(&self, place: PlaceId) -> Result<(), MapError> {
        if self.check_place(place)?.is_visited() { Ok(()) } else { Err(MapError::NotVisited(place)) }
    }

    fn check_predicted(&self, place: PlaceId) -> Result<(), MapError> {
        if self.check_place(place)?.is_predicted() { Ok(()) } else { Err(MapError::NotPredicted(place)) }
    }

    fn check_measurement(&self, from: PlaceId, to: PlaceId, displacement: &Displacement) -> Result<(), MapError> {
        self.check_place(from)?;
        self.check_place(to)?;
        if from == to {
            return Err(MapError::Loop(from));
        }
        displacement.check().map_err(|source| MapError::Displacement { from, to, source })
    }
}

#[cfg(feature = "serde")]
impl<S> TryFrom<RawMap<S>> for TopoMap<S> {
    type Error = MapError;

    fn try_from(raw: RawMap<S>) -> Result<Self, MapError> {
        Self::from_parts(raw.places, raw.links)
    }
}

#[cfg(feature = "serde")]
impl<S> From<TopoMap<S>> for RawMap<S> {
    fn from(map: TopoMap<S>) -> Self {
        Self { places: map.places, links: map.links }
    }
}

mod correct;
mod error;
mod record;

pub use error::MapError;

use crate::{Displacement, Link, LinkId, Place, PlaceId, PlaceState};

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

//! What the robot did and saw, written into the map: places and links come, and their states change.

use local_grid::Heading;

use super::{MapError, TopoMap};
use crate::{Displacement, Link, LinkId, LinkOrigin, LinkState, PlaceId, PlaceState};

impl<S> TopoMap<S> {
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
}

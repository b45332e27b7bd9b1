//! Changes of what is known already: two places are one, or the axes of all were turned.

use nalgebra::{Matrix2, Vector2};

use super::{MapError, TopoMap};
use crate::{Displacement, LinkState, PlaceId, PlaceState};

impl<S> TopoMap<S> {
    /// `absorbed` turned out to be `kept`, its centre lying `offset` (m, in the axes of `kept`) from that of `kept`, known to
    /// `covariance` (m²).
    ///
    /// The links of `absorbed` are bent to end at the centre of `kept`, and are as much less sure as the offset is unsure; a
    /// link between the two loses its meaning and is rejected. This cannot be undone: what should stay revocable is a
    /// [`Self::recognize`].
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
}

//! Closures: borne out by walls, turned into links, and taken back where the map contradicts them.

use topo_map::{Link, LinkId, LinkOrigin, LinkState};

use super::{Mapper, MapperError, relaxed};
use crate::config::RelaxationPolicy;
use crate::event::Event;
use crate::recognize::verify::{self, Verification};
use crate::recognize::{Closure, Verdict};

/// Squared normalised residual from which a closure is under suspicion: 99.9 % of χ² with two degrees of freedom, and with
/// three where no compass holds the turns.
const SUSPICIOUS: [f64; 2] = [13.82, 16.27];

impl Mapper {
    /// Turns what the recognizer decided into links, if the laser bears it out; relaxes if a loop was closed, and takes
    /// back what the relaxed map contradicts.
    pub(in crate::mapper) fn close(&mut self, closures: Vec<Closure>) -> Result<Vec<Event>, MapperError> {
        let mut events = self.link(self.verified(closures))?;
        let closed = |event: &Event| match event {
            Event::PlaceRecognized { link, .. } => Some(*link),
            _ => None,
        };
        let closed: Vec<LinkId> = events.iter().filter_map(closed).collect();
        if !closed.is_empty() && self.config.relaxation.policy == RelaxationPolicy::Converge {
            let (relaxation, misfits) = self.coordinates.relax_around(&self.map, &closed)?;
            events.push(relaxed(relaxation));
            let suspected = self.suspected(&misfits);
            if !suspected.is_empty() {
                let rejected = self.coordinates.outvoted_around(&self.map, &suspected, &closed, self.suspicious())?;
                events.extend(self.revoke(&rejected)?);
            }
        }
        Ok(events)
    }

    /// Turns the closures that are believed into links.
    pub(in crate::mapper) fn link(&mut self, closures: Vec<Closure>) -> Result<Vec<Event>, MapperError> {
        let mut events = Vec::new();
        for closure in closures {
            if closure.is_accepted() {
                self.bring_together(&closure);
                let link = self.map.recognize(closure.place, closure.known, closure.displacement)?;
                self.recognizer.tell_joined(&self.map, closure.place, closure.known);
                events.push(Event::PlaceRecognized { place: closure.place, known: closure.known, link });
            } else {
                events.push(Event::RecognitionRefused { closure });
            }
            self.closures.push(closure);
        }
        Ok(events)
    }

    /// Closures that the laser bears out, with what it measures; and the rest, refused.
    pub(in crate::mapper) fn verified(&self, mut closures: Vec<Closure>) -> Vec<Closure> {
        for closure in closures.iter_mut().filter(|closure| closure.is_accepted()) {
            let at = |place| self.coordinates.map_from_place(place);
            match verify::by_walls(&self.trajectory, closure, &at(closure.place).inv_mul(&at(closure.known))) {
                Verification::Borne(displacement) => closure.displacement = displacement,
                Verification::Silent => {}
                Verification::Refuted(score) => closure.verdict = Verdict::WallsDiffer { score },
            }
        }
        closures
    }

    /// The squared normalised residual from which a closure is under suspicion.
    pub(in crate::mapper) fn suspicious(&self) -> f64 {
        SUSPICIOUS[usize::from(!self.front_end.tracker.has_compass())]
    }

    /// Brings all coordinates to their optimum, and takes back closures that the relaxed map contradicts.
    pub(in crate::mapper) fn settle_all(&mut self) -> Result<Vec<Event>, MapperError> {
        let mut events = vec![relaxed(self.coordinates.relax(&self.map)?)];
        let residuals = self.coordinates.problem(&self.map)?.residuals(&self.coordinates.padded(&self.map));
        let measured = self.map.links().iter().filter(|link| link.is_measured()).map(|link| link.id);
        let misfits: Vec<(LinkId, f64)> = measured.zip(residuals).collect();
        if !self.suspected(&misfits).is_empty() {
            let rejected = self.coordinates.outvoted(&self.map, self.suspicious())?;
            events.extend(self.revoke(&rejected)?);
        }
        Ok(events)
    }

    /// The closures that are under suspicion by their misfit.
    fn suspected(&self, misfits: &[(LinkId, f64)]) -> Vec<LinkId> {
        let recognized = |id| self.map.link(id).is_some_and(|link| link.origin == LinkOrigin::Recognized);
        let bound = self.suspicious();
        misfits.iter().filter(|(id, chi2)| *chi2 > bound && recognized(*id)).map(|(id, _)| *id).collect()
    }

    /// Takes back closures that the rest of the map outvotes, each with its misfit.
    fn revoke(&mut self, rejected: &[(LinkId, f64)]) -> Result<Vec<Event>, MapperError> {
        let mut events = self.reject(rejected)?;
        if !events.is_empty() {
            let rejected: Vec<LinkId> = rejected.iter().map(|(id, _)| *id).collect();
            self.recognizer.tell_taken_back(&self.map, &rejected);
            let (relaxation, _) = self.coordinates.relax_around(&self.map, &rejected)?;
            events.push(relaxed(relaxation));
        }
        Ok(events)
    }

    /// Takes back closures, each with its misfit.
    pub(in crate::mapper) fn reject(&mut self, rejected: &[(LinkId, f64)]) -> Result<Vec<Event>, MapperError> {
        let mut events = Vec::new();
        for (id, chi2) in rejected {
            self.map.set_link_state(*id, LinkState::Rejected)?;
            let Some(&Link { from, to, .. }) = self.map.link(*id) else { continue };
            let is_it = |closure: &&mut Closure| closure.is_accepted() && (closure.place, closure.known) == (from, to);
            if let Some(closure) = self.closures.iter_mut().rev().find(is_it) {
                closure.verdict = Verdict::Contradicted { chi2: *chi2 };
                events.push(Event::RecognitionRefused { closure: *closure });
            }
        }
        Ok(events)
    }
}

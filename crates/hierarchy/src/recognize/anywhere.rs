//! How what a robot sees fits the places of a map in which it may be anywhere.

use std::sync::Arc;

use nalgebra::Matrix2;
use robot_log::local_grid::Signature;
use topo_map::{Hypothesis, Place, PlaceId, PlaceLikelihood, TopoMap};

use super::stretch::Likeness;
use super::{Gate, LIKELY_ANYWHERE, OVERLAP, Recognizer};

impl Recognizer {
    /// How well a view fits the places that the index of signatures finds most alike, and those that are `believed` to be
    /// the one, the most probable first; `turned` where the view's axes are not those of the map.
    pub(crate) fn likelihoods(
        &self,
        map: &TopoMap<Arc<Signature>>,
        view: &Signature,
        turned: bool,
        believed: &[Hypothesis],
    ) -> Vec<PlaceLikelihood> {
        let count = LIKELY_ANYWHERE[usize::from(turned)];
        let is_visited = |place: PlaceId| map.place(place).is_some_and(Place::is_visited);
        let mut places = self.alike(view, turned, count, is_visited);
        for hypothesis in believed.iter().take(count) {
            if !places.contains(&hypothesis.place) {
                places.push(hypothesis.place);
            }
        }
        let turn_window = if turned { std::f64::consts::PI } else { 0.0 };
        let seen = |known: &PlaceId| {
            let gate = Gate { known: *known, distance: 0.0, slack: OVERLAP, turn_window };
            let likeness = self.look(view, map.place(*known)?.signature()?, &gate, &Matrix2::zeros());
            likelihood(&likeness, believed.iter().find(|hypothesis| hypothesis.place == *known))
        };
        places.iter().filter_map(seen).collect()
    }
}

/// What a comparison says of being at its place. One that does not look alike measures nothing: it speaks against the place
/// if that is believed, wherever the robot would be in it.
fn likelihood(likeness: &Likeness, believed: Option<&Hypothesis>) -> Option<PlaceLikelihood> {
    let (place, ratio) = (likeness.known, likeness.log_ratio.exp());
    if let Some(place_from_known) = likeness.displacement {
        let known_from_view = place_from_known.reversed();
        let turn = known_from_view.turn.map_or(0.0, |turn| turn.change);
        let (offset, covariance) = (known_from_view.vector, known_from_view.covariance);
        return Some(PlaceLikelihood { place, ratio, offset, covariance, turn });
    }
    let Hypothesis { offset, turn, .. } = *believed?;
    Some(PlaceLikelihood { place, ratio, offset, covariance: Matrix2::identity() * OVERLAP.powi(2), turn })
}

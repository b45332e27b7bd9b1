//! The last few places together, and what each of them looks like.

mod evidence;
mod weighing;

use nalgebra::Isometry2;
use topo_map::{Displacement, PlaceId};

use super::closure::{Closure, Verdict};
use crate::coordinates::Coordinates;
pub(super) use evidence::{Agreement, OVERLAP, UNLIKE};
pub(super) use weighing::{Doubt, Hypothesis, Weighing};

/// A place of the stretch with everything that it was compared with.
#[derive(Debug, Clone)]
pub(crate) struct View {
    pub(crate) place: PlaceId,
    pub(crate) likenesses: Vec<Likeness>,
    pub(crate) most_agreed: usize,
}

/// One comparison of a place with an older one.
#[derive(Debug, Clone)]
pub(crate) struct Likeness {
    pub(crate) known: PlaceId,
    /// `known` as seen from the place; absent where the two do not look alike at all.
    pub(crate) displacement: Option<Displacement>,
    pub(crate) log_ratio: f64,
    pub(crate) score: f64,
    pub(crate) decided: bool,
}

impl View {
    /// What becomes of the resemblances that never found agreement: the most alike one is reported as refused.
    pub(super) fn forgotten(self, coordinates: &Coordinates, agreement: usize) -> Option<Closure> {
        if self.likenesses.iter().any(|likeness| likeness.decided) {
            return None;
        }
        let agreed = self.most_agreed.max(1);
        let verdict = if agreed >= agreement { Verdict::Ambiguous { agreed } } else { Verdict::NoAgreement { agreed } };
        let alike = self.likenesses.into_iter().filter(|likeness| likeness.displacement.is_some());
        let best = alike.max_by(|a, b| a.score.total_cmp(&b.score).then(b.known.cmp(&a.known)))?;
        best.closure(self.place, coordinates, verdict)
    }
}

impl Likeness {
    pub(super) fn closure(self, place: PlaceId, coordinates: &Coordinates, verdict: Verdict) -> Option<Closure> {
        let displacement = self.displacement?;
        let (at, known) = (coordinates.map_from_place(place), coordinates.map_from_place(self.known));
        let measured = displacement.from_place_from_to_place();
        let lands = motion(&at, &known, &measured, displacement.turn.is_some()) * at;
        let shift = (lands.translation.vector - at.translation.vector).norm();
        Some(Closure { place, known: self.known, displacement, score: self.score, shift, verdict })
    }
}

/// How the stretch would have to move, in the map, for an alignment to hold.
pub(super) fn motion(
    map_from_place: &Isometry2<f64>,
    map_from_known: &Isometry2<f64>,
    place_from_known: &Isometry2<f64>,
    turned: bool,
) -> Isometry2<f64> {
    // The old place's axes hold; those of the new one follow from the measured turn.
    let lands = match turned {
        true => map_from_known * place_from_known.inverse(),
        false => {
            let seen = map_from_place.rotation * place_from_known.translation.vector;
            Isometry2::from_parts((map_from_known.translation.vector - seen).into(), map_from_place.rotation)
        }
    };
    lands * map_from_place.inverse()
}

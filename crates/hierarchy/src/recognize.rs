use std::sync::Arc;

use nalgebra::{Isometry2, Matrix2, Vector2};
use robot_log::local_grid::{AlignOptions, Alignment, Ambiguity, Signature, align};
use topo_map::{Displacement, PlaceId, TopoMap, Turn};

use crate::config::Config;
use crate::coordinates::Coordinates;
use crate::reach::{Reach, reach_from};

/// Decides which places are the same: gate by coordinates, look by signature, wait for agreement.
///
/// A false recognition is the worst error of the whole system, so that a single resemblance never closes a loop:
/// it waits until successive places resemble places that lie to each other in the same way.
#[derive(Debug)]
pub(crate) struct Recognizer {
    floor: f64,
    agreement: usize,
    gate_sigma: f64,
    spacing: f64,
    align: AlignOptions,
    pending: Vec<Candidate>,
}

/// A resemblance that is weighed.
#[derive(Debug, Clone)]
struct Candidate {
    place: PlaceId,
    known: PlaceId,
    displacement: Displacement,
}

/// What became of a resemblance.
#[derive(Debug, Clone)]
pub(crate) struct Closure {
    pub(crate) place: PlaceId,
    pub(crate) known: PlaceId,
    /// From `known` to `place`.
    pub(crate) displacement: Displacement,
    pub(crate) verdict: Verdict,
}

/// Whether a resemblance became a link.
#[derive(Debug, Clone)]
pub(crate) enum Verdict {
    Accepted,
    Refused(String),
}

/// Places apart by less than this many spacings of travel have nothing to tell each other.
const RECENT_SPACINGS: f64 = 6.0;
/// The farthest that a place is looked for beyond its expected spot, in metres.
const WIDEST_GATE: f64 = 4.0;
/// Two signatures share enough to be compared when their centres are no farther apart than this, in metres.
const OVERLAP: f64 = 1.2;
/// Successive places that a resemblance may wait for its confirmation.
const PATIENCE: u32 = 4;
/// 99 % of the χ² distribution with two degrees of freedom.
const CHI2_99: f64 = 9.21;
/// Share of cells that contradict each other above which two views are of different places.
const CONTRADICTION: f64 = 0.12;

impl Recognizer {
    pub(crate) fn new(config: &Config) -> Self {
        let recognition = &config.recognition;
        Self {
            floor: recognition.floor,
            agreement: recognition.agreement,
            gate_sigma: recognition.gate_sigma,
            spacing: config.places.spacing_m,
            align: AlignOptions::default(),
            pending: Vec::new(),
        }
    }

    /// Weighs a completed place against all that may be the same.
    pub(crate) fn consider(
        &mut self,
        map: &TopoMap<Arc<Signature>>,
        coordinates: &Coordinates,
        place: PlaceId,
    ) -> Vec<Closure> {
        self.pending.retain(|candidate| place.0 - candidate.place.0 <= PATIENCE);
        let reach = reach_from(map, place);
        let mut closures = Vec::new();
        let mut best: Option<(f64, Candidate)> = None;
        for known in map.places().iter().filter(|known| known.id < place && known.is_visited()) {
            let Some(gate) = self.gate(&reach, coordinates, known.id, place) else { continue };
            let (Some(old), Some(new)) = (known.signature(), map.place(place).and_then(|p| p.signature())) else {
                continue;
            };
            match self.look(old, new, &gate) {
                Ok((score, displacement)) => {
                    if best.as_ref().is_none_or(|(other, _)| score > *other) {
                        best = Some((score, Candidate { place, known: known.id, displacement }));
                    }
                }
                Err(Some(reason)) => closures.push(Closure {
                    place,
                    known: known.id,
                    displacement: Displacement::isotropic(Vector2::zeros(), 1.0),
                    verdict: Verdict::Refused(reason),
                }),
                Err(None) => {}
            }
        }
        if let Some((_, candidate)) = best {
            closures.extend(self.confirm(candidate, coordinates));
        }
        closures
    }

    /// How far the two places may lie apart, or `None` if they cannot be the same or have nothing to tell each other.
    fn gate(&self, reach: &[Option<Reach>], coordinates: &Coordinates, known: PlaceId, place: PlaceId) -> Option<Gate> {
        let reach = reach.get(known.index()).copied().flatten()?;
        if reach.path < RECENT_SPACINGS * self.spacing {
            return None;
        }
        let expected = coordinates.map_from_place(known).inverse() * coordinates.map_from_place(place);
        let slack = (self.gate_sigma * reach.position_variance.sqrt()).min(WIDEST_GATE);
        let distance = expected.translation.vector.norm();
        (distance <= slack + OVERLAP).then_some(Gate { expected, slack, turn_sigma: reach.turn_variance.sqrt() })
    }

    /// Compares two signatures; `Err(None)` where they simply do not look alike.
    fn look(&self, old: &Signature, new: &Signature, gate: &Gate) -> Result<(f64, Displacement), Option<String>> {
        let turn_window = (3.0 * gate.turn_sigma).min(std::f64::consts::PI);
        let options = AlignOptions {
            reach: gate.slack.max(OVERLAP) + 0.4,
            turn_window: if gate.turn_sigma > 0.0 { turn_window } else { 0.0 },
            ..self.align.clone()
        };
        let alignment = align(old, new, &options);
        if alignment.score < self.floor {
            return Err(None);
        }
        if alignment.contradiction > CONTRADICTION {
            let percent = 100.0 * alignment.contradiction;
            return Err(Some(format!("{percent:.0} % of the cells contradict each other")));
        }
        if alignment.ambiguity == Ambiguity::Everywhere {
            return Err(Some("the views fit anywhere".into()));
        }
        let displacement = measured(&alignment, gate.turn_sigma > 0.0);
        let off = displacement.vector - gate.expected.translation.vector;
        let spread = displacement.covariance + Matrix2::identity() * (gate.slack / self.gate_sigma).powi(2);
        let chi2 = spread.try_inverse().map_or(f64::INFINITY, |information| (off.transpose() * information * off)[0]);
        if chi2 > CHI2_99 {
            return Err(Some(format!("it would lie {:.1} σ off (limit 3)", chi2.sqrt())));
        }
        Ok((alignment.score, displacement))
    }

    /// Keeps a resemblance until enough successive ones lie to each other in the same way; then all of them hold.
    fn confirm(&mut self, candidate: Candidate, coordinates: &Coordinates) -> Vec<Closure> {
        let mut agreeing: Vec<usize> = Vec::new();
        for (index, other) in self.pending.iter().enumerate() {
            if agrees(&candidate, other, coordinates) {
                agreeing.push(index);
            }
        }
        let held = agreeing.len() + 1 >= self.agreement;
        let mut closures = Vec::new();
        if held {
            for index in agreeing.into_iter().rev() {
                closures.push(accepted(self.pending.remove(index)));
            }
            closures.reverse();
            closures.push(accepted(candidate));
        } else {
            self.pending.push(candidate);
        }
        closures
    }
}

/// Where a known place is expected from another one.
#[derive(Debug, Clone, Copy)]
struct Gate {
    expected: Isometry2<f64>,
    slack: f64,
    turn_sigma: f64,
}

fn accepted(candidate: Candidate) -> Closure {
    let Candidate { place, known, displacement } = candidate;
    Closure { place, known, displacement, verdict: Verdict::Accepted }
}

/// The displacement that an alignment measures, with its floor of one cell's share.
fn measured(alignment: &Alignment, turns: bool) -> Displacement {
    let covariance = alignment.covariance.fixed_view::<2, 2>(0, 0).into_owned() + Matrix2::identity() * 0.05f64.powi(2);
    let turn = turns.then(|| Turn { change: alignment.turn, variance: alignment.covariance[(2, 2)] + 1e-4 });
    Displacement { vector: alignment.offset, covariance, turn }
}

/// Whether two resemblances tell the same story: known → place → other place → other known → known must close.
///
/// Only short stretches of the map are used, from place to other place and from known to other known, which no
/// suspect link bends.
fn agrees(one: &Candidate, other: &Candidate, coordinates: &Coordinates) -> bool {
    if one.place == other.place {
        return false;
    }
    let between = |a: PlaceId, b: PlaceId| coordinates.map_from_place(a).inverse() * coordinates.map_from_place(b);
    let there = between(one.known, other.known) * other.displacement.from_place_from_to_place();
    let here = one.displacement.from_place_from_to_place() * between(one.place, other.place);
    let gap = here.translation.vector - there.translation.vector;
    let driven = between(one.place, other.place).translation.vector.norm()
        + between(one.known, other.known).translation.vector.norm();
    let spread = one.displacement.covariance
        + other.displacement.covariance
        + Matrix2::identity() * (0.05f64.powi(2) * driven.max(1.0));
    spread.try_inverse().is_some_and(|information| (gap.transpose() * information * gap)[0] < CHI2_99)
}

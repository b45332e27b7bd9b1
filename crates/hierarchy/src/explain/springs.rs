use nalgebra::{Isometry2, Matrix2, Point2, Vector2};
use relaxation::{Covariance, Network, Spring};
use topo_map::{Displacement, LinkId, PlaceId};

use crate::mapper::{Mapper, MapperError};
use crate::recognize::Closure;

/// The measured links in the map's axes, with what the relaxed map says of each of them and of every loop that was weighed.
pub(super) struct Springs {
    /// Where the places are.
    pub(super) positions: Vec<Point2<f64>>,
    /// Where dead reckoning had them, and how it turned their axes.
    pub(super) before: Vec<Isometry2<f64>>,
    /// The springs of the map alone.
    pub(super) network: Network,
    /// The spring of each link; `None` for one that counts for nothing.
    spring_of: Vec<Option<usize>>,
    /// Of the map's springs, then of the decisions.
    covariance: Covariance,
    /// Where the decisions begin among the springs of `covariance`.
    decided: usize,
}

/// How far a claim is from the map.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Strain {
    /// Where the map has the end, less where the claim has it, in the map's axes, in metres.
    pub(super) residual: Vector2<f64>,
    /// The standard deviation that such a residual may have along its own direction, in metres.
    pub(super) sigma: f64,
    /// Its squared distance in standard deviations; 0 where nothing checks the claim.
    pub(super) chi2: f64,
}

/// A decision must not hold the map, only be looked at from it: so loose a spring holds nothing (m²).
const LOOSE: f64 = 1e8;
/// Of a direction in which the rest of the map checks less than this share of a link, nothing can be said.
const UNCHECKED: f64 = 1e-6;

impl Springs {
    pub(super) fn new(mapper: &Mapper) -> Result<Self, MapperError> {
        let (map, coordinates) = (mapper.topology(), mapper.coordinates());
        let network = coordinates.problem(map)?.network_at(&coordinates.padded(map))?;
        let mut number = 0;
        let spring_of = map.links().iter().map(|link| {
            link.is_measured().then(|| {
                number += 1;
                number - 1
            })
        });
        let spring_of: Vec<_> = spring_of.collect();
        let mut springs = network.springs().to_vec();
        // What was believed may have been dropped since: every decision is looked at.
        let decided = springs.len();
        springs.extend(mapper.closures().iter().map(loose));
        let all =
            Network::from_vec(network.len(), springs).map_err(crate::coordinates::problem::RelaxationError::from)?;
        let positions = map.places().iter().map(|place| position(mapper, place.id)).collect();
        let before = mapper.dead_reckoning();
        Ok(Self { positions, before, network, spring_of, covariance: Covariance::new(&all), decided })
    }

    /// The spring of a link that counts.
    pub(super) fn of(&self, link: LinkId) -> Option<usize> {
        self.spring_of.get(link.index()).copied().flatten()
    }

    /// How uncertain a place is relative to the first one, in m².
    pub(super) fn node(&self, place: PlaceId) -> Matrix2<f64> {
        self.covariance.node(place.index())
    }

    /// How far a link of the map is from what all the others say.
    pub(super) fn strain(&self, spring: usize) -> Strain {
        let s = self.network.springs()[spring];
        let residual = self.positions[s.to] - self.positions[s.from] - s.rest;
        checked(residual, &s.covariance, &(s.covariance - self.covariance.displacement(spring)))
    }

    /// How far a loop that is no part of the map is from it, by the number of the decision.
    pub(super) fn apart(&self, decision: usize, mapper: &Mapper, closure: &Closure) -> Strain {
        let from = mapper.coordinates().map_from_place(closure.place);
        let (rest, covariance) = seen_from(&from, &closure.displacement);
        let residual = position(mapper, closure.known) - position(mapper, closure.place) - rest;
        let sum = covariance + self.covariance.displacement(self.decided + decision);
        checked(residual, &sum, &sum)
    }

    /// The residual that a claim had by dead reckoning.
    pub(super) fn before(&self, from: PlaceId, to: PlaceId, claim: &Displacement) -> Vector2<f64> {
        let at = |place: PlaceId| self.before.get(place.index()).copied().unwrap_or_else(Isometry2::identity);
        at(to).translation.vector - at(from).translation.vector - seen_from(&at(from), claim).0
    }
}

/// `residual` against the covariance that it may have, leaving out the directions in which `own`, the covariance of the
/// claim, is not checked by anything.
fn checked(residual: Vector2<f64>, own: &Matrix2<f64>, may_have: &Matrix2<f64>) -> Strain {
    let unchecked = Strain { residual, sigma: 0.0, chi2: 0.0 };
    let Some(whiten) = own.cholesky().and_then(|factor| factor.l().try_inverse()) else { return unchecked };
    let share = (whiten * may_have * whiten.transpose()).symmetric_eigen();
    let white = share.eigenvectors.transpose() * (whiten * residual);
    let chi2 = |axis: usize| {
        let value = share.eigenvalues[axis];
        if value > UNCHECKED { white[axis].powi(2) / value } else { 0.0 }
    };
    let along = residual.try_normalize(1e-9).unwrap_or_else(Vector2::x);
    let sigma = (along.transpose() * may_have * along)[0].max(0.0).sqrt();
    Strain { residual, sigma, chi2: chi2(0) + chi2(1) }
}

/// Where a claim made at a place leads, in the map's axes; with its covariance.
fn seen_from(map_from_place: &Isometry2<f64>, claim: &Displacement) -> (Vector2<f64>, Matrix2<f64>) {
    // A claim without a turn is a vector in the map's axes, one with a turn in those of its first place.
    let axes = map_from_place.rotation.to_rotation_matrix();
    match claim.turn {
        Some(_) => (axes * claim.vector, axes * claim.covariance * axes.transpose()),
        None => (claim.vector, claim.covariance),
    }
}

pub(super) fn is_refused(closure: &Closure) -> bool {
    !closure.is_accepted()
}

fn position(mapper: &Mapper, place: PlaceId) -> Point2<f64> {
    mapper.coordinates().map_from_place(place).translation.vector.into()
}

fn loose(closure: &Closure) -> Spring {
    Spring::isotropic(closure.place.index(), closure.known.index(), Vector2::zeros(), LOOSE)
}

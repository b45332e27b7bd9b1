//! Which place the robot is at, and which places are one.

use std::sync::Arc;

use local_grid::{AlignOptions, Signature, align, unseen_by_sonar};
use nalgebra::{Matrix2, Point2, Vector2};
use relaxation::NetworkError;
use topo_map::{DeadReckoning, Identity, NearbyOptions, Place, PlaceId, PlaceLikelihood, Supposed, identify_nearby};

use super::ExplorationError;
use super::optimum::Optimum;
use crate::mapper::Mapper;

/// Where the robot last knew to be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    pub(super) place: PlaceId,
    /// The place's centre in the track frame.
    pub(super) center: Point2<f64>,
    /// The covariance of that, in m².
    pub(super) covariance: Matrix2<f64>,
    /// Where the robot was then, in the track frame.
    pub(super) at: Point2<f64>,
    /// Metres driven by then.
    pub(super) travelled: f64,
}

impl Known {
    /// How surely the robot is known, seen from this place, when it has come `to` somewhere and `driven` so far.
    pub(super) fn uncertainty(&self, to: Point2<f64>, driven: f64, model: &DeadReckoning) -> Matrix2<f64> {
        self.covariance + model.covariance(to - self.at, driven)
    }
}

/// The score of the alignment of two unlike views.
const UNLIKE: f64 = 0.55;
/// The least standard deviation of an alignment of sonar views, in metres: the echoes travel along with the robot, so that
/// views taken half a metre apart seem nearer than they are (measured on simulated Polaroids: 0.2 to 0.3 m).
const ALIGNMENT_FLOOR: f64 = 0.3;
/// The standard deviation of a guess, in metres: so large that it moves nothing.
const GUESS: f64 = 10.0;
/// Visited places that lie so near to each other, in metres, are one...
const DOUBLED: f64 = 0.75;
/// ...if their relative position is so well known, in metres...
const SURE: f64 = 0.45;
/// ...and their views are not this much likelier at different places.
const DIFFERENT: f64 = 0.5;

/// Compares the view with those of the places near where the robot should be.
pub(super) fn identify(
    mapper: &Mapper,
    optimum: &Optimum,
    last: Option<&Known>,
    model: &DeadReckoning,
) -> Result<Identity<Arc<Signature>>, ExplorationError> {
    let travelled = mapper.tracker().travelled();
    let view = mapper.view(travelled - mapper.config().places.spacing_m).map_err(ExplorationError::from)?;
    let Some(last) = last else { return Ok(Identity::New { signature: view }) };
    let at = Point2::from(mapper.track_from_robot().translation.vector);
    let covariance = last.uncertainty(at, travelled - last.travelled, model);
    let supposed = Supposed { place: last.place, offset: at - last.center, covariance };
    let position = |place: PlaceId| Some(position(mapper, place));
    let compare = |place, signature: &Arc<Signature>| compare(place, signature, &view);
    let seen = optimum.seen_from(last.place)?;
    let between = |place| seen.covariance(place);
    let options = NearbyOptions::default();
    Ok(identify_nearby(mapper.topology(), &supposed, Arc::clone(&view), &options, position, between, compare))
}

/// Whether the robot may stand at a place that it knows, though that cannot be said: it went there, or by the coordinates it
/// is there, and what it sees does not speak against it.
pub(super) fn may_be_known(mapper: &Mapper, last: Option<&Known>, expected: Option<PlaceId>, view: &Signature) -> bool {
    let Some(last) = last else { return false };
    let NearbyOptions { place_radius, unlike, .. } = NearbyOptions::default();
    let at = Point2::from(mapper.track_from_robot().translation.vector);
    let here = position(mapper, last.place) + (at - last.center);
    let near = |place: &&Place<Arc<Signature>>| {
        expected == Some(place.id) || (position(mapper, place.id) - here).norm() <= place_radius
    };
    let like = |place: &Place<Arc<Signature>>| {
        place.signature().is_some_and(|known| compare(place.id, known, view).is_none_or(|seen| seen.ratio >= unlike))
    };
    mapper.topology().places().iter().filter(near).any(like)
}

/// Two visited places that are one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Doubled {
    /// The newer of the two...
    pub(super) absorbed: PlaceId,
    /// ...and the older.
    pub(super) kept: PlaceId,
    /// Where the newer lies in the older, in metres, and the covariance of that, in m².
    pub(super) offset: Vector2<f64>,
    pub(super) covariance: Matrix2<f64>,
}

/// Two visited places that are one, if there are any.
pub(super) fn doubled(mapper: &Mapper, optimum: &Optimum) -> Result<Option<Doubled>, NetworkError> {
    let visited = in_order_of_visits(mapper);
    for (index, newer) in visited.iter().enumerate() {
        for older in &visited[..index] {
            let offset = position(mapper, newer.id) - position(mapper, older.id);
            if offset.norm() >= DOUBLED || !look_alike(newer, older) {
                continue;
            }
            let covariance = optimum.seen_from(older.id)?.covariance(newer.id);
            let sure = |c: &Matrix2<f64>| c.symmetric_eigenvalues().max() <= SURE.powi(2);
            if let Some(covariance) = covariance.filter(sure) {
                return Ok(Some(Doubled { absorbed: newer.id, kept: older.id, offset, covariance }));
            }
        }
    }
    Ok(None)
}

/// The visited places, in the order in which the robot came to them first.
fn in_order_of_visits(mapper: &Mapper) -> Vec<&Place<Arc<Signature>>> {
    let mut seen = vec![false; mapper.topology().places().len()];
    let anchors = mapper.trajectory().anchors().iter();
    let first = anchors.filter(|anchor| !std::mem::replace(&mut seen[anchor.place.index()], true));
    first.filter_map(|anchor| mapper.topology().place(anchor.place)).filter(|place| place.is_visited()).collect()
}

fn look_alike(newer: &Place<Arc<Signature>>, older: &Place<Arc<Signature>>) -> bool {
    let (Some(new), Some(old)) = (newer.signature(), older.signature()) else { return false };
    compare(older.id, old, new).is_none_or(|likeness| likeness.ratio >= DIFFERENT)
}

fn position(mapper: &Mapper, place: PlaceId) -> Point2<f64> {
    mapper.coordinates().map_from_place(place).translation.vector.into()
}

/// How much a view speaks for a place: the score of their alignment against that of unlike views.
fn compare(place: PlaceId, known: &Signature, view: &Signature) -> Option<PlaceLikelihood> {
    let found = align(known, view, &AlignOptions::default());
    let ratio = (12.0 * (found.score - UNLIKE) - 4.0 * found.contradiction).exp();
    // Guessed often enough, a guess would count as a measurement.
    let unsaid = found.ambiguity.unknown() * GUESS.powi(2);
    let floor = Matrix2::identity() * ALIGNMENT_FLOOR.powi(2) + unseen_by_sonar(known) + unsaid;
    let covariance = found.covariance.fixed_view::<2, 2>(0, 0).into_owned() + floor;
    let offset: Vector2<f64> = found.offset;
    (found.score > 0.0).then_some(PlaceLikelihood { place, ratio, offset, covariance, turn: found.turn })
}

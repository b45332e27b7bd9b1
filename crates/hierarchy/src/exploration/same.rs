//! Which place the robot is at, and which places are one.

use std::sync::Arc;

use local_grid::{AlignOptions, Signature, align, unseen_by_sonar};
use nalgebra::{Matrix2, Point2, Vector2};
use topo_map::{Identity, NearbyOptions, Place, PlaceId, PlaceLikelihood, Supposed, identify_nearby};

use crate::mapper::{Mapper, MapperError};
use crate::reach::reach_from;

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
    ///
    /// Wheels count metres well, but a heading that is wrong for some metres carries the robot sideways; what was driven
    /// beyond the straight line went into all directions.
    fn uncertainty(&self, to: Point2<f64>, driven: f64) -> Matrix2<f64> {
        let moved = to - self.at;
        let straight = moved.norm().min(driven);
        let ahead = moved.try_normalize(1e-6).unwrap_or_else(Vector2::zeros);
        let side = Vector2::new(-ahead.y, ahead.x);
        let isotropic = Matrix2::identity() * (0.5 * (ALONG + SIDEWAYS) * (driven - straight));
        self.covariance
            + ahead * ahead.transpose() * (ALONG * straight)
            + side * side.transpose() * (SIDEWAYS * straight)
            + isotropic
    }
}

/// Variance of dead reckoning in m² per metre driven along the way (3 % of a metre) and across it (a heading wrong by 3 to
/// 4° over some metres).
const ALONG: f64 = 0.0008;
const SIDEWAYS: f64 = 0.012;

/// The score of the alignment of two unlike views.
const UNLIKE: f64 = 0.55;
/// The least standard deviation of an alignment of sonar views, in metres: the echoes travel along with the robot, so that
/// views taken half a metre apart seem nearer than they are (measured on simulated Polaroids: 0.2 to 0.3 m).
const ALIGNMENT_FLOOR: f64 = 0.3;
/// Visited places that lie so near to each other, in metres, are one...
const DOUBLED: f64 = 0.65;
/// ...if their relative position is so well known, in metres...
const SURE: f64 = 0.6;
/// ...and their views are not this much likelier at different places.
const DIFFERENT: f64 = 0.5;

/// Compares the view with those of the places near where the robot should be.
pub(super) fn identify(mapper: &Mapper, last: Option<&Known>) -> Result<Identity<Arc<Signature>>, MapperError> {
    let travelled = mapper.tracker().travelled();
    let view = mapper.view(travelled - mapper.config().places.spacing_m)?;
    let Some(last) = last else { return Ok(Identity::New { signature: view }) };
    let at = Point2::from(mapper.track_from_robot().translation.vector);
    let covariance = last.uncertainty(at, travelled - last.travelled);
    let supposed = Supposed { place: last.place, offset: at - last.center, covariance };
    let position = |place: PlaceId| Some(position(mapper, place));
    let compare = |place, signature: &Arc<Signature>| compare(place, signature, &view);
    let options = NearbyOptions::default();
    Ok(identify_nearby(mapper.topology(), &supposed, Arc::clone(&view), &options, position, compare))
}

/// Two visited places that are one: the newer, the older, and where the newer lies in the older.
pub(super) fn doubled(mapper: &Mapper) -> Option<(PlaceId, PlaceId, Vector2<f64>)> {
    let visited = in_order_of_visits(mapper);
    for (index, newer) in visited.iter().enumerate() {
        for older in &visited[..index] {
            let offset = position(mapper, newer.id) - position(mapper, older.id);
            if offset.norm() < DOUBLED && is_one(mapper, newer, older) {
                return Some((newer.id, older.id, offset));
            }
        }
    }
    None
}

/// The visited places, in the order in which the robot came to them first.
fn in_order_of_visits(mapper: &Mapper) -> Vec<&Place<Arc<Signature>>> {
    let mut seen = vec![false; mapper.topology().places().len()];
    let anchors = mapper.trajectory().anchors().iter();
    let first = anchors.filter(|anchor| !std::mem::replace(&mut seen[anchor.place.index()], true));
    first.filter_map(|anchor| mapper.topology().place(anchor.place)).filter(|place| place.is_visited()).collect()
}

fn is_one(mapper: &Mapper, newer: &Place<Arc<Signature>>, older: &Place<Arc<Signature>>) -> bool {
    let reach = reach_from(mapper.topology(), newer.id, &[older.id]);
    let sure = reach[0].is_some_and(|reach| reach.position_variance <= SURE * SURE);
    let (Some(new), Some(old)) = (newer.signature(), older.signature()) else { return false };
    sure && compare(older.id, old, new).is_none_or(|likeness| likeness.ratio >= DIFFERENT)
}

fn position(mapper: &Mapper, place: PlaceId) -> Point2<f64> {
    mapper.coordinates().map_from_place(place).translation.vector.into()
}

/// How much a view speaks for a place: the score of their alignment against that of unlike views.
fn compare(place: PlaceId, known: &Signature, view: &Signature) -> Option<PlaceLikelihood> {
    let found = align(known, view, &AlignOptions::default());
    let ratio = (12.0 * (found.score - UNLIKE) - 4.0 * found.contradiction).exp();
    let floor = Matrix2::identity() * ALIGNMENT_FLOOR.powi(2) + unseen_by_sonar(known);
    let covariance = found.covariance.fixed_view::<2, 2>(0, 0).into_owned() + floor;
    let offset: Vector2<f64> = found.offset;
    (found.score > 0.0).then_some(PlaceLikelihood { place, ratio, offset, covariance, turn: found.turn })
}

use nalgebra::{Isometry2, Point2, Vector2};

use super::path::TimedPath;
use super::recognition::Recognition;
use crate::mapper::Mapper;
use crate::recognize::Closure;
use crate::trajectory::Anchor;

/// Places apart by less than this many spacings of travel are no revisits of each other.
const RECENT_SPACINGS: f64 = 8.0;
/// Seconds from pose to pose over which the truth is interpolated.
const LONGEST_GAP: f64 = 2.0;

/// How well the places of a finished map were recognised, given where the robot truly was.
///
/// An accepted closure is right where the place that it names truly lies within one spacing of where it says, or farther
/// only along an axis of which its covariance says that it knows nothing (99 %), such as that of a corridor. A place is
/// a revisit where the robot truly was within one spacing of an earlier one, after a way of some length.
/// `None` where no two places have a truth.
#[must_use]
pub fn recognition(mapper: &Mapper, truth: &TimedPath) -> Option<Recognition> {
    let spacing = mapper.config().places.spacing_m;
    let visit = |anchor: &Anchor| {
        let map_from_robot = truth.between(anchor.stamp, LONGEST_GAP)?;
        Some((*anchor, map_from_robot * anchor.place_from_robot.inverse()))
    };
    let visits: Vec<(Anchor, Isometry2<f64>)> = mapper.trajectory().anchors().iter().filter_map(visit).collect();
    if visits.len() < 2 {
        return None;
    }
    let true_place = |place| visits.iter().find(|(anchor, _)| anchor.place == place).map(|(_, pose)| pose);
    let is_right = |closure: &Closure| {
        let (place, known) = (true_place(closure.place)?, true_place(closure.known)?);
        let off = place.inverse() * Point2::from(known.translation.vector) - closure.displacement.vector;
        Some(is_admitted(off.coords, closure, spacing))
    };
    let accepted = mapper.closures().iter().filter(|closure| closure.is_accepted());
    let judged: Vec<(&Closure, bool)> = accepted.filter_map(|closure| Some((closure, is_right(closure)?))).collect();
    let is_revisit = |index: usize| {
        let (anchor, pose) = &visits[index];
        visits[..index].iter().any(|(earlier, other)| {
            anchor.travelled - earlier.travelled >= RECENT_SPACINGS * spacing
                && (pose.translation.vector - other.translation.vector).norm() <= spacing
        })
    };
    let revisits: Vec<usize> = (0..visits.len()).filter(|index| is_revisit(*index)).collect();
    let is_recognized = |index: &&usize| {
        let place = visits[**index].0.place;
        judged.iter().any(|(closure, right)| *right && closure.place == place)
    };
    Some(Recognition {
        claimed: judged.len(),
        right: judged.iter().filter(|(_, right)| *right).count(),
        revisits: revisits.len(),
        recognized: revisits.iter().filter(is_recognized).count(),
    })
}

/// Whether a closure may be `off` by so much and still be right.
fn is_admitted(off: Vector2<f64>, closure: &Closure, spacing: f64) -> bool {
    let inverse = closure.displacement.covariance.try_inverse();
    off.norm() <= spacing || inverse.is_some_and(|inverse| (off.transpose() * inverse * off)[0] <= CHI2_99)
}

/// 99 % of the χ² distribution with two degrees of freedom.
const CHI2_99: f64 = 9.21;

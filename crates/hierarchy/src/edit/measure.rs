use std::fmt;

use nalgebra::{Matrix2, Vector2};
use robot_log::local_grid::{AlignOptions, Ambiguity, align};
use serde::{Deserialize, Serialize};
use topo_map::{Displacement, PlaceId, Turn};

use super::{ANY_TURN, turns};
use crate::mapper::Mapper;

/// Where one place lies as seen from another, as a person says or two views show.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// From the centre of the first place to that of the second, in metres: in the map's axes where a compass holds them,
    /// else in those of the first place where `turn_deg` is given, and in those of the map as it is where it is not.
    pub vector_m: [f64; 2],
    /// How sure that is, as a standard deviation in metres.
    pub sigma_m: f64,
    /// The turn from the first place's axes to the second's, in degrees, where a map without a compass needs one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_deg: Option<f64>,
}

/// How far two views may be laid apart, in metres, and how well they must fit to be believed.
const REACH: f64 = 1.6;
const FITS: f64 = 0.5;
/// Half a cell and the walls' own roughness, in metres.
const FLOOR: f64 = 0.12;
/// The standard deviation of a turn that two views show, in radians.
const TURN_SIGMA: f64 = 0.02;

/// Measures where `to` lies as seen from `from` by laying their views onto each other; `None` where they do not fit.
#[must_use]
pub fn measure(mapper: &Mapper, from: PlaceId, to: PlaceId) -> Option<Measured> {
    let view = |place: PlaceId| mapper.topology().place(place).and_then(|place| place.signature());
    let turns = turns(mapper);
    let turn_window = if turns { std::f64::consts::PI } else { 0.0 };
    let options = AlignOptions { reach: REACH, turn_window, ..AlignOptions::default() };
    let found = align(view(from)?, view(to)?, &options);
    if found.score < FITS || found.ambiguity == Ambiguity::Everywhere {
        return None;
    }
    let variance = found.covariance.fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigenvalues().max().max(0.0);
    let sigma = (variance + FLOOR * FLOOR).sqrt();
    let round = |value: f64| (value * 1e4).round() / 1e4; // as it is written into the list
    Some(Measured {
        vector_m: [round(found.offset.x), round(found.offset.y)],
        sigma_m: round(sigma),
        turn_deg: turns.then(|| round(found.turn.to_degrees())),
    })
}

impl Measured {
    /// The measurement for the topological map.
    pub(super) fn displacement(&self, mapper: &Mapper, from: PlaceId, to: PlaceId) -> Displacement {
        let covariance = Matrix2::identity() * self.sigma_m * self.sigma_m;
        let vector = Vector2::from(self.vector_m);
        if !turns(mapper) {
            return Displacement { vector, covariance, turn: None };
        }
        let heading = |place: PlaceId| mapper.coordinates().map_from_place(place).rotation;
        match self.turn_deg {
            Some(turn) => {
                let turn = Turn { change: turn.to_radians(), variance: TURN_SIGMA * TURN_SIGMA };
                Displacement { vector, covariance, turn: Some(turn) }
            }
            None => {
                let change = (heading(from).inverse() * heading(to)).angle();
                let vector = heading(from).inverse() * vector;
                Displacement { vector, covariance, turn: Some(Turn { change, variance: ANY_TURN }) }
            }
        }
    }
}

impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.vector_m;
        write!(f, "({x:+.2}, {y:+.2}) ± {:.2} m", self.sigma_m)?;
        match self.turn_deg {
            Some(turn) => write!(f, ", turned by {turn:.1}°"),
            None => Ok(()),
        }
    }
}

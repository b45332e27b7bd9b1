use nalgebra::{Matrix3, Point2, Vector2};
use robot_log::local_grid::{FollowedWall, WallEcho};
use serde::{Deserialize, Serialize};

use super::records::{Pose, isometry, pose};
use super::v2::contradiction;
use super::{SessionError, v3};
use crate::front_end::KnownWalls;
use crate::front_end::wall_heading::{Belief, Needle, Scatter, WallMemory};
use crate::mapper::{Mapper, Restored};

/// Version 4 of a session: what version 3 holds, the walls along which the robot drives with what they and a compass have
/// taught of its heading, and how the way from the last place goes with that heading.
#[derive(Serialize, Deserialize)]
pub(super) struct Session {
    session: v3::Session,
    walls: Option<StoredWalls>,
    with_heading: [f64; 2],
}

#[derive(Serialize, Deserialize)]
struct StoredWalls {
    held: bool,
    followed: Vec<StoredWall>,
    last: Option<Pose>,
    belief: StoredBelief,
    told: f64,
}

#[derive(Serialize, Deserialize)]
struct StoredWall {
    /// Position of the sensor, range, and the turn that was believed then.
    echoes: Vec<[f64; 4]>,
    normal: f64,
    depth: f64,
    sigma: f64,
    residual: f64,
    length: f64,
}

#[derive(Serialize, Deserialize)]
struct StoredBelief {
    turned: f64,
    building: Option<f64>,
    drift: f64,
    covariance: [f64; 9],
    /// Metres driven since the compass was heard, and after which its disturbance is another one.
    needle: Option<[f64; 2]>,
    walls: u32,
    agreement: f64,
}

impl From<v3::Session> for Session {
    fn from(old: v3::Session) -> Self {
        Self { session: old, walls: None, with_heading: [0.0; 2] }
    }
}

impl Session {
    pub(super) fn of(mapper: &Mapper) -> Self {
        Self {
            session: v3::Session::of(mapper),
            walls: mapper.memory().taught.walls.as_ref().map(StoredWalls::from),
            with_heading: mapper.travel_along_heading().into(),
        }
    }

    /// Checks everything that a map relies on.
    pub(super) fn restore(self) -> Result<Restored, SessionError> {
        let Self { session, walls, with_heading: [x, y] } = self;
        if !(x.is_finite() && y.is_finite()) {
            return Err(contradiction(format!("a way that goes by ({x}, {y}) with its heading")));
        }
        let mut restored = session.restore()?;
        if let (Some(walls), Some(memory)) = (walls, &mut restored.memory) {
            memory.taught.walls = Some(walls.restored()?);
        }
        let tracker = restored.tracker.with_travel_along_heading(Vector2::new(x, y));
        Ok(Restored { tracker, ..restored })
    }
}

impl From<&KnownWalls> for StoredWalls {
    fn from(KnownWalls { held, memory }: &KnownWalls) -> Self {
        Self {
            held: *held,
            followed: memory.followed.iter().map(StoredWall::from).collect(),
            last: memory.last.as_ref().map(pose),
            belief: (&memory.belief).into(),
            told: memory.told,
        }
    }
}

impl StoredWalls {
    fn restored(self) -> Result<KnownWalls, SessionError> {
        let Self { held, followed, last, belief, told } = self;
        let belief = belief.restored()?;
        let followed = followed.into_iter().map(StoredWall::restored).collect::<Result<_, _>>()?;
        if !told.is_finite() {
            return Err(contradiction(format!("a heading turned by {told}")));
        }
        let last = last.as_ref().map(isometry).transpose()?;
        Ok(KnownWalls { held, memory: WallMemory { followed, last, belief, told } })
    }
}

impl From<&FollowedWall> for StoredWall {
    fn from(wall: &FollowedWall) -> Self {
        let echo = |echo: &WallEcho| [echo.from.x, echo.from.y, echo.range, echo.marked];
        let FollowedWall { echoes, normal, depth, sigma, residual, length } = wall;
        Self {
            echoes: echoes.iter().map(echo).collect(),
            normal: *normal,
            depth: *depth,
            sigma: *sigma,
            residual: *residual,
            length: *length,
        }
    }
}

impl StoredWall {
    fn restored(self) -> Result<FollowedWall, SessionError> {
        let Self { echoes, normal, depth, sigma, residual, length } = self;
        let line = [normal, depth, sigma, residual, length];
        if echoes.is_empty() || !line.iter().chain(echoes.iter().flatten()).all(|number| number.is_finite()) {
            return Err(contradiction(format!("a wall of {} echoes at {depth} m towards {normal}", echoes.len())));
        }
        let echo = |[x, y, range, marked]: [f64; 4]| WallEcho { from: Point2::new(x, y), range, marked };
        Ok(FollowedWall { echoes: echoes.into_iter().map(echo).collect(), normal, depth, sigma, residual, length })
    }
}

impl From<&Belief> for StoredBelief {
    fn from(belief: &Belief) -> Self {
        let Belief { turned, building, drift, covariance, needle, walls, agreement, .. } = belief;
        let mut numbers = [0.0; 9];
        numbers.copy_from_slice(covariance.as_slice());
        Self {
            turned: *turned,
            building: *building,
            drift: *drift,
            covariance: numbers,
            needle: needle.map(|Needle { driven, memory }| [driven, memory]),
            walls: *walls,
            agreement: *agreement,
        }
    }
}

impl StoredBelief {
    fn restored(self) -> Result<Belief, SessionError> {
        let Self { turned, building, drift, covariance, needle, walls, agreement } = self;
        let needle_makes_sense =
            needle.is_none_or(|[driven, memory]| driven.is_finite() && memory.is_finite() && memory > 0.0);
        let numbers = [turned, drift, agreement, building.unwrap_or(0.0)];
        if !(needle_makes_sense && numbers.iter().chain(&covariance).all(|number| number.is_finite())) {
            return Err(contradiction(format!("a heading turned by {turned} beside a compass {needle:?}")));
        }
        Ok(Belief {
            turned,
            building,
            drift,
            covariance: Matrix3::from_column_slice(&covariance),
            needle: needle.map(|[driven, memory]| Needle { driven, memory }),
            walls,
            agreement,
            scatter: Scatter::default(),
        })
    }
}

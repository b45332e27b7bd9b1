use serde::{Deserialize, Serialize};

use super::v2::contradiction;
use super::{SessionError, v3, v4};
use crate::front_end::gyro::{GyroBesideWheels, Rest, WheelsSince};
use crate::mapper::{Mapper, Restored};

/// Version 5 of a session: what version 4 holds, and what a gyro knows of the wheels beside it.
#[derive(Serialize, Deserialize)]
pub(super) struct Session {
    session: v4::Session,
    gyro: Option<StoredGyro>,
}

#[derive(Debug, Serialize, Deserialize)]
struct StoredGyro {
    /// Whether the wheels told anything since the gyro's last reading, and whether they moved.
    told: bool,
    moved: bool,
    last: Option<f64>,
    /// Seconds and turn of the gyro that the wheels have not told of yet.
    since: [f64; 2],
    /// Seconds of the present rest and the unexpected turn in them; seconds driven before.
    rest: Option<[f64; 2]>,
    driven: f64,
}

impl From<v3::Session> for Session {
    fn from(old: v3::Session) -> Self {
        v4::Session::from(old).into()
    }
}

impl From<v4::Session> for Session {
    fn from(old: v4::Session) -> Self {
        Self { session: old, gyro: None }
    }
}

impl Session {
    pub(super) fn of(mapper: &Mapper) -> Self {
        Self { session: v4::Session::of(mapper), gyro: mapper.gyro_beside_wheels().as_ref().map(StoredGyro::from) }
    }

    /// Checks everything that a map relies on.
    pub(super) fn restore(self) -> Result<Restored, SessionError> {
        let restored = self.session.restore()?;
        let gyro = self.gyro.map(StoredGyro::restored).transpose()?.unwrap_or_default();
        let tracker = restored.tracker.with_gyro_beside_wheels(gyro);
        Ok(Restored { tracker, ..restored })
    }
}

impl From<&GyroBesideWheels> for StoredGyro {
    fn from(GyroBesideWheels { wheels, rest }: &GyroBesideWheels) -> Self {
        Self {
            told: wheels.told,
            moved: wheels.moved,
            last: wheels.last,
            since: [wheels.seconds, wheels.turned],
            rest: rest.so_far.map(|(seconds, turned)| [seconds, turned]),
            driven: rest.driven,
        }
    }
}

impl StoredGyro {
    fn restored(self) -> Result<GyroBesideWheels, SessionError> {
        let Self { told, moved, last, since, rest, driven } = self;
        let single = [last.unwrap_or(0.0), driven];
        let mut numbers = since.iter().chain(rest.iter().flatten()).chain(&single);
        if !numbers.all(|number| number.is_finite()) {
            return Err(contradiction(format!("a gyro beside wheels that knows no numbers: {since:?}, {rest:?}")));
        }
        let [seconds, turned] = since;
        Ok(GyroBesideWheels {
            wheels: WheelsSince { told, moved, last, seconds, turned },
            rest: Rest { so_far: rest.map(|[seconds, turned]| (seconds, turned)), driven },
        })
    }
}

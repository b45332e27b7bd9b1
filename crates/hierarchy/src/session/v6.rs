use serde::{Deserialize, Serialize};

use super::v2::contradiction;
use super::{SessionError, v5};
use crate::front_end::wall_heading::Scatter;
use crate::mapper::{Mapper, Restored};

/// Version 6 of a session: what version 5 holds, and how true the walls of the building run.
#[derive(Serialize, Deserialize)]
pub(super) struct Session {
    session: v5::Session,
    /// What was learnt of the variance of the walls' directions, in rad², where a robot follows walls.
    scatter: Option<f64>,
}

impl From<v5::Session> for Session {
    fn from(old: v5::Session) -> Self {
        Self { session: old, scatter: None }
    }
}

impl Session {
    pub(super) fn of(mapper: &Mapper) -> Self {
        let walls = mapper.memory().taught.walls;
        Self { session: v5::Session::of(mapper), scatter: walls.map(|walls| walls.memory.belief.scatter.learnt()) }
    }

    /// Checks everything that a map relies on, and builds it.
    pub(super) fn restore(self) -> Result<Mapper, SessionError> {
        let mut restored: Restored = self.session.restore()?;
        let walls = restored.memory.as_mut().and_then(|memory| memory.taught.walls.as_mut());
        if let (Some(walls), Some(learnt)) = (walls, self.scatter) {
            let scatter = Scatter::recalled(learnt);
            walls.memory.belief.scatter =
                scatter.ok_or_else(|| contradiction(format!("walls that scatter by {learnt} rad²")))?;
        }
        Ok(Mapper::restored(restored)?)
    }
}

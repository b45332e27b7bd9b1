use std::collections::BTreeMap;

use nalgebra::Vector2;
use robot_log::local_grid::{Heading, Learnt};
use serde::{Deserialize, Serialize};
use topo_map::{Place, PlaceId, PlaceState};

use super::SessionError;
use super::records::{StoredDisplacement, restored_displacement, stored_displacement};
use super::v2::{self, Known, contradiction};
use crate::coordinates::directions::HeldHeading;
use crate::front_end::Taught;
use crate::mapper::{Mapper, Memory, Restored};
use crate::recognize::proposals::Proposal;
use crate::recognize::{Likeness, View};

/// Version 3 of a session: what version 2 holds, what became of places that were predicted, and what the mapper had in
/// mind, so that a map goes on as if it had never been stored.
#[derive(Serialize, Deserialize)]
pub(super) struct Session {
    map: v2::Session,
    /// The places that are not, or no more, places of their own where the robot has been.
    states: Vec<(u32, StoredState)>,
    memory: Option<StoredMemory>,
}

#[derive(Serialize, Deserialize)]
enum StoredState {
    Predicted { seen_from: u32, toward: f64, confidence: f64 },
    Refuted,
    Merged { into: u32, offset: [f64; 2] },
}

#[derive(Serialize, Deserialize)]
struct StoredMemory {
    /// What the scans of a precise sensor have taught of the building's direction.
    walls: StoredLearnt,
    stretch: Vec<StoredView>,
    /// Stamp, earlier stamp and similarity of what the robot's own recogniser proposed.
    pending: Vec<[f64; 3]>,
    /// Place, heading and variance.
    held: Vec<(u32, f64, f64)>,
}

#[derive(Serialize, Deserialize)]
struct StoredLearnt {
    sum: [f64; 2],
    lessons: u32,
    agreement: f64,
}

#[derive(Serialize, Deserialize)]
struct StoredView {
    place: u32,
    likenesses: Vec<StoredLikeness>,
    most_agreed: u64,
}

#[derive(Serialize, Deserialize)]
struct StoredLikeness {
    known: u32,
    displacement: Option<StoredDisplacement>,
    log_ratio: f64,
    score: f64,
    decided: bool,
}

impl From<v2::Session> for Session {
    fn from(old: v2::Session) -> Self {
        Self { map: old, states: Vec::new(), memory: None }
    }
}

impl Session {
    pub(super) fn of(mapper: &Mapper) -> Self {
        let Memory { taught, stretch, pending, held } = mapper.memory();
        Self {
            map: v2::Session::of(mapper),
            states: mapper.topology().places().iter().filter_map(stored_state).collect(),
            memory: Some(StoredMemory {
                walls: taught.building.into(),
                stretch: stretch.iter().map(StoredView::from).collect(),
                pending: pending.iter().map(|of| [of.stamp, of.earlier, of.similarity]).collect(),
                held: held.iter().map(|held| (held.place.0, held.heading, held.variance)).collect(),
            }),
        }
    }

    /// Checks everything that a map relies on.
    pub(super) fn restore(self) -> Result<Restored, SessionError> {
        let known = self.map.known();
        let state = |(place, state)| Ok((known.place(place)?, restored_state(state, known)?));
        Ok(Restored {
            states: self.states.into_iter().map(state).collect::<Result<BTreeMap<_, _>, SessionError>>()?,
            memory: self.memory.map(|memory| memory.restored(known)).transpose()?,
            ..self.map.restore()?
        })
    }
}

fn stored_state<S>(place: &Place<S>) -> Option<(u32, StoredState)> {
    let state = match place.state {
        PlaceState::Visited { .. } => return None,
        PlaceState::Predicted { seen_from, toward, confidence } => {
            StoredState::Predicted { seen_from: seen_from.0, toward: toward.radians(), confidence }
        }
        PlaceState::Refuted => StoredState::Refuted,
        PlaceState::Merged { into, offset } => StoredState::Merged { into: into.0, offset: offset.into() },
    };
    Some((place.id.0, state))
}

fn restored_state(state: StoredState, known: Known) -> Result<PlaceState<()>, SessionError> {
    Ok(match state {
        StoredState::Predicted { seen_from, toward, confidence } => {
            if !(toward.is_finite() && (0.0..=1.0).contains(&confidence)) {
                return Err(contradiction(format!("a place predicted towards {toward} rad with {confidence}")));
            }
            PlaceState::Predicted {
                seen_from: known.place(seen_from)?,
                toward: Heading::from_radians(toward),
                confidence,
            }
        }
        StoredState::Refuted => PlaceState::Refuted,
        StoredState::Merged { into, offset: [x, y] } => {
            if !(x.is_finite() && y.is_finite()) {
                return Err(contradiction(format!("a place merged at ({x}, {y}) in place {into}")));
            }
            PlaceState::Merged { into: known.place(into)?, offset: Vector2::new(x, y) }
        }
    })
}

impl StoredMemory {
    fn restored(self, known: Known) -> Result<Memory, SessionError> {
        let held = |(place, heading, variance): (u32, f64, f64)| {
            if !(heading.is_finite() && variance > 0.0 && variance.is_finite()) {
                return Err(contradiction(format!("a heading of {heading} ± {variance} held at place {place}")));
            }
            Ok(HeldHeading { place: known.place(place)?, heading, variance })
        };
        let pending = self.pending.into_iter();
        Ok(Memory {
            taught: Taught { building: self.walls.restored()?, walls: None },
            stretch: self.stretch.into_iter().map(|view| view.restored(known)).collect::<Result<_, _>>()?,
            pending: pending.map(|[stamp, earlier, similarity]| Proposal { stamp, earlier, similarity }).collect(),
            held: self.held.into_iter().map(held).collect::<Result<_, _>>()?,
        })
    }
}

impl From<Learnt> for StoredLearnt {
    fn from(Learnt { sum, lessons, agreement }: Learnt) -> Self {
        Self { sum: sum.into(), lessons, agreement }
    }
}

impl StoredLearnt {
    fn restored(self) -> Result<Learnt, SessionError> {
        let Self { sum: [x, y], lessons, agreement } = self;
        if !(x.is_finite() && y.is_finite() && (0.0..=1.0).contains(&agreement)) {
            return Err(contradiction(format!("walls along ({x}, {y}) that agree to {agreement}")));
        }
        Ok(Learnt { sum: Vector2::new(x, y), lessons, agreement })
    }
}

impl From<&View> for StoredView {
    fn from(view: &View) -> Self {
        let likeness = |likeness: &Likeness| StoredLikeness {
            known: likeness.known.0,
            displacement: likeness.displacement.as_ref().map(stored_displacement),
            log_ratio: likeness.log_ratio,
            score: likeness.score,
            decided: likeness.decided,
        };
        Self {
            place: view.place.0,
            likenesses: view.likenesses.iter().map(likeness).collect(),
            most_agreed: view.most_agreed as u64,
        }
    }
}

impl StoredView {
    fn restored(self, known: Known) -> Result<View, SessionError> {
        let place: PlaceId = known.place(self.place)?;
        let likeness = |of: StoredLikeness| {
            let displacement = of.displacement.as_ref().map(restored_displacement);
            if displacement.as_ref().is_some_and(|measured| measured.check().is_err()) {
                return Err(contradiction(format!("place {} seen from place {place} nowhere", of.known)));
            }
            let StoredLikeness { log_ratio, score, decided, .. } = of;
            Ok(Likeness { known: known.place(of.known)?, displacement, log_ratio, score, decided })
        };
        Ok(View {
            place,
            likenesses: self.likenesses.into_iter().map(likeness).collect::<Result<_, _>>()?,
            most_agreed: usize::try_from(self.most_agreed).unwrap_or(usize::MAX),
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry2, Matrix2};
    use robot_log::{Entry, EntryKind};
    use topo_map::Displacement;

    use super::*;
    use crate::Config;
    use crate::front_end::eyes::touch;

    #[test]
    fn what_became_of_every_place_is_kept() {
        let mut mapper = Mapper::new(Config::default()).unwrap();
        let scan = EntryKind::Scan { odom_from_robot: Some(Isometry2::identity()), scan: touch() };
        mapper.follow(&Entry { stamp: 0.0, kind: scan }).unwrap();
        let view = mapper.view(0.0).unwrap();
        let (map, coordinates, _) = mapper.charted();
        let step = |x: f64, y: f64| Displacement::isotropic(Vector2::new(x, y), 0.01);
        let first = map.add_place(view.clone()).unwrap();
        let second = map.add_place(view).unwrap();
        map.travel(first, second, step(1.0, 0.0)).unwrap();
        let (expected, _) = map.predict_place(first, step(0.0, 1.0), 0.7).unwrap();
        let (refuted, _) = map.predict_place(first, step(0.0, -1.0), 0.6).unwrap();
        map.refute(refuted).unwrap();
        map.merge(second, first, Vector2::new(0.2, 0.1), Matrix2::zeros()).unwrap();
        coordinates.settle(map, &[]);
        let mut bytes = Vec::new();
        mapper.save(&mut bytes).unwrap();
        let read = Mapper::load(&mut bytes.as_slice()).unwrap();
        for (then, now) in mapper.topology().places().iter().zip(read.topology().places()) {
            let plain = |state: &PlaceState<_>| format!("{:?}", stored(state));
            assert_eq!((plain(&then.state), then.visits), (plain(&now.state), now.visits));
        }
        assert!(read.topology().places()[expected.index()].is_predicted());
        assert_eq!(read.coordinates().positions(), mapper.coordinates().positions());
    }

    /// A state without what a place is recognised by.
    fn stored<S>(state: &PlaceState<S>) -> Option<String> {
        Some(match state {
            PlaceState::Visited { .. } => return None,
            PlaceState::Predicted { seen_from, toward, confidence } => format!("{seen_from} {toward:?} {confidence}"),
            PlaceState::Refuted => "refuted".into(),
            PlaceState::Merged { into, offset } => format!("{into} {offset:?}"),
        })
    }
}

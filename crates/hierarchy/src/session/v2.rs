use std::collections::BTreeMap;

use nalgebra::Vector2;
use robot_log::local_grid::Sweep;
use serde::{Deserialize, Serialize};
use topo_map::{Place, PlaceId};

use super::records::{
    StoredAnchor, StoredDisplacement, StoredLink, StoredPlace, StoredSample, StoredSensor, StoredTally, StoredTracker,
    isometry, pose, restored_anchor, restored_displacement, restored_link, restored_sample, restored_sensor,
    restored_tally, stored_anchor, stored_displacement, stored_link, stored_sample, stored_sensor, stored_tally,
};
use super::{SessionError, v1};
use crate::config::Config;
use crate::front_end::gyro::HeadingDrift;
use crate::front_end::tracker::Tracker;
use crate::mapper::{Mapper, Restored};
use crate::query::floor_plan::{FloorPlan, KnownGateway, KnownRegion, Landmark, Passage};
use crate::recognize::{Closure, Verdict};
use crate::trajectory::{Anchor, Sample, Trajectory};

/// Version 2 of a session: what version 1 holds, and the regions and gateways of the latest map.
#[derive(Serialize, Deserialize)]
pub(super) struct Session {
    config: String,
    sensors: Vec<StoredSensor>,
    samples: Vec<StoredSample>,
    anchors: Vec<StoredAnchor>,
    places: Vec<StoredPlace>,
    links: Vec<StoredLink>,
    closures: Vec<StoredClosure>,
    tally: StoredTally,
    tracker: StoredTracker,
    held_by_scans: bool,
    sweeps: u64,
    names: Vec<(u32, String)>,
    regions: Vec<StoredRegion>,
    gateways: Vec<StoredGateway>,
    drift: HeadingDrift,
    swept: Vec<StoredSweep>,
}

/// How the robot moved while a sample's scan was taken: metres ahead and to the left, radians.
#[derive(Serialize, Deserialize)]
struct StoredSweep {
    sample: u32,
    motion: [f64; 3],
}

#[derive(Serialize, Deserialize)]
struct StoredClosure {
    place: u32,
    known: u32,
    displacement: StoredDisplacement,
    score: f64,
    shift: f64,
    agreed: u32,
    /// 0 accepted, 1 no agreement, 2 walls differ, 3 revoked.
    verdict: u8,
    /// The log odds, the score or the χ² of the verdict.
    figure: f64,
}

/// A region by points of its floor, each in the axes of a place.
#[derive(Serialize, Deserialize)]
struct StoredRegion {
    label: Option<u16>,
    name: Option<String>,
    area: f64,
    corridor: f64,
    floor: Vec<StoredLandmark>,
}

#[derive(Serialize, Deserialize)]
struct StoredGateway {
    ends: [StoredLandmark; 2],
    passage: u8,
}

#[derive(Serialize, Deserialize)]
struct StoredLandmark {
    place: u32,
    offset: [f32; 2],
}

impl From<v1::Session> for Session {
    fn from(old: v1::Session) -> Self {
        Self {
            config: old.config,
            sensors: old.sensors,
            samples: old.samples,
            anchors: old.anchors,
            places: old.places,
            links: old.links,
            closures: old.closures.into_iter().map(StoredClosure::from).collect(),
            tally: old.tally,
            tracker: old.tracker,
            held_by_scans: old.held_by_scans,
            sweeps: old.sweeps,
            names: old.names,
            regions: Vec::new(),
            gateways: Vec::new(),
            drift: HeadingDrift::default(),
            swept: Vec::new(),
        }
    }
}

impl From<v1::StoredClosure> for StoredClosure {
    fn from(old: v1::StoredClosure) -> Self {
        let v1::StoredClosure { place, known, displacement, score, shift, agreed, log_odds } = old;
        let verdict = u8::from(log_odds.is_none());
        Self { place, known, displacement, score, shift, agreed, verdict, figure: log_odds.unwrap_or_default() }
    }
}

impl Session {
    pub(super) fn of(mapper: &Mapper) -> Self {
        let mut sensors = Vec::new();
        let samples = mapper.trajectory().samples().iter().map(|sample| stored_sample(sample, &mut sensors)).collect();
        let map = mapper.topology();
        let place = |place: &Place<_>| StoredPlace {
            visits: place.visits,
            map_from_place: pose(&mapper.coordinates().map_from_place(place.id)),
        };
        let plan = mapper.floor_plan();
        Self {
            config: mapper.config().to_toml(),
            samples,
            sensors: sensors.iter().map(|sensor| stored_sensor(sensor)).collect(),
            anchors: mapper.trajectory().anchors().iter().map(stored_anchor).collect(),
            places: map.places().iter().map(place).collect(),
            links: map.links().iter().map(stored_link).collect(),
            closures: mapper.closures().iter().map(stored_closure).collect(),
            tally: stored_tally(mapper.tally()),
            tracker: mapper.tracker_state(),
            held_by_scans: mapper.is_held_by_scans(),
            sweeps: mapper.coordinates().sweeps() as u64,
            names: mapper.names().map(|(place, name)| (place.0, name.to_owned())).collect(),
            regions: plan.regions.iter().map(stored_region).collect(),
            gateways: plan.gateways.iter().map(stored_gateway).collect(),
            drift: mapper.heading_drift(),
            swept: (0..).zip(mapper.trajectory().samples()).filter_map(stored_sweep).collect(),
        }
    }

    /// The places that it knows.
    pub(super) fn known(&self) -> Known {
        Known { places: self.places.len() }
    }

    /// Checks everything that a map relies on.
    pub(super) fn restore(self) -> Result<Restored, SessionError> {
        let known = self.known();
        let config = Config::from_toml(&self.config).map_err(|error| contradiction(error.to_string()))?;
        let sensors = self.sensors.into_iter().map(restored_sensor).collect::<Result<Vec<_>, _>>()?;
        let samples: Vec<Sample> =
            self.samples.into_iter().map(|sample| restored_sample(sample, &sensors)).collect::<Result<_, _>>()?;
        let samples = swept(samples, self.swept)?;
        let anchor = |anchor: &StoredAnchor| restored_anchor(anchor, known.place(anchor.place)?, samples.len());
        let anchors: Vec<Anchor> = self.anchors.iter().map(anchor).collect::<Result<_, SessionError>>()?;
        let name = |(place, name)| Ok((known.place(place)?, name));
        Ok(Restored {
            trajectory: Trajectory::restored(samples, anchors),
            visits: self.places.iter().map(|place| place.visits).collect(),
            poses: self.places.iter().map(|place| isometry(&place.map_from_place)).collect::<Result<_, _>>()?,
            links: self.links.iter().enumerate().map(|(id, link)| restored_link(id, link)).collect::<Result<_, _>>()?,
            closures: self.closures.iter().map(restored_closure).collect::<Result<_, _>>()?,
            tally: restored_tally(&self.tally),
            tracker: Tracker::restored(&config, &self.tracker)?.with_heading_drift(self.drift),
            held_by_scans: self.held_by_scans,
            sweeps: usize::try_from(self.sweeps).unwrap_or(usize::MAX),
            names: self.names.into_iter().map(name).collect::<Result<_, SessionError>>()?,
            floor_plan: FloorPlan {
                regions: self.regions.into_iter().map(|region| known.region(region)).collect::<Result<_, _>>()?,
                gateways: self.gateways.iter().map(|gateway| known.gateway(gateway)).collect::<Result<_, _>>()?,
            },
            states: BTreeMap::new(),
            memory: None,
            config,
        })
    }
}

pub(super) fn contradiction(what: String) -> SessionError {
    SessionError::Contradiction(what)
}

/// The places that there are: whatever speaks of another one contradicts the session.
#[derive(Clone, Copy)]
pub(super) struct Known {
    pub(super) places: usize,
}

impl Known {
    pub(super) fn place(self, place: u32) -> Result<PlaceId, SessionError> {
        let exists = (place as usize) < self.places;
        exists.then_some(PlaceId(place)).ok_or_else(|| contradiction(format!("place {place} of {}", self.places)))
    }

    fn landmark(self, stored: &StoredLandmark) -> Result<Landmark, SessionError> {
        let [x, y] = stored.offset;
        if !(x.is_finite() && y.is_finite()) {
            return Err(contradiction(format!("a point of a region at ({x}, {y}) from place {}", stored.place)));
        }
        Ok(Landmark { place: self.place(stored.place)?, offset: Vector2::new(x, y) })
    }

    fn region(self, stored: StoredRegion) -> Result<KnownRegion, SessionError> {
        let StoredRegion { label, name, area, corridor, floor } = stored;
        if !(area.is_finite() && area >= 0.0 && (0.0..=1.0).contains(&corridor)) {
            return Err(contradiction(format!("a region of {area} m² that is a corridor to {corridor}")));
        }
        let floor = floor.iter().map(|landmark| self.landmark(landmark)).collect::<Result<_, _>>()?;
        Ok(KnownRegion { label, name, area, corridor, floor })
    }

    fn gateway(self, stored: &StoredGateway) -> Result<KnownGateway, SessionError> {
        let passage = match stored.passage {
            0 => Passage::Open,
            1 => Passage::SeenClosed,
            2 => Passage::Closed,
            other => return Err(contradiction(format!("a gateway in state {other}"))),
        };
        let [a, b] = &stored.ends;
        Ok(KnownGateway { ends: [self.landmark(a)?, self.landmark(b)?], passage })
    }
}

fn stored_region(region: &KnownRegion) -> StoredRegion {
    StoredRegion {
        label: region.label,
        name: region.name.clone(),
        area: region.area,
        corridor: region.corridor,
        floor: region.floor.iter().map(stored_landmark).collect(),
    }
}

fn stored_gateway(gateway: &KnownGateway) -> StoredGateway {
    let passage = match gateway.passage {
        Passage::Open => 0,
        Passage::SeenClosed => 1,
        Passage::Closed => 2,
    };
    StoredGateway { ends: gateway.ends.each_ref().map(stored_landmark), passage }
}

fn stored_landmark(landmark: &Landmark) -> StoredLandmark {
    StoredLandmark { place: landmark.place.0, offset: landmark.offset.into() }
}

fn stored_closure(closure: &Closure) -> StoredClosure {
    let (verdict, agreed, figure) = match closure.verdict {
        Verdict::Accepted { agreed, log_odds } => (0, agreed, log_odds),
        Verdict::NoAgreement { agreed } => (1, agreed, 0.0),
        Verdict::WallsDiffer { score } => (2, 0, score),
        Verdict::Contradicted { chi2 } => (3, 0, chi2),
        Verdict::Ambiguous { agreed } => (4, agreed, 0.0),
        Verdict::Beside { score } => (5, 0, score),
    };
    StoredClosure {
        place: closure.place.0,
        known: closure.known.0,
        displacement: stored_displacement(&closure.displacement),
        score: closure.score,
        shift: closure.shift,
        agreed: u32::try_from(agreed).unwrap_or(u32::MAX),
        verdict,
        figure,
    }
}

fn restored_closure(closure: &StoredClosure) -> Result<Closure, SessionError> {
    let (agreed, figure) = (closure.agreed as usize, closure.figure);
    let verdict = match closure.verdict {
        0 => Verdict::Accepted { agreed, log_odds: figure },
        1 => Verdict::NoAgreement { agreed },
        2 => Verdict::WallsDiffer { score: figure },
        3 => Verdict::Contradicted { chi2: figure },
        4 => Verdict::Ambiguous { agreed },
        5 => Verdict::Beside { score: figure },
        other => return Err(contradiction(format!("a closure with verdict {other}"))),
    };
    Ok(Closure {
        place: PlaceId(closure.place),
        known: PlaceId(closure.known),
        displacement: restored_displacement(&closure.displacement),
        score: closure.score,
        shift: closure.shift,
        verdict,
    })
}

fn stored_sweep((sample, of): (u32, &Sample)) -> Option<StoredSweep> {
    let Sweep { step, turn } = of.scan.sweep()?;
    Some(StoredSweep { sample, motion: [step.x, step.y, *turn] })
}

/// The samples, each with the motion during its scan.
fn swept(mut samples: Vec<Sample>, motions: Vec<StoredSweep>) -> Result<Vec<Sample>, SessionError> {
    for StoredSweep { sample, motion: [x, y, turn] } in motions {
        let count = samples.len();
        let known = samples.get_mut(sample as usize).filter(|_| x.is_finite() && y.is_finite() && turn.is_finite());
        let Some(known) = known else {
            return Err(contradiction(format!("a motion of ({x}, {y}, {turn}) during scan {sample} of {count}")));
        };
        known.scan = known.scan.clone().swept(Sweep { step: Vector2::new(x, y), turn });
    }
    Ok(samples)
}

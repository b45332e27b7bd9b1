//! The records of which sessions consist, unchanged since version 1 and shared by all versions.
//!
//! Never changed: a version that needs more of one has a struct of its own, made from the one here.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Complex, Isometry2, Matrix2, UnitComplex, Vector2};
use robot_log::local_grid::{RangeSensor, Reading, Scan, SensorKind};
use serde::{Deserialize, Serialize};
use topo_map::{Displacement, Link, LinkId, LinkOrigin, LinkState, Place, PlaceId, PlaceState, TopoMap, Turn};

use super::SessionError;
use crate::mapper::tally::Tally;
use crate::trajectory::{Anchor, Sample};

/// `x`, `y` in metres, and cosine and sine of the heading: what is computed with, so that reading back changes nothing.
pub(crate) type Pose = [f64; 4];

#[derive(Serialize, Deserialize)]
pub(super) struct StoredSensor {
    pub(super) name: String,
    pub(super) kind: u8,
    pub(super) mounts: Vec<Pose>,
    pub(super) beam_width: f64,
    pub(super) range: [f64; 2],
}

/// A range is metres; infinite without an echo, NaN where it is no measurement.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredSample {
    pub(super) stamp: f64,
    pub(super) track_from_robot: Pose,
    pub(super) odom_from_robot: Pose,
    pub(super) travelled: f64,
    pub(super) sensor: u32,
    pub(super) ranges: Vec<f32>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct StoredAnchor {
    pub(super) place: u32,
    pub(super) sample: u64,
    pub(super) stamp: f64,
    pub(super) track_from_robot: Pose,
    pub(super) place_from_robot: Pose,
    pub(super) travelled: f64,
}

#[derive(Serialize, Deserialize)]
pub(super) struct StoredPlace {
    pub(super) visits: u32,
    pub(super) map_from_place: Pose,
}

#[derive(Serialize, Deserialize)]
pub(super) struct StoredDisplacement {
    pub(super) vector: [f64; 2],
    pub(super) covariance: [f64; 3],
    pub(super) turn: Option<[f64; 2]>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct StoredLink {
    pub(super) from: u32,
    pub(super) to: u32,
    pub(super) displacement: StoredDisplacement,
    pub(super) origin: u8,
    pub(super) state: u8,
    pub(super) traversals: u32,
}

#[derive(Serialize, Deserialize)]
pub(super) struct StoredTally {
    pub(super) entries: u64,
    pub(super) scans: u64,
    pub(super) readings: u64,
    pub(super) path_length: f64,
    pub(super) stamps: Option<(f64, f64)>,
}

/// What a tracker cannot make again: its pose, its last odometry, and what is uncertain.
#[derive(Serialize, Deserialize)]
pub(crate) struct StoredTracker {
    pub(crate) last_odometry: Option<Pose>,
    pub(crate) track_from_robot: Pose,
    pub(crate) heading_variance: f64,
    pub(crate) since_compass: f64,
    pub(crate) seen_compass: bool,
    pub(crate) compass_offset: f64,
    pub(crate) tied: bool,
    pub(crate) travelled: f64,
    pub(crate) since_place: [f64; 6],
}

/// The topological map of stored places and links, each visited place with the signature that `signature` draws.
pub(crate) fn topology<S>(
    visits: &[u32],
    states: &BTreeMap<PlaceId, PlaceState<()>>,
    links: Vec<Link>,
    mut signature: impl FnMut(PlaceId) -> S,
) -> Result<TopoMap<S>, topo_map::MapError> {
    let mut state = |id| match states.get(&id) {
        None | Some(PlaceState::Visited { .. }) => PlaceState::Visited { signature: signature(id) },
        Some(&PlaceState::Predicted { seen_from, toward, confidence }) => {
            PlaceState::Predicted { seen_from, toward, confidence }
        }
        Some(PlaceState::Refuted) => PlaceState::Refuted,
        Some(&PlaceState::Merged { into, offset }) => PlaceState::Merged { into, offset },
    };
    let place = |(id, visits): (u32, &u32)| Place { id: PlaceId(id), state: state(PlaceId(id)), visits: *visits };
    TopoMap::from_parts((0..).zip(visits).map(place).collect(), links)
}

pub(crate) fn pose(isometry: &Isometry2<f64>) -> Pose {
    let turn = &isometry.rotation;
    [isometry.translation.x, isometry.translation.y, turn.re, turn.im]
}

pub(crate) fn isometry(pose: &Pose) -> Result<Isometry2<f64>, SessionError> {
    let [x, y, cos, sin] = *pose;
    if !(x.is_finite() && y.is_finite() && (cos.hypot(sin) - 1.0).abs() < 1e-9) {
        return Err(SessionError::Contradiction(format!("({x}, {y}, {cos}, {sin}) is no pose")));
    }
    let turn = UnitComplex::new_unchecked(Complex::new(cos, sin));
    Ok(Isometry2::from_parts(Vector2::new(x, y).into(), turn))
}

pub(super) fn stored_sensor(sensor: &RangeSensor) -> StoredSensor {
    StoredSensor {
        name: sensor.name().to_owned(),
        kind: match sensor.kind() {
            SensorKind::Sonar => 0,
            SensorKind::Laser => 1,
            SensorKind::Infrared => 2,
        },
        mounts: sensor.mounts().iter().map(pose).collect(),
        beam_width: sensor.beam_width(),
        range: [sensor.min_range(), sensor.max_range()],
    }
}

pub(super) fn restored_sensor(sensor: StoredSensor) -> Result<Arc<RangeSensor>, SessionError> {
    let kind = match sensor.kind {
        0 => SensorKind::Sonar,
        1 => SensorKind::Laser,
        2 => SensorKind::Infrared,
        other => return Err(SessionError::Contradiction(format!("sensor of kind {other}"))),
    };
    let mounts = sensor.mounts.iter().map(isometry).collect::<Result<_, _>>()?;
    let [min, max] = sensor.range;
    let restored = RangeSensor::new(sensor.name, kind, mounts, sensor.beam_width, min..=max);
    Ok(Arc::new(restored.map_err(|error| SessionError::Contradiction(error.to_string()))?))
}

pub(super) fn stored_sample(sample: &Sample, sensors: &mut Vec<Arc<RangeSensor>>) -> StoredSample {
    let sensor = sample.scan.sensor();
    let index = sensors.iter().position(|known| Arc::ptr_eq(known, sensor) || known == sensor).unwrap_or_else(|| {
        sensors.push(Arc::clone(sensor));
        sensors.len() - 1
    });
    let range = |reading: &Reading| match *reading {
        Reading::Echo(range) => range,
        Reading::NoEcho => f32::INFINITY,
        Reading::Invalid => f32::NAN,
    };
    StoredSample {
        stamp: sample.stamp,
        track_from_robot: pose(&sample.track_from_robot),
        odom_from_robot: pose(&sample.odom_from_robot),
        travelled: sample.travelled,
        sensor: u32::try_from(index).unwrap_or(u32::MAX),
        ranges: sample.scan.readings().iter().map(range).collect(),
    }
}

pub(super) fn restored_sample(sample: StoredSample, sensors: &[Arc<RangeSensor>]) -> Result<Sample, SessionError> {
    let missing = || SessionError::Contradiction(format!("sensor {} of {}", sample.sensor, sensors.len()));
    let sensor = sensors.get(sample.sensor as usize).ok_or_else(missing)?;
    let reading = |range: &f32| match *range {
        range if range.is_nan() => Reading::Invalid,
        f32::INFINITY => Reading::NoEcho,
        range => Reading::Echo(range),
    };
    let scan = Scan::new(Arc::clone(sensor), sample.ranges.iter().map(reading).collect());
    Ok(Sample {
        stamp: sample.stamp,
        track_from_robot: isometry(&sample.track_from_robot)?,
        odom_from_robot: isometry(&sample.odom_from_robot)?,
        travelled: sample.travelled,
        scan: scan.map_err(|error| SessionError::Contradiction(error.to_string()))?,
    })
}

pub(super) fn stored_anchor(anchor: &Anchor) -> StoredAnchor {
    StoredAnchor {
        place: anchor.place.0,
        sample: anchor.sample as u64,
        stamp: anchor.stamp,
        track_from_robot: pose(&anchor.track_from_robot),
        place_from_robot: pose(&anchor.place_from_robot),
        travelled: anchor.travelled,
    }
}

pub(super) fn restored_anchor(anchor: &StoredAnchor, place: PlaceId, samples: usize) -> Result<Anchor, SessionError> {
    let sample = usize::try_from(anchor.sample).ok().filter(|sample| *sample <= samples);
    Ok(Anchor {
        place,
        sample: sample.ok_or_else(|| SessionError::Contradiction(format!("sample {} of {samples}", anchor.sample)))?,
        stamp: anchor.stamp,
        track_from_robot: isometry(&anchor.track_from_robot)?,
        place_from_robot: isometry(&anchor.place_from_robot)?,
        travelled: anchor.travelled,
    })
}

pub(super) fn stored_displacement(displacement: &Displacement) -> StoredDisplacement {
    let c = &displacement.covariance;
    StoredDisplacement {
        vector: displacement.vector.into(),
        covariance: [c[(0, 0)], 0.5 * (c[(0, 1)] + c[(1, 0)]), c[(1, 1)]],
        turn: displacement.turn.map(|turn| [turn.change, turn.variance]),
    }
}

pub(super) fn restored_displacement(displacement: &StoredDisplacement) -> Displacement {
    let [xx, xy, yy] = displacement.covariance;
    Displacement {
        vector: displacement.vector.into(),
        covariance: Matrix2::new(xx, xy, xy, yy),
        turn: displacement.turn.map(|[change, variance]| Turn { change, variance }),
    }
}

pub(super) fn stored_link(link: &Link) -> StoredLink {
    StoredLink {
        from: link.from.0,
        to: link.to.0,
        displacement: stored_displacement(&link.displacement),
        origin: match link.origin {
            LinkOrigin::Traveled => 0,
            LinkOrigin::Recognized => 1,
            LinkOrigin::Predicted => 2,
        },
        state: match link.state {
            LinkState::Open => 0,
            LinkState::Blocked => 1,
            LinkState::Rejected => 2,
        },
        traversals: link.traversals,
    }
}

pub(super) fn restored_link(id: usize, link: &StoredLink) -> Result<Link, SessionError> {
    let unknown = |what: &str, value: u8| SessionError::Contradiction(format!("link {id}: {what} {value}"));
    Ok(Link {
        id: LinkId(u32::try_from(id).map_err(|_| SessionError::Contradiction("too many links".into()))?),
        from: PlaceId(link.from),
        to: PlaceId(link.to),
        displacement: restored_displacement(&link.displacement),
        origin: match link.origin {
            0 => LinkOrigin::Traveled,
            1 => LinkOrigin::Recognized,
            2 => LinkOrigin::Predicted,
            other => return Err(unknown("origin", other)),
        },
        state: match link.state {
            0 => LinkState::Open,
            1 => LinkState::Blocked,
            2 => LinkState::Rejected,
            other => return Err(unknown("state", other)),
        },
        traversals: link.traversals,
    })
}

pub(super) fn stored_tally(tally: &Tally) -> StoredTally {
    StoredTally {
        entries: tally.entries as u64,
        scans: tally.scans as u64,
        readings: tally.readings as u64,
        path_length: tally.path_length,
        stamps: tally.stamps,
    }
}

pub(super) fn restored_tally(tally: &StoredTally) -> Tally {
    Tally::restored([tally.entries, tally.scans, tally.readings], tally.path_length, tally.stamps)
}

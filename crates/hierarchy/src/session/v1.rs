use std::sync::Arc;

use nalgebra::{Complex, Isometry2, Matrix2, UnitComplex, Vector2};
use robot_log::local_grid::{RangeSensor, Reading, Scan, SensorKind};
use serde::{Deserialize, Serialize};
use topo_map::{Displacement, Link, LinkId, LinkOrigin, LinkState, Place, PlaceId, PlaceState, TopoMap, Turn};

use super::SessionError;
use crate::config::Config;
use crate::mapper::{Mapper, Restored};
use crate::recognize::{Closure, Verdict};
use crate::tally::Tally;
use crate::tracker::{Tracker, TrackerState};
use crate::trajectory::{Anchor, Sample, Trajectory};

/// Version 1 of a session. Never changed: a later version has structs of its own.
#[derive(Serialize, Deserialize)]
pub(super) struct Session {
    config: String,
    sensors: Vec<Sensor>,
    samples: Vec<StoredSample>,
    anchors: Vec<StoredAnchor>,
    places: Vec<StoredPlace>,
    links: Vec<StoredLink>,
    closures: Vec<StoredClosure>,
    tally: StoredTally,
    tracker: TrackerState,
    held_by_scans: bool,
    sweeps: u64,
    names: Vec<(u32, String)>,
}

/// `x`, `y` in metres, and cosine and sine of the heading: what is computed with, so that reading back changes nothing.
pub(crate) type Pose = [f64; 4];

#[derive(Serialize, Deserialize)]
struct Sensor {
    name: String,
    kind: u8,
    mounts: Vec<Pose>,
    beam_width: f64,
    range: [f64; 2],
}

/// A range is metres; infinite without an echo, NaN where it is no measurement.
#[derive(Serialize, Deserialize)]
struct StoredSample {
    stamp: f64,
    track_from_robot: Pose,
    odom_from_robot: Pose,
    travelled: f64,
    sensor: u32,
    ranges: Vec<f32>,
}

#[derive(Serialize, Deserialize)]
struct StoredAnchor {
    place: u32,
    sample: u64,
    stamp: f64,
    track_from_robot: Pose,
    place_from_robot: Pose,
    travelled: f64,
}

#[derive(Serialize, Deserialize)]
struct StoredPlace {
    visits: u32,
    map_from_place: Pose,
}

#[derive(Serialize, Deserialize)]
struct StoredDisplacement {
    vector: [f64; 2],
    covariance: [f64; 3],
    turn: Option<[f64; 2]>,
}

#[derive(Serialize, Deserialize)]
struct StoredLink {
    from: u32,
    to: u32,
    displacement: StoredDisplacement,
    origin: u8,
    state: u8,
    traversals: u32,
}

#[derive(Serialize, Deserialize)]
struct StoredClosure {
    place: u32,
    known: u32,
    displacement: StoredDisplacement,
    score: f64,
    shift: f64,
    agreed: u32,
    log_odds: Option<f64>,
}

#[derive(Serialize, Deserialize)]
struct StoredTally {
    entries: u64,
    scans: u64,
    readings: u64,
    path_length: f64,
    stamps: Option<(f64, f64)>,
}

impl Session {
    pub(super) fn of(mapper: &Mapper) -> Self {
        let mut sensors: Vec<Arc<RangeSensor>> = Vec::new();
        let samples = mapper.trajectory().samples().iter().map(|sample| stored_sample(sample, &mut sensors)).collect();
        let map = mapper.topology();
        let place = |place: &Place<_>| StoredPlace {
            visits: place.visits,
            map_from_place: pose(&mapper.coordinates().map_from_place(place.id)),
        };
        let tally = mapper.tally();
        Self {
            config: mapper.config().to_toml(),
            samples,
            sensors: sensors.iter().map(|sensor| stored_sensor(sensor)).collect(),
            anchors: mapper.trajectory().anchors().iter().map(stored_anchor).collect(),
            places: map.places().iter().map(place).collect(),
            links: map.links().iter().map(stored_link).collect(),
            closures: mapper.closures().iter().map(stored_closure).collect(),
            tally: StoredTally {
                entries: tally.entries as u64,
                scans: tally.scans as u64,
                readings: tally.readings as u64,
                path_length: tally.path_length,
                stamps: tally.stamps,
            },
            tracker: mapper.tracker_state(),
            held_by_scans: mapper.is_held_by_scans(),
            sweeps: mapper.coordinates().sweeps() as u64,
            names: mapper.names().map(|(place, name)| (place.0, name.to_owned())).collect(),
        }
    }

    /// Checks everything that a map relies on, and builds it.
    pub(super) fn restore(self) -> Result<Mapper, SessionError> {
        let contradiction = |what: String| SessionError::Contradiction(what);
        let config = Config::from_toml(&self.config).map_err(|error| contradiction(error.to_string()))?;
        let sensors: Vec<Arc<RangeSensor>> = self.sensors.into_iter().map(restored_sensor).collect::<Result<_, _>>()?;
        let samples: Vec<Sample> =
            self.samples.into_iter().map(|sample| restored_sample(sample, &sensors)).collect::<Result<_, _>>()?;
        let places = self.places.len();
        let known = |place: u32| {
            let exists = (place as usize) < places;
            exists.then_some(PlaceId(place)).ok_or_else(|| contradiction(format!("place {place} of {places}")))
        };
        let anchors: Vec<Anchor> = self
            .anchors
            .iter()
            .map(|anchor| restored_anchor(anchor, known(anchor.place)?, samples.len()))
            .collect::<Result<_, _>>()?;
        let poses = self.places.iter().map(|place| isometry(&place.map_from_place)).collect::<Result<Vec<_>, _>>()?;
        let links =
            self.links.iter().enumerate().map(|(id, link)| restored_link(id, link)).collect::<Result<_, _>>()?;
        let closures = self.closures.iter().map(restored_closure).collect();
        let visits: Vec<u32> = self.places.iter().map(|place| place.visits).collect();
        let tally = Tally::restored(
            [self.tally.entries, self.tally.scans, self.tally.readings],
            self.tally.path_length,
            self.tally.stamps,
        );
        let names = self.names.into_iter().map(|(place, name)| Ok((known(place)?, name)));
        let names = names.collect::<Result<_, SessionError>>()?;
        let restored = Restored {
            trajectory: Trajectory::restored(samples, anchors),
            visits,
            poses,
            links,
            closures,
            tally,
            tracker: Tracker::restored(&config, &self.tracker)?,
            held_by_scans: self.held_by_scans,
            sweeps: usize::try_from(self.sweeps).unwrap_or(usize::MAX),
            names,
            config,
        };
        Ok(Mapper::restored(restored)?)
    }
}

/// The topological map of stored places and links, each place with the signature that `signature` draws.
pub(crate) fn topology<S>(
    visits: &[u32],
    links: Vec<Link>,
    mut signature: impl FnMut(PlaceId) -> S,
) -> Result<TopoMap<S>, topo_map::MapError> {
    let place = |(id, visits): (u32, &u32)| Place {
        id: PlaceId(id),
        state: PlaceState::Visited { signature: signature(PlaceId(id)) },
        visits: *visits,
    };
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

fn stored_sensor(sensor: &RangeSensor) -> Sensor {
    Sensor {
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

fn restored_sensor(sensor: Sensor) -> Result<Arc<RangeSensor>, SessionError> {
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

fn stored_sample(sample: &Sample, sensors: &mut Vec<Arc<RangeSensor>>) -> StoredSample {
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

fn restored_sample(sample: StoredSample, sensors: &[Arc<RangeSensor>]) -> Result<Sample, SessionError> {
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

fn stored_anchor(anchor: &Anchor) -> StoredAnchor {
    StoredAnchor {
        place: anchor.place.0,
        sample: anchor.sample as u64,
        stamp: anchor.stamp,
        track_from_robot: pose(&anchor.track_from_robot),
        place_from_robot: pose(&anchor.place_from_robot),
        travelled: anchor.travelled,
    }
}

fn restored_anchor(anchor: &StoredAnchor, place: PlaceId, samples: usize) -> Result<Anchor, SessionError> {
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

fn stored_displacement(displacement: &Displacement) -> StoredDisplacement {
    let c = &displacement.covariance;
    StoredDisplacement {
        vector: displacement.vector.into(),
        covariance: [c[(0, 0)], 0.5 * (c[(0, 1)] + c[(1, 0)]), c[(1, 1)]],
        turn: displacement.turn.map(|turn| [turn.change, turn.variance]),
    }
}

fn restored_displacement(displacement: &StoredDisplacement) -> Displacement {
    let [xx, xy, yy] = displacement.covariance;
    Displacement {
        vector: displacement.vector.into(),
        covariance: Matrix2::new(xx, xy, xy, yy),
        turn: displacement.turn.map(|[change, variance]| Turn { change, variance }),
    }
}

fn stored_link(link: &Link) -> StoredLink {
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

fn restored_link(id: usize, link: &StoredLink) -> Result<Link, SessionError> {
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

fn stored_closure(closure: &Closure) -> StoredClosure {
    let (agreed, log_odds) = match closure.verdict {
        Verdict::Accepted { agreed, log_odds } => (agreed, Some(log_odds)),
        Verdict::NoAgreement { agreed } => (agreed, None),
    };
    StoredClosure {
        place: closure.place.0,
        known: closure.known.0,
        displacement: stored_displacement(&closure.displacement),
        score: closure.score,
        shift: closure.shift,
        agreed: u32::try_from(agreed).unwrap_or(u32::MAX),
        log_odds,
    }
}

fn restored_closure(closure: &StoredClosure) -> Closure {
    let agreed = closure.agreed as usize;
    let verdict =
        closure.log_odds.map_or(Verdict::NoAgreement { agreed }, |log_odds| Verdict::Accepted { agreed, log_odds });
    Closure {
        place: PlaceId(closure.place),
        known: PlaceId(closure.known),
        displacement: restored_displacement(&closure.displacement),
        score: closure.score,
        shift: closure.shift,
        verdict,
    }
}

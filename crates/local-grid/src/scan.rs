use std::sync::Arc;

use nalgebra::{Isometry2, Vector2};

/// What physics a range sensor has, which decides how its readings are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum SensorKind {
    /// A wide cone whose nearest echo counts; walls at a slant are lost or seen too far.
    Sonar,
    /// A thin ray that stops at the first surface.
    Laser,
    /// A thin short-range ray, as an infrared triangulation sensor's.
    Infrared,
}

/// A ring, fan or row of range sensors that fire together: the geometry that all its scans share.
///
/// One mount per beam: `robot_from_sensor` has its `+x` axis along the beam.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "RawSensor"))]
pub struct RangeSensor {
    name: String,
    kind: SensorKind,
    mounts: Vec<Isometry2<f64>>,
    beam_width: f64,
    min_range: f64,
    max_range: f64,
}

/// The sensor as a file holds it: reading goes through [`RangeSensor::new`].
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct RawSensor {
    name: String,
    kind: SensorKind,
    mounts: Vec<Isometry2<f64>>,
    beam_width: f64,
    min_range: f64,
    max_range: f64,
}

/// Why a range sensor cannot exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensorError {
    /// At least one beam is needed.
    #[error("range sensor `{0}` has no beam")]
    NoBeam(String),
    /// A mount must be a pose.
    #[error("beam {beam} of range sensor `{name}` has a mount that is not finite")]
    Mount {
        /// The sensor.
        name: String,
        /// The beam, from 0.
        beam: usize,
    },
    /// The cone must be one.
    #[error("range sensor `{name}`: beam width must lie in [0, π] radians, got {width}")]
    BeamWidth {
        /// The sensor.
        name: String,
        /// The full width given.
        width: f64,
    },
    /// Ranges must be ordered.
    #[error("range sensor `{name}`: 0 ≤ minimum < maximum range must hold and be finite, got {min} and {max} metres")]
    Ranges {
        /// The sensor.
        name: String,
        /// Nearest range.
        min: f64,
        /// Farthest range.
        max: f64,
    },
}

impl RangeSensor {
    /// A sensor whose beams start at `mounts`, each a cone of full width `beam_width` radians, that measures
    /// between `min_range` and `max_range` metres.
    ///
    /// # Errors
    ///
    /// No beam, a mount that is not finite, a width outside `[0, π]`, or ranges out of order.
    pub fn new(
        name: impl Into<String>,
        kind: SensorKind,
        mounts: Vec<Isometry2<f64>>,
        beam_width: f64,
        range: std::ops::RangeInclusive<f64>,
    ) -> Result<Self, SensorError> {
        let name = name.into();
        let (min_range, max_range) = range.into_inner();
        if mounts.is_empty() {
            return Err(SensorError::NoBeam(name));
        }
        let broken = |mount: &Isometry2<f64>| !(mount.to_homogeneous().iter().all(|x| x.is_finite()));
        if let Some(beam) = mounts.iter().position(broken) {
            return Err(SensorError::Mount { name, beam });
        }
        if !(0.0..=std::f64::consts::PI).contains(&beam_width) {
            return Err(SensorError::BeamWidth { name, width: beam_width });
        }
        if !(min_range >= 0.0 && min_range < max_range && max_range.is_finite()) {
            return Err(SensorError::Ranges { name, min: min_range, max: max_range });
        }
        Ok(Self { name, kind, mounts, beam_width, min_range, max_range })
    }

    /// A ring of `count` equal sensors at `radius` metres from the robot's centre, the first ahead, counter-clockwise.
    ///
    /// # Errors
    ///
    /// As [`RangeSensor::new`].
    pub fn ring(
        name: impl Into<String>,
        kind: SensorKind,
        count: usize,
        radius: f64,
        beam_width: f64,
        range: std::ops::RangeInclusive<f64>,
    ) -> Result<Self, SensorError> {
        #[expect(clippy::cast_precision_loss, reason = "a ring has few sensors")]
        let bearing = |k: usize| std::f64::consts::TAU * k as f64 / count as f64;
        let mounts =
            (0..count).map(|k| Isometry2::rotation(bearing(k)) * Isometry2::translation(radius, 0.0)).collect();
        Self::new(name, kind, mounts, beam_width, range)
    }

    /// A fan of `count` rays from one point: the first at `first` radians from the sensor's axis, each next one `step` on.
    ///
    /// # Errors
    ///
    /// As [`RangeSensor::new`].
    pub fn fan(
        name: impl Into<String>,
        robot_from_sensor: Isometry2<f64>,
        first: f64,
        step: f64,
        count: usize,
        range: std::ops::RangeInclusive<f64>,
    ) -> Result<Self, SensorError> {
        #[expect(clippy::cast_precision_loss, reason = "a fan has few rays")]
        let mounts = (0..count).map(|k| robot_from_sensor * Isometry2::rotation(first + step * k as f64)).collect();
        Self::new(name, SensorKind::Laser, mounts, step.abs().min(std::f64::consts::PI), range)
    }

    /// What the sensor is called in its log.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The sensor's physics.
    #[must_use]
    pub fn kind(&self) -> SensorKind {
        self.kind
    }

    /// `robot_from_sensor` of every beam, `+x` along the beam.
    #[must_use]
    pub fn mounts(&self) -> &[Isometry2<f64>] {
        &self.mounts
    }

    /// The full width of a beam in radians.
    #[must_use]
    pub fn beam_width(&self) -> f64 {
        self.beam_width
    }

    /// The nearest range that is a measurement, in metres; what reads less is [`Reading::Invalid`].
    #[must_use]
    pub fn min_range(&self) -> f64 {
        self.min_range
    }

    /// The farthest range that is a measurement, in metres; what reads more is [`Reading::NoEcho`].
    #[must_use]
    pub fn max_range(&self) -> f64 {
        self.max_range
    }
}

#[cfg(feature = "serde")]
impl TryFrom<RawSensor> for RangeSensor {
    type Error = SensorError;

    fn try_from(raw: RawSensor) -> Result<Self, SensorError> {
        Self::new(raw.name, raw.kind, raw.mounts, raw.beam_width, raw.min_range..=raw.max_range)
    }
}

/// What one beam measured.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Reading {
    /// A surface at so many metres from the sensor's face.
    Echo(f32),
    /// Nothing heard up to the maximum range.
    NoEcho,
    /// No measurement: the beam did not fire, was masked, or read less than the minimum range.
    Invalid,
}

/// One firing of a range sensor: one reading per beam. A clone shares the readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    sensor: Arc<RangeSensor>,
    readings: Arc<[Reading]>,
    sweep: Option<Sweep>,
}

/// How a robot moved while its scanner turned, from the first beam of a scan to the last.
///
/// A scanner that turns ten times a second on a robot that turns by 90° a second shears what it sees by several degrees,
/// which no matching repairs: each wall is straight, but stands askew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Metres ahead and to the left, in the robot's own axes, which turn with it.
    pub step: Vector2<f64>,
    /// Radians.
    pub turn: f64,
}

impl Sweep {
    /// The part of a `motion` that took `seconds` in which a scan of `sweep` seconds was taken.
    ///
    /// `None` where nothing moved, or no time passed in which it could.
    #[must_use]
    pub fn during(motion: &Isometry2<f64>, seconds: f64, sweep: f64) -> Option<Self> {
        let share = sweep / seconds;
        let whole_turn = motion.rotation.angle();
        // A chord points half a turn away from where the robot faced at its beginning.
        let ahead = nalgebra::Rotation2::new(-0.5 * whole_turn) * motion.translation.vector;
        let (step, turn) = (ahead * share, whole_turn * share);
        let moved = share.is_finite() && (step.norm() > 0.0 || turn != 0.0);
        moved.then_some(Self { step, turn })
    }

    /// The robot at the beam `before` sweeps before the last, in its frame at the last: a constant velocity.
    fn robot_then(&self, before: f64) -> Isometry2<f64> {
        let turn = -self.turn * before;
        Isometry2::new(nalgebra::Rotation2::new(0.5 * turn) * (self.step * -before), turn)
    }
}

/// Why a scan cannot exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScanError {
    /// One reading per beam.
    #[error("range sensor `{name}` has {beams} beams, got {readings} readings")]
    Count {
        /// The sensor.
        name: String,
        /// Its beams.
        beams: usize,
        /// Readings given.
        readings: usize,
    },
    /// An echo must come from between the minimum and the maximum range.
    #[error("beam {beam} of range sensor `{name}`: an echo must lie in [{min}, {max}] metres, got {range}")]
    Range {
        /// The sensor.
        name: String,
        /// The beam, from 0.
        beam: usize,
        /// The range given.
        range: f32,
        /// Nearest range.
        min: f64,
        /// Farthest range.
        max: f64,
    },
}

/// One beam of a scan: where it starts and what it read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// The sensor's face on the robot, `+x` along the beam.
    pub robot_from_sensor: Isometry2<f64>,
    /// What it read.
    pub reading: Reading,
}

impl Scan {
    /// A firing of `sensor` with one reading per beam.
    ///
    /// # Errors
    ///
    /// Too few or too many readings, or an echo outside the sensor's ranges.
    pub fn new(sensor: Arc<RangeSensor>, readings: Vec<Reading>) -> Result<Self, ScanError> {
        if readings.len() != sensor.mounts.len() {
            let (name, beams) = (sensor.name.clone(), sensor.mounts.len());
            return Err(ScanError::Count { name, beams, readings: readings.len() });
        }
        for (beam, reading) in readings.iter().enumerate() {
            // An f32 at the limit may round past it by half a part in 2²³.
            let (min, max) = (sensor.min_range, sensor.max_range);
            if let Reading::Echo(range) = *reading
                && !(f64::from(range) >= min * (1.0 - 1e-6) && f64::from(range) <= max * (1.0 + 1e-6))
            {
                return Err(ScanError::Range { name: sensor.name.clone(), beam, range, min, max });
            }
        }
        Ok(Self { sensor, readings: readings.into(), sweep: None })
    }

    /// The same scan, of which the robot moved by `sweep` from the first beam to the last; its pose is that of the last.
    #[must_use]
    pub fn swept(self, sweep: Sweep) -> Self {
        Self { sweep: Some(sweep), ..self }
    }

    /// How the robot moved meanwhile; `None` where all beams count as fired at once.
    #[must_use]
    pub fn sweep(&self) -> Option<&Sweep> {
        self.sweep.as_ref()
    }

    /// A firing of `sensor` from raw ranges in metres: below the minimum (or NaN) is invalid, above the maximum no echo.
    ///
    /// # Errors
    ///
    /// Too few or too many ranges.
    pub fn from_ranges(sensor: Arc<RangeSensor>, ranges: impl IntoIterator<Item = f64>) -> Result<Self, ScanError> {
        let readings = ranges.into_iter().map(|range| sensor.reading(range)).collect();
        Self::new(sensor, readings)
    }

    /// The sensor that fired.
    #[must_use]
    pub fn sensor(&self) -> &Arc<RangeSensor> {
        &self.sensor
    }

    /// One reading per beam.
    #[must_use]
    pub fn readings(&self) -> &[Reading] {
        &self.readings
    }

    /// Every beam with what it read.
    pub fn beams(&self) -> impl Iterator<Item = Beam> + '_ {
        #[expect(clippy::cast_precision_loss, reason = "a scan has few beams")]
        let share = 1.0 / (self.readings.len().max(2) - 1) as f64;
        let pair = move |(left, (mount, reading)): (usize, (&Isometry2<f64>, &Reading))| {
            #[expect(clippy::cast_precision_loss, reason = "a scan has few beams")]
            let then = self.sweep.map(|sweep| sweep.robot_then(1.0 - left as f64 * share));
            Beam { robot_from_sensor: then.map_or(*mount, |then| then * mount), reading: *reading }
        };
        self.sensor.mounts.iter().zip(self.readings.iter()).enumerate().map(pair)
    }

    /// Where the echoes came from, in the robot's frame, in metres; beams without echo give nothing.
    pub fn echo_points(&self) -> impl Iterator<Item = Vector2<f64>> + '_ {
        self.beams().filter_map(|beam| match beam.reading {
            Reading::Echo(range) => {
                Some((beam.robot_from_sensor * nalgebra::Point2::new(f64::from(range), 0.0)).coords)
            }
            Reading::NoEcho | Reading::Invalid => None,
        })
    }
}

impl RangeSensor {
    /// What a raw range in metres means: below the minimum (or NaN) is invalid, above the maximum no echo.
    #[must_use]
    pub fn reading(&self, range: f64) -> Reading {
        if range.is_nan() || range < self.min_range {
            Reading::Invalid
        } else if range > self.max_range {
            Reading::NoEcho
        } else {
            #[expect(clippy::cast_possible_truncation, reason = "ranges are metres; f32 resolves micrometres")]
            Reading::Echo(range as f32)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring() -> Arc<RangeSensor> {
        let width = 25f64.to_radians();
        Arc::new(RangeSensor::ring("sonar", SensorKind::Sonar, 16, 0.225, width, 0.43..=6.47).unwrap())
    }

    #[test]
    fn a_ring_starts_at_the_robots_skin() {
        let face = ring().mounts()[4].translation.vector;
        approx::assert_relative_eq!(face, Vector2::new(0.0, 0.225), epsilon = 1e-12); // the fifth of 16 looks left
    }

    #[test]
    fn raw_ranges_become_readings() {
        let scan = Scan::from_ranges(ring(), (0..16).map(|k| f64::from(k) * 0.5)).unwrap();
        assert_eq!(scan.readings()[0], Reading::Invalid);
        assert_eq!(scan.readings()[2], Reading::Echo(1.0));
        assert_eq!(scan.readings()[15], Reading::NoEcho);
        assert_eq!(scan.echo_points().count(), 12); // 0.5, 1.0, …, 6.0
    }

    #[test]
    fn a_scan_taken_on_the_move_is_set_right() {
        // A robot that turns left by 0.2 rad and drives 0.1 m while its fan of five rays sweeps, before a wall at x = 2.
        let fan = RangeSensor::fan("laser", Isometry2::identity(), -0.4, 0.2, 5, 0.05..=10.0).unwrap();
        let motion = Isometry2::new(Vector2::new(0.2, 0.0), 0.4);
        let sweep = Sweep::during(&motion, 0.2, 0.1).unwrap();
        approx::assert_relative_eq!(sweep.turn, 0.2);
        let last = Isometry2::new(Vector2::new(0.05, 0.0), 0.1);
        let still = Scan::from_ranges(Arc::new(fan.clone()), [1.0; 5]).unwrap().swept(sweep);
        let ranges = still.beams().map(|beam| {
            let ray = last * beam.robot_from_sensor;
            (2.0 - ray.translation.x) / ray.rotation.angle().cos()
        });
        let scan = Scan::from_ranges(Arc::new(fan), ranges.collect::<Vec<_>>()).unwrap().swept(sweep);
        for point in scan.echo_points() {
            approx::assert_relative_eq!((last * nalgebra::Point2::from(point)).x, 2.0, epsilon = 1e-6);
        }
        let first = scan.beams().next().unwrap().robot_from_sensor;
        approx::assert_relative_eq!(first.rotation.angle(), -0.6, epsilon = 1e-12);
        assert!(first.translation.x < -0.09 && Sweep::during(&motion, 0.0, 0.1).is_none());
    }

    #[test]
    fn wrong_scans_are_refused() {
        assert!(matches!(Scan::new(ring(), vec![]), Err(ScanError::Count { .. })));
        let mut readings = vec![Reading::NoEcho; 16];
        readings[3] = Reading::Echo(f32::NAN);
        assert!(matches!(Scan::new(ring(), readings), Err(ScanError::Range { beam: 3, .. })));
    }

    #[test]
    fn wrong_sensors_are_refused() {
        let none = RangeSensor::new("x", SensorKind::Sonar, vec![], 0.4, 0.0..=1.0);
        assert_eq!(none, Err(SensorError::NoBeam("x".into())));
        let backwards = RangeSensor::ring("x", SensorKind::Sonar, 2, 0.1, 0.4, 2.0..=1.0);
        assert!(matches!(backwards, Err(SensorError::Ranges { .. })));
    }
}

mod laser;
mod piston;
mod regions;
mod sonar;

use nalgebra::Isometry2;

use crate::raster::{ConeCells, RayCells};
use crate::{Evidence, GridFrame, RangeSensor, Reading};

pub use laser::LaserRay;
pub use regions::SonarRegions;
pub use sonar::{AngularProfile, SonarCone};

/// What a sensor model makes of a reading: how far the beam got, and whether something stopped it there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sounding {
    /// Metres from the sensor's face up to which the beam met nothing.
    pub range: f64,
    /// Whether an echo came from there; otherwise nothing is known of what lies there.
    pub echo: bool,
}

impl Sounding {
    /// What is left of it within `max_range` metres: an echo from beyond leaves emptiness up to there.
    #[must_use]
    pub fn within(self, max_range: f64) -> Self {
        if self.range <= max_range { self } else { Self { range: max_range, echo: false } }
    }
}

/// A point in a beam, seen from the sensor's face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamPoint {
    /// Metres from the sensor's face; for a ray, to the middle of its path through the cell.
    pub distance: f64,
    /// Radians from the beam's axis, counter-clockwise.
    pub bearing: f64,
    /// Metres that a ray runs inside the cell; 0 in a cone, where the cell's centre is judged.
    pub chord: f64,
}

/// The part of the plane that a reading speaks of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Footprint {
    /// The cells that a ray crosses up to `reach` metres.
    Ray {
        /// Length of the ray in metres.
        reach: f64,
    },
    /// The cells whose centres lie in a cone.
    Cone {
        /// Radians from the axis to the edge.
        half_width: f64,
        /// Metres from the apex to the arc.
        reach: f64,
    },
}

/// Why a model's options make no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[error("{model}: `{field}` must be {expected}, got {value}")]
pub struct ModelError {
    /// The model.
    pub model: &'static str,
    /// The option.
    pub field: &'static str,
    /// What it may be.
    pub expected: &'static str,
    /// What it was.
    pub value: f64,
}

/// What a range reading says of the points in its beam.
pub trait SensorModel {
    /// How far the beam got and whether something stopped it, or `None` for a reading that says nothing.
    fn sounding(&self, sensor: &RangeSensor, reading: Reading) -> Option<Sounding>;

    /// The part of the plane outside of which [`SensorModel::evidence`] is nothing.
    fn footprint(&self, sounding: Sounding) -> Footprint;

    /// The evidence for one point of the footprint.
    fn evidence(&self, sounding: Sounding, point: BeamPoint) -> Evidence;

    /// Calls `deposit(cell index, evidence)` for every cell of which the beam says something.
    fn draw(
        &self,
        frame: &GridFrame,
        grid_from_sensor: &Isometry2<f64>,
        sounding: Sounding,
        mut deposit: impl FnMut(usize, Evidence),
    ) where
        Self: Sized,
    {
        let mut judge = |index, point| {
            let evidence = self.evidence(sounding, point);
            if !evidence.is_nothing() {
                deposit(index, evidence);
            }
        };
        match self.footprint(sounding) {
            Footprint::Ray { reach } => {
                let direction = grid_from_sensor.rotation * nalgebra::Vector2::x();
                let start = grid_from_sensor.translation.vector.into();
                for cell in RayCells::new(frame, start, direction, reach) {
                    let (distance, chord) = (0.5 * (cell.enter + cell.leave), cell.leave - cell.enter);
                    judge(cell.index, BeamPoint { distance, bearing: 0.0, chord });
                }
            }
            Footprint::Cone { half_width, reach } => {
                for (index, distance, bearing) in ConeCells::new(frame, grid_from_sensor, half_width, reach) {
                    judge(index, BeamPoint { distance, bearing, chord: 0.0 });
                }
            }
        }
    }
}

/// The range of an echo, or the maximum range where there was none.
fn sounding_up_to(max_range: f64, reading: Reading) -> Option<Sounding> {
    match reading {
        Reading::Echo(range) => Some(Sounding { range: f64::from(range), echo: true }),
        Reading::NoEcho => Some(Sounding { range: max_range, echo: false }),
        Reading::Invalid => None,
    }
}

/// Refuses an option outside `allowed`.
fn check(
    model: &'static str,
    field: &'static str,
    value: f64,
    allowed: std::ops::RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), ModelError> {
    if allowed.contains(&value) { Ok(()) } else { Err(ModelError { model, field, expected, value }) }
}

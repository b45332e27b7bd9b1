use super::{BeamPoint, Footprint, ModelError, SensorModel, Sounding, check, sounding_up_to};
use crate::{Evidence, RangeSensor, Reading};

/// A thin ray: every cell it crosses is empty, the cell in which it ends is occupied.
///
/// Lasers that see nothing often see glass or daylight, not open space; so silence counts as emptiness only up to
/// [`LaserRay::no_echo_range`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct LaserRay {
    /// Evidence of emptiness for a cell that is crossed from edge to edge, in `[0, 1]`.
    pub empty: f64,
    /// Evidence of occupancy for the cell in which the ray ends, in `[0, 1]`.
    pub occupied: f64,
    /// Echoes from beyond are drawn as empty up to here, in metres; infinite for no limit.
    pub max_range: f64,
    /// Whether, and how far in metres, silence means emptiness; `None` drops readings without echo.
    pub no_echo_range: Option<f64>,
}

impl Default for LaserRay {
    fn default() -> Self {
        Self { empty: 0.3, occupied: 0.6, max_range: f64::INFINITY, no_echo_range: None }
    }
}

impl LaserRay {
    /// Checks that every option lies where it makes sense.
    ///
    /// # Errors
    ///
    /// The first option that does not.
    pub fn validate(&self) -> Result<(), ModelError> {
        let check = |field, value, allowed, expected| check("laser ray", field, value, allowed, expected);
        check("empty", self.empty, 0.0..=1.0, "in [0, 1]")?;
        check("occupied", self.occupied, 0.0..=1.0, "in [0, 1]")?;
        check("max_range", self.max_range, 1e-6..=f64::INFINITY, "a length in metres above 0")?;
        check("no_echo_range", self.no_echo_range.unwrap_or(0.0), 0.0..=f64::INFINITY, "not negative")
    }
}

impl SensorModel for LaserRay {
    fn sounding(&self, sensor: &RangeSensor, reading: Reading) -> Option<Sounding> {
        let heard = sounding_up_to(sensor.max_range(), reading)?;
        if !heard.echo {
            let range = self.no_echo_range?.min(sensor.max_range()).min(self.max_range);
            return Some(Sounding { range, echo: false });
        }
        Some(heard.within(self.max_range))
    }

    #[inline]
    fn footprint(&self, sounding: Sounding) -> Footprint {
        Footprint::Ray { reach: sounding.range }
    }

    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "degrees in [0, 1]")]
    fn evidence(&self, sounding: Sounding, point: BeamPoint) -> Evidence {
        // The footprint ends with the ray, so only the last cell holds its end.
        let ends_here = point.distance + 0.5 * point.chord >= sounding.range - 1e-9;
        match (ends_here, sounding.echo) {
            (true, true) => Evidence { empty: 0.0, occupied: self.occupied as f32 },
            (true, false) | (false, _) => Evidence { empty: self.empty as f32, occupied: 0.0 },
        }
    }
}

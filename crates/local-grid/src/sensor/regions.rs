use super::{BeamPoint, Footprint, ModelError, SensorModel, Sounding, check, sounding_up_to};
use crate::{Evidence, RangeSensor, Reading};

/// Murphy's model of a sonar reading by regions of its cone, as masses of belief (Hughes & Murphy 1992).
///
/// With `R` the weight scale, `ρ` the distance, `α` the angle from the axis and `β` half the beam's width:
///
/// ```text
/// g = ((R − ρ)/R + (β − α)/β) / 2
/// region I  (|ρ − r| ≤ tolerance):  occupied = g · max_occupied
/// region II (ρ < r − tolerance):    empty    = g
/// ```
///
/// Feeds [`DempsterShafer`](crate::DempsterShafer) as it stands. In a [`Bayes`](crate::Bayes) cell the pignistic
/// probability `(1 + occupied − empty)/2` keeps a hit from pushing towards empty, which the raw formula would do far away.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct SonarRegions {
    /// `R` in metres: where the weight of distance is used up. A scale of trust, not the device's maximum.
    pub range_scale: f64,
    /// `β`: half the width of the cone in radians.
    pub half_width: f64,
    /// Half the depth of the occupied region, in metres.
    pub tolerance: f64,
    /// The most that a reading may claim for occupancy, in `[0, 1]`.
    pub max_occupied: f64,
    /// Echoes from beyond are drawn as empty up to here, in metres; infinite for no limit.
    pub max_range: f64,
}

impl Default for SonarRegions {
    fn default() -> Self {
        Self {
            range_scale: 3.5,
            half_width: 12.5f64.to_radians(),
            tolerance: 0.15,
            max_occupied: 0.98,
            max_range: f64::INFINITY,
        }
    }
}

impl SonarRegions {
    /// Checks that every option lies where its equation makes sense.
    ///
    /// # Errors
    ///
    /// The first option that does not.
    pub fn validate(&self) -> Result<(), ModelError> {
        let check = |field, value, allowed, expected| check("sonar regions", field, value, allowed, expected);
        check("range_scale", self.range_scale, 1e-6..=1e6, "a length in metres above 0")?;
        check("half_width", self.half_width, 1e-6..=std::f64::consts::PI, "in (0, π] radians")?;
        check("tolerance", self.tolerance, 1e-6..=1e3, "a length in metres above 0")?;
        check("max_occupied", self.max_occupied, 0.0..=1.0, "in [0, 1]")?;
        check("max_range", self.max_range, 1e-6..=f64::INFINITY, "a length in metres above 0")
    }

    /// `g`: the weight of a point, in `[0, 1]`.
    fn weight(&self, point: BeamPoint) -> f64 {
        let near = (self.range_scale - point.distance) / self.range_scale;
        let central = (self.half_width - point.bearing.abs()) / self.half_width;
        0.5 * (near + central)
    }
}

impl SensorModel for SonarRegions {
    fn sounding(&self, sensor: &RangeSensor, reading: Reading) -> Option<Sounding> {
        sounding_up_to(sensor.max_range(), reading).map(|heard| heard.within(self.max_range))
    }

    fn footprint(&self, sounding: Sounding) -> Footprint {
        let reach = if sounding.echo { sounding.range + self.tolerance } else { sounding.range };
        Footprint::Cone { half_width: self.half_width, reach: reach.min(self.range_scale) }
    }

    #[expect(clippy::cast_possible_truncation, reason = "degrees in [0, 1]")]
    fn evidence(&self, sounding: Sounding, point: BeamPoint) -> Evidence {
        let weight = self.weight(point).clamp(0.0, 1.0);
        if point.distance < sounding.range - self.tolerance {
            return Evidence { empty: weight.min(self.max_occupied) as f32, occupied: 0.0 };
        }
        let occupied = if sounding.echo { weight * self.max_occupied } else { 0.0 };
        Evidence { empty: 0.0, occupied: occupied as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn book() -> SonarRegions {
        SonarRegions { range_scale: 10.0, half_width: 15f64.to_radians(), tolerance: 0.5, ..SonarRegions::default() }
    }

    fn at(distance: f64, degrees: f64) -> Evidence {
        let point = BeamPoint { distance, bearing: degrees.to_radians(), chord: 0.0 };
        book().evidence(Sounding { range: 6.0, echo: true }, point)
    }

    #[test]
    fn the_textbook_numbers_come_out() {
        approx::assert_relative_eq!(at(3.5, 0.0).empty, 0.825, epsilon = 1e-6);
        approx::assert_relative_eq!(at(6.0, 5.0).occupied, 0.5227, epsilon = 1e-4);
        assert_eq!(at(6.0, 5.0).empty, 0.0);
    }

    #[test]
    fn certainty_is_never_claimed() {
        assert!(at(0.0, 0.0).empty <= 0.98);
    }
}

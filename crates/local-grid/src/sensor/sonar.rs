use super::{BeamPoint, Footprint, ModelError, SensorModel, Sounding, check, piston, sounding_up_to};
use crate::{Evidence, RangeSensor, Reading};

/// How the trust in a sonar's reading falls off from the axis of its beam.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum AngularProfile {
    /// Power of a circular piston: `(2 J₁(ka sin θ) / (ka sin θ))²`.
    PistonPower {
        /// Wave number times radius of the transducer.
        ka: f64,
    },
    /// Pressure of a circular piston: `|2 J₁(ka sin θ) / (ka sin θ)|`.
    PistonPressure {
        /// Wave number times radius of the transducer.
        ka: f64,
    },
    /// `1 − (θ / half width)²`.
    Parabola,
    /// `cos²(π θ / (2 half width))`.
    CosineSquared,
    /// 1 all over the cone.
    Flat,
}

/// Oriolo's model of a sonar reading: a cone in which what lies nearer than the reading is empty and what lies at the
/// reading may be occupied.
///
/// With `ρ` the distance from the sensor's face, `θ` the angle from the beam's axis, and `r` the reading:
///
/// ```text
/// f_E(ρ) = k_E                        ρ < r − Δr        f_O(ρ) = k_O (1 − ((r − ρ)/Δr)²)    |ρ − r| < Δr
///          k_E ((r − ρ)/Δr)²   r − Δr ≤ ρ < r
/// m_v(ρ) = 1 − (1 + tanh(s (ρ − ρ_v))) / 2              visibility: far readings are often specular
/// empty  = D(θ) m_v(ρ) f_E(ρ)                           occupied = D(θ) m_v(ρ) f_O(ρ)
/// ```
///
/// After Oriolo, Ulivi & Vendittelli (1997, 1998) and Poloni et al. (1995). Their numbers are only known at second
/// hand: the defaults are reconstructed (a Polaroid 6500 at 49.4 kHz), and each is an option.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct SonarCone {
    /// `k_E`: evidence of emptiness on the axis of a near reading, in `[0, 1]`.
    pub empty: f64,
    /// `k_O`: evidence of occupancy at the reading, in `[0, 1]`.
    pub occupied: f64,
    /// `Δr`: half depth of the ring that may be occupied, in metres; at least 1.5 cells, or cells slip through the ring.
    pub depth: f64,
    /// `ρ_v`: distance in metres at which half of the trust is left.
    pub visibility: f64,
    /// `s`: how sharply the trust falls there, per metre.
    pub visibility_slope: f64,
    /// Half the width of the cone in radians.
    pub half_width: f64,
    /// How trust falls off from the axis.
    pub profile: AngularProfile,
    /// Echoes from beyond are drawn as empty up to here, in metres; infinite for no limit.
    pub max_range: f64,
    /// Whether, and how far in metres, silence means emptiness; `None` drops readings without echo.
    pub no_echo_range: Option<f64>,
}

impl Default for SonarCone {
    fn default() -> Self {
        Self {
            empty: 0.1,
            occupied: 0.25,
            depth: 0.15,
            visibility: 1.2,
            visibility_slope: 2.0,
            half_width: 12.5f64.to_radians(),
            profile: AngularProfile::PistonPower { ka: 17.38 },
            max_range: f64::INFINITY,
            no_echo_range: Some(f64::INFINITY), // the sensor's maximum range is nearer
        }
    }
}

impl SonarCone {
    /// Where less trust than this is left in a distance, nothing is drawn any more.
    const VANISHING: f64 = 1e-3;

    /// The model for working grids out of which signatures are cut: it sees to 2.5 m instead of 1.2 m.
    ///
    /// The short sight of the default keeps specular echoes out of a map for good, but leaves places little to be told apart
    /// by; a signature is compared with others that share its illusions, and two of them agree on more.
    #[must_use]
    pub fn for_signatures() -> Self {
        Self { visibility: 2.5, ..Self::default() }
    }

    /// Checks that every option lies where its equation makes sense.
    ///
    /// # Errors
    ///
    /// The first option that does not.
    pub fn validate(&self) -> Result<(), ModelError> {
        let check = |field, value, allowed, expected| check("sonar cone", field, value, allowed, expected);
        check("empty", self.empty, 0.0..=1.0, "in [0, 1]")?;
        check("occupied", self.occupied, 0.0..=1.0, "in [0, 1]")?;
        check("depth", self.depth, 1e-6..=1e3, "a length in metres above 0")?;
        check("visibility", self.visibility, 0.0..=1e6, "a length in metres, not negative")?;
        check("visibility_slope", self.visibility_slope, 1e-6..=1e6, "above 0")?;
        check("half_width", self.half_width, 1e-6..=std::f64::consts::PI, "in (0, π] radians")?;
        check("max_range", self.max_range, 1e-6..=f64::INFINITY, "a length in metres above 0")?;
        check("no_echo_range", self.no_echo_range.unwrap_or(0.0), 0.0..=f64::INFINITY, "not negative")?;
        match self.profile {
            AngularProfile::PistonPower { ka } | AngularProfile::PistonPressure { ka } => {
                check("ka", ka, 0.0..=1e4, "in [0, 10000]")
            }
            AngularProfile::Parabola | AngularProfile::CosineSquared | AngularProfile::Flat => Ok(()),
        }
    }

    /// `f_E`: emptiness at `distance` metres for a reading of `range` metres, on the axis and in full sight.
    #[must_use]
    pub fn radial_empty(&self, distance: f64, range: f64) -> f64 {
        if distance < range - self.depth {
            self.empty
        } else if distance < range {
            self.empty * ((range - distance) / self.depth).powi(2)
        } else {
            0.0
        }
    }

    /// `f_O`: occupancy at `distance` metres for an echo from `range` metres, on the axis and in full sight.
    #[must_use]
    pub fn radial_occupied(&self, distance: f64, range: f64) -> f64 {
        let off = (range - distance) / self.depth;
        // Half open like its source: the ring holds its near edge, where the value is 0 anyway.
        if off.abs() <= 1.0 { self.occupied * (1.0 - off * off) } else { 0.0 }
    }

    /// `m_v`: the trust left at `distance` metres.
    #[must_use]
    pub fn visibility_at(&self, distance: f64) -> f64 {
        // 1 − (1 + tanh x)/2 = 1 / (1 + exp 2x).
        1.0 / (1.0 + (2.0 * self.visibility_slope * (distance - self.visibility)).exp())
    }

    /// `D`: the trust left at `bearing` radians from the axis; 0 outside the cone.
    #[must_use]
    pub fn angular(&self, bearing: f64) -> f64 {
        let share = bearing / self.half_width;
        if share.abs() > 1.0 + 1e-12 {
            return 0.0;
        }
        match self.profile {
            AngularProfile::PistonPower { ka } => piston::amplitude(ka, bearing).powi(2),
            AngularProfile::PistonPressure { ka } => piston::amplitude(ka, bearing).abs(),
            AngularProfile::Parabola => (1.0 - share * share).max(0.0),
            AngularProfile::CosineSquared => (std::f64::consts::FRAC_PI_2 * share).cos().powi(2),
            AngularProfile::Flat => 1.0,
        }
    }

    /// Where the trust in distances vanishes, in metres.
    fn sight(&self) -> f64 {
        // m_v(ρ) = 1 / (1 + exp(2 s (ρ − ρ_v))).
        self.visibility + (1.0 / Self::VANISHING).ln() / (2.0 * self.visibility_slope)
    }
}

impl SensorModel for SonarCone {
    fn sounding(&self, sensor: &RangeSensor, reading: Reading) -> Option<Sounding> {
        if reading == Reading::NoEcho {
            let range = self.no_echo_range?.min(sensor.max_range()).min(self.max_range);
            return Some(Sounding { range, echo: false });
        }
        sounding_up_to(sensor.max_range(), reading).map(|heard| heard.within(self.max_range))
    }

    fn footprint(&self, sounding: Sounding) -> Footprint {
        let reach = if sounding.echo { sounding.range + self.depth } else { sounding.range };
        Footprint::Cone { half_width: self.half_width, reach: reach.min(self.sight()) }
    }

    #[expect(clippy::cast_possible_truncation, reason = "degrees in [0, 1]")]
    fn evidence(&self, sounding: Sounding, point: BeamPoint) -> Evidence {
        let empty = self.radial_empty(point.distance, sounding.range);
        let occupied = if sounding.echo { self.radial_occupied(point.distance, sounding.range) } else { 0.0 };
        if empty == 0.0 && occupied == 0.0 {
            return Evidence::default();
        }
        let trust = self.angular(point.bearing) * self.visibility_at(point.distance);
        Evidence { empty: (trust * empty) as f32, occupied: (trust * occupied) as f32 }
    }
}

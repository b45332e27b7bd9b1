use local_grid::{BeamPoint, Evidence, Footprint, RangeSensor, Reading, SensorModel, Sounding};

use crate::options::{GridError, check};

/// A sonar model for whole maps: what lies nearer than the reading is empty, and the echo has one cause on its arc.
///
/// A cone says little of where on its arc the echo arose, but the other readings do. So the occupied evidence of a
/// reading is a fixed amount, `echo` nats, shared out among the cells of its arc by what all readings together say of
/// them. With `w = 1 − ((ρ − r)/depth)²` the place of a cell in the ring around the reading, and `E`, `O` its sums of
/// empty and occupied evidence in nats:
///
/// ```text
/// O₀ = Σ occupied · w                                                 every arc at full length
/// q  = w · O · ((O + prior) / (O + E + prior))^contrast               what speaks for the cell being the cause
/// O ← Σ echo · q / (doubt + Σ q)                                      each echo shared out; `rounds` times
/// ```
///
/// A cell that would get less than 1/256 of an echo gets nothing of it, then and in later rounds: most of an arc lies in the
/// open, and is not asked twice.
///
/// This is the expectation step of a mixture of causes. One round of much contrast does as well as two of less where a
/// cell is met by a dozen readings; where it is met by a thousand, two are a little sharper, and cost more. It depends on
/// ratios of evidence, so it gets sharper, not saturated, with more readings: specular readings sweep over walls, but do
/// not outweigh them.
/// The result does not depend on the order of the readings. Only a map that holds all readings can do this
/// ([`GridMap`](crate::GridMap)); as a [`SensorModel`] of single readings the model gives the evidence of `O₀`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct SharedEcho {
    /// Evidence of emptiness within the cone, in `[0, 1]`.
    pub empty: f64,
    /// How much nearer than the reading a cell's centre must be to count as empty, in metres.
    pub margin: f64,
    /// Half the depth of the ring that holds the cause, in metres; at least a cell, or causes slip through.
    pub depth: f64,
    /// Occupied evidence in the middle of the ring before it is shared out, in nats.
    pub occupied: f64,
    /// Occupied evidence of one echo, in nats.
    pub echo: f64,
    /// How much must speak for a cause before half of the echo is given away, in nats.
    pub doubt: f64,
    /// How strongly empty evidence keeps echoes away.
    pub contrast: u8,
    /// Evidence, in nats, that a cell needs before its ratio counts.
    pub prior: f64,
    /// How often the echoes are shared out again.
    pub rounds: u8,
    /// Echoes from beyond this range, in metres, say nothing of occupancy, and no reading says anything beyond.
    pub max_range: f64,
    /// Half the width of the cone in radians; `None` takes the sensor's.
    pub half_width: Option<f64>,
    /// Whether, and how far in metres, silence means emptiness; `None` drops readings without echo, since smooth walls at a
    /// slant are silent, too.
    pub no_echo_range: Option<f64>,
}

impl Default for SharedEcho {
    fn default() -> Self {
        Self {
            empty: 0.15,
            margin: 0.02,
            depth: 0.1,
            occupied: 0.6,
            echo: 3.0,
            doubt: 0.3,
            contrast: 8,
            prior: 0.5,
            rounds: 1,
            max_range: f64::INFINITY,
            half_width: None,
            no_echo_range: None,
        }
    }
}

impl SharedEcho {
    /// Checks that every option lies where its equation makes sense.
    ///
    /// # Errors
    ///
    /// The first option that does not.
    pub fn validate(&self) -> Result<(), GridError> {
        let check = |option, value, allowed, expected| check("shared echo", option, value, allowed, expected);
        check("empty", self.empty, 0.0..=1.0, "in [0, 1]")?;
        check("margin", self.margin, 0.0..=1e3, "a length in metres, not negative")?;
        check("depth", self.depth, 1e-6..=1e3, "a length in metres above 0")?;
        check("occupied", self.occupied, 0.0..=100.0, "between 0 and 100 nats")?;
        check("echo", self.echo, 0.0..=100.0, "between 0 and 100 nats")?;
        check("doubt", self.doubt, 1e-9..=1e9, "above 0 nats")?;
        check("prior", self.prior, 1e-9..=1e9, "above 0 nats")?;
        check("rounds", f64::from(self.rounds), 0.0..=20.0, "at most 20")?;
        check("max_range", self.max_range, 1e-6..=f64::INFINITY, "a length in metres above 0")?;
        check("half_width", self.half_width.unwrap_or(1.0), 1e-6..=1.5, "in (0, 1.5] radians")?;
        check("no_echo_range", self.no_echo_range.unwrap_or(0.0), 0.0..=f64::INFINITY, "not negative")
    }

    /// Half the width of a sensor's cone, in radians.
    pub(crate) fn half_width_of(&self, sensor: &RangeSensor) -> f64 {
        self.half_width.unwrap_or(0.5 * sensor.beam_width()).clamp(1e-6, 1.5)
    }

    /// The place of a cell in the ring: 1 at the reading, 0 at `depth` from it.
    pub(crate) fn ring_weight(&self, off: f64) -> f64 {
        let share = off / self.depth;
        (1.0 - share * share).max(0.0)
    }

    /// The model with the width of a sensor's cone filled in.
    #[must_use]
    pub fn for_sensor(&self, sensor: &RangeSensor) -> Self {
        Self { half_width: Some(self.half_width_of(sensor)), ..self.clone() }
    }
}

impl SensorModel for SharedEcho {
    fn sounding(&self, sensor: &RangeSensor, reading: Reading) -> Option<Sounding> {
        let limit = sensor.max_range().min(self.max_range);
        match reading {
            Reading::Echo(range) if f64::from(range) <= limit => Some(Sounding { range: f64::from(range), echo: true }),
            Reading::Echo(_) => Some(Sounding { range: limit, echo: false }),
            Reading::NoEcho => Some(Sounding { range: self.no_echo_range?.min(limit), echo: false }),
            Reading::Invalid => None,
        }
    }

    /// The cone; where [`SharedEcho::half_width`] leaves its width to the sensor, see [`SharedEcho::for_sensor`].
    fn footprint(&self, sounding: Sounding) -> Footprint {
        let reach = if sounding.echo { sounding.range + self.depth } else { sounding.range };
        Footprint::Cone { half_width: self.half_width.unwrap_or(0.0), reach }
    }

    #[expect(clippy::cast_possible_truncation, reason = "degrees in [0, 1]")]
    fn evidence(&self, sounding: Sounding, point: BeamPoint) -> Evidence {
        let empty = if point.distance < sounding.range - self.margin { self.empty } else { 0.0 };
        let off = point.distance - sounding.range;
        let nats = if sounding.echo { self.occupied * self.ring_weight(off) } else { 0.0 };
        let occupied = -(-nats).exp_m1();
        Evidence { empty: empty as f32, occupied: occupied as f32 }
    }
}

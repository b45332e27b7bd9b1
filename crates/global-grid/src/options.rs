use std::ops::RangeInclusive;

use local_grid::{DempsterShafer, FrameError, Fuzzy, LaserRay, ModelError, SonarCone, SonarRegions};

use crate::{Calculus, SharedEcho, Tally};

/// How a global gridmap is built. `Default` is a fuzzy map of 0.1 m cells with the sensor models' own defaults.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct GridOptions {
    /// Edge of a cell in metres.
    pub resolution: f64,
    /// By which rule readings are joined.
    pub calculus: Calculus,
    /// How many nats of evidence the readings of a fuzzy cell count for at most, all together.
    ///
    /// A union takes readings for independent, which they are not: with enough of them every cell near a wall would be
    /// wholly empty and wholly occupied. A cell's sums are read as `e T/(T + e + o)` and `o T/(T + e + o)`, which keeps their
    /// ratio. Infinite for the plain union.
    pub most_evidence: f64,
    /// What a sonar's reading says.
    pub sonar: SonarModel,
    /// What a laser's (or an infrared sensor's) reading says.
    pub laser: LaserRay,
}

impl Default for GridOptions {
    fn default() -> Self {
        Self {
            resolution: 0.1,
            calculus: Calculus::default(),
            most_evidence: 8.0,
            sonar: SonarModel::default(),
            laser: LaserRay::default(),
        }
    }
}

/// Which model draws sonar readings.
///
/// The default is [`SharedEcho`], which looks at all readings at once and finds walls best; the other two judge every
/// reading by itself, as the literature does.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum SonarModel {
    /// A flat cone whose echo is shared out by what all readings say.
    Shared(SharedEcho),
    /// Oriolo's cone.
    Cone(SonarCone),
    /// Murphy's regions.
    Regions(SonarRegions),
}

impl Default for SonarModel {
    fn default() -> Self {
        Self::Shared(SharedEcho::default())
    }
}

/// Why a gridmap cannot be built, or a reading cannot enter it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// The edge of a cell must be a length that a grid can use.
    #[error("resolution must be between 0.0001 and 1000 metres per cell, got {0}")]
    Resolution(f64),
    /// A sensor model's options make no sense.
    #[error("a sensor model's options are wrong")]
    Model(#[from] ModelError),
    /// An option of this crate makes no sense.
    #[error("{model}: `{option}` must be {expected}, got {value}")]
    Option {
        /// What the option belongs to.
        model: &'static str,
        /// The option.
        option: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it was.
        value: f64,
    },
    /// A cell's sums can hold half a million full scans.
    #[error("contribution {0}: a cell's evidence would exceed {max} nats", max = f64::from(u32::MAX) / crate::UNITS_PER_NAT)]
    Full(u64),
    /// A pose must be finite and within reach of the cells' numbers.
    #[error("contribution {key}: pose must be finite and within {limit} m of the origin, got ({x}, {y}, {heading})")]
    Pose {
        /// The contribution that the scan was to join.
        key: u64,
        /// East, in metres.
        x: f64,
        /// North, in metres.
        y: f64,
        /// Heading in radians.
        heading: f64,
        /// The farthest that a pose may be, in metres.
        limit: f64,
    },
    /// A beam may not be longer than a few thousand cells.
    #[error(
        "contribution {key}: sensor `{sensor}` reaches {range} m, more than {limit} cells of {resolution} m: \
         use larger cells, or limit the sensor's range"
    )]
    Range {
        /// The contribution that the scan was to join.
        key: u64,
        /// The sensor.
        sensor: String,
        /// Its longest reading in metres.
        range: f64,
        /// The edge of a cell in metres.
        resolution: f64,
        /// The most cells that a beam may be long.
        limit: u32,
    },
    /// As many poses as scans are needed to move a contribution.
    #[error("contribution {key} holds {scans} scans, got {poses} poses")]
    Poses {
        /// The contribution.
        key: u64,
        /// Its scans.
        scans: usize,
        /// The poses given.
        poses: usize,
    },
    /// There is no such contribution.
    #[error("there is no contribution {0}")]
    NoContribution(u64),
    /// Nothing is known of any cell, so there is no map to cut out.
    #[error("no reading has said anything of any cell")]
    NothingKnown,
    /// A map can be cut to a box only.
    #[error(
        "the box must reach from a south-west to a north-east corner within {limit} m of the origin, \
         got ({west}, {south}) and ({east}, {north})"
    )]
    Box {
        /// West, in metres.
        west: f64,
        /// South, in metres.
        south: f64,
        /// East, in metres.
        east: f64,
        /// North, in metres.
        north: f64,
        /// The farthest that a corner may be, in metres.
        limit: f64,
    },
    /// The box around all that is known is too large for one dense grid.
    #[error("the known cells span a box that no dense grid can hold")]
    Frame(#[from] FrameError),
}

impl GridOptions {
    /// The same with no reading drawn farther than `range` metres, whatever the sensor: an echo from beyond leaves
    /// emptiness up to there.
    #[must_use]
    pub fn within_range(mut self, range: f64) -> Self {
        let limit = |max_range: &mut f64| *max_range = max_range.min(range);
        match &mut self.sonar {
            SonarModel::Shared(model) => limit(&mut model.max_range),
            SonarModel::Cone(model) => limit(&mut model.max_range),
            SonarModel::Regions(model) => limit(&mut model.max_range),
        }
        limit(&mut self.laser.max_range);
        self
    }

    /// Checks that every option lies where it makes sense.
    ///
    /// # Errors
    ///
    /// The first option that does not.
    pub fn validate(&self) -> Result<(), GridError> {
        if !(1e-4..=1e3).contains(&self.resolution) {
            return Err(GridError::Resolution(self.resolution));
        }
        check("grid", "most_evidence", self.most_evidence, 1e-6..=f64::INFINITY, "above 0 nats")?;
        match &self.sonar {
            SonarModel::Shared(model) => model.validate()?,
            SonarModel::Cone(model) => model.validate()?,
            SonarModel::Regions(model) => model.validate()?,
        }
        self.laser.validate()?;
        Ok(())
    }
}

impl GridOptions {
    /// The degrees to which a cell is empty and occupied, whatever the calculus: fuzzy memberships, masses of belief, or
    /// what the probability says beyond one half (`1 − 2p` or `2p − 1`).
    #[must_use]
    pub fn degrees(&self, tally: Tally) -> Fuzzy {
        match self.calculus {
            Calculus::Fuzzy => tally.fuzzy(self.most_evidence),
            Calculus::Bayes => {
                let belief = 2.0 * tally.bayes().probability() - 1.0;
                Fuzzy { empty: (-belief).max(0.0), occupied: belief.max(0.0) }
            }
            Calculus::DempsterShafer => {
                let DempsterShafer { empty, occupied, .. } = tally.dempster_shafer();
                Fuzzy { empty, occupied }
            }
        }
    }

    /// The probability of being occupied that a decision should use, one half where nothing is known.
    ///
    /// For masses and for memberships it is the pignistic one, `(1 + O − E)/2`, which for the fuzzy pair is the crisp
    /// reading of the map.
    #[must_use]
    pub fn probability(&self, tally: Tally) -> f32 {
        match self.calculus {
            Calculus::Bayes => tally.bayes().probability(),
            Calculus::Fuzzy | Calculus::DempsterShafer => {
                let Fuzzy { empty, occupied } = self.degrees(tally);
                0.5 * (1.0 + occupied - empty)
            }
        }
    }
}

/// Refuses an option outside `allowed`.
pub(crate) fn check(
    model: &'static str,
    option: &'static str,
    value: f64,
    allowed: RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), GridError> {
    if allowed.contains(&value) { Ok(()) } else { Err(GridError::Option { model, option, expected, value }) }
}

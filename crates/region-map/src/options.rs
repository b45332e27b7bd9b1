//! What decides where one region ends and the next begins.

/// What decides where one region ends and the next begins; lengths in metres.
///
/// One set serves every map: the defaults follow from the sizes of people, doors and chairs, not from a single building.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Options {
    /// Cells are free where their membership is above this, in `[0, 1)`.
    pub threshold: f32,
    /// Free-standing obstacles at most this far across are furniture and part of their room, `[0, 10]` m.
    pub furniture: f64,
    /// So are blocks up to this long if they are at least half as thick as furniture is wide, `[0, 10]` m: tables that a
    /// robot's sensors see as a whole. 0 for a drawn map, in which such blocks are pillars.
    pub tables: f64,
    /// Obstacles with smaller gaps between them are one obstacle, `[0, 1]` m. Walls that a robot saw are dotted, walls that
    /// somebody drew are not.
    pub wall_gap: f64,
    /// How far the faces of walls may be off, together at both sides of a passage, `[0, 1]` m: a corridor that narrows by
    /// less has no gateway there. 0 for a drawn map.
    pub roughness: f64,
    /// What is narrower is a crack in a wall and no gateway, `[0, 10]` m.
    pub narrowest_gateway: f64,
    /// Gateways are at most this wide, `[0.1, 20]` m.
    pub widest_gateway: f64,
    /// Smaller pieces join a neighbour, or are dropped where they have none, `[0, 1000]` m².
    pub least_area: f64,
    /// What is narrower in the mean is no region, `[0, 10]` m: nobody can stand in the strips that readings show behind a
    /// dotted wall.
    pub narrowest_region: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            threshold: 0.5,
            furniture: 1.1,
            tables: 0.0,
            wall_gap: 0.1,
            roughness: 0.0,
            narrowest_gateway: 0.4,
            widest_gateway: 4.0,
            least_area: 1.5,
            narrowest_region: 0.6,
        }
    }
}

impl Options {
    /// For a map that a robot's range sensors built: walls are dotted and off by a few decimetres, so a corridor narrows
    /// here and there without having a door in it; and the posts of a door look so thick that a third of its width is left.
    #[must_use]
    pub fn robot_map() -> Self {
        Self { tables: 2.75, wall_gap: 0.4, roughness: 1.0, narrowest_gateway: 0.3, ..Self::default() }
    }
}

/// Why a grid could not be cut into regions.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SegmentError {
    /// An option is out of its range.
    #[error("option {name} must be {expected}, got {value}")]
    Option {
        /// Which option.
        name: &'static str,
        /// What is allowed.
        expected: &'static str,
        /// What was given.
        value: f64,
    },
    /// The mask of unexplored cells is not of the grid's size.
    #[error(
        "the mask of unexplored cells has {rows} rows and {columns} columns, the grid {grid_rows} and {grid_columns}"
    )]
    Mask {
        /// Rows of the mask.
        rows: usize,
        /// Columns of the mask.
        columns: usize,
        /// Rows of the grid.
        grid_rows: usize,
        /// Columns of the grid.
        grid_columns: usize,
    },
    /// Labels have 16 bits.
    #[error("the map falls into {0} regions, more than 65535; is it noise, or the resolution wrong?")]
    TooManyRegions(usize),
}

impl Options {
    /// Refuses values that mean nothing.
    pub(crate) fn check(&self) -> Result<(), SegmentError> {
        let checks = [
            ("threshold", "in [0, 1)", f64::from(self.threshold), (0.0..1.0).contains(&self.threshold)),
            ("furniture", "in [0, 10] m", self.furniture, (0.0..=10.0).contains(&self.furniture)),
            ("tables", "in [0, 10] m", self.tables, (0.0..=10.0).contains(&self.tables)),
            ("roughness", "in [0, 1] m", self.roughness, (0.0..=1.0).contains(&self.roughness)),
            ("wall_gap", "in [0, 1] m", self.wall_gap, (0.0..=1.0).contains(&self.wall_gap)),
            (
                "narrowest_gateway",
                "in [0, 10] m",
                self.narrowest_gateway,
                (0.0..=10.0).contains(&self.narrowest_gateway),
            ),
            ("widest_gateway", "in [0.1, 20] m", self.widest_gateway, (0.1..=20.0).contains(&self.widest_gateway)),
            ("narrowest_region", "in [0, 10] m", self.narrowest_region, (0.0..=10.0).contains(&self.narrowest_region)),
            ("least_area", "in [0, 1000] m²", self.least_area, (0.0..=1000.0).contains(&self.least_area)),
        ];
        match checks.into_iter().find(|check| !check.3) {
            Some((name, expected, value, _)) => Err(SegmentError::Option { name, expected, value }),
            None => Ok(()),
        }
    }
}

use serde::Deserialize;

/// One kind of file, or one kind of line in a file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Table {
    /// Which files it is about: a pattern of their names in which `*` stands for anything; any file where it is missing.
    pub(crate) file: Option<String>,
    /// Which lines it is about: those whose first column is this word.
    pub(crate) tag: Option<String>,
    #[serde(default)]
    pub(crate) separator: Separator,
    /// So many lines at the beginning of a file are titles.
    #[serde(default)]
    pub(crate) header_lines: u64,
    /// How many columns a line has, tag included; any number where it is missing.
    pub(crate) columns: Option<usize>,
    pub(crate) stamp: Option<StampColumn>,
    /// Seconds from line to line, where lines have no stamp.
    pub(crate) period_s: Option<f64>,
    pub(crate) pose: Option<PoseColumns>,
    pub(crate) wheels: Option<Wheels>,
    pub(crate) motors: Option<Motors>,
    pub(crate) heading: Option<HeadingColumn>,
    #[serde(default)]
    pub(crate) ranges: Vec<Ranges>,
    /// Lines of this table are known and hold nothing for a map.
    #[serde(default)]
    pub(crate) ignore: bool,
}

/// A column: 1 is the first, -1 the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(transparent)]
pub(crate) struct Column(pub(crate) i32);

/// What stands between columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
pub(crate) enum Separator {
    /// Blanks and tabulators, any number.
    #[default]
    #[serde(rename = "whitespace")]
    Whitespace,
    #[serde(rename = ",")]
    Comma,
    #[serde(rename = ";")]
    Semicolon,
    /// Words of letters: `L58F57R93t30` has four columns, and its tag is `LFRt`.
    #[serde(rename = "letters")]
    Letters,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StampColumn {
    pub(crate) column: Column,
    /// Seconds per unit.
    #[serde(default = "one")]
    pub(crate) seconds: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PoseColumns {
    pub(crate) x: Column,
    pub(crate) y: Column,
    pub(crate) heading: Column,
    /// Metres per unit of x and y.
    #[serde(default = "one")]
    pub(crate) metres: f64,
    /// Degrees per unit of the heading; radians where it is missing.
    pub(crate) degrees: Option<f64>,
    #[serde(default)]
    pub(crate) clockwise: bool,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wheels {
    /// The columns of the left wheels; their mean counts.
    pub(crate) left: Vec<Column>,
    pub(crate) right: Vec<Column>,
    /// Whether the columns count since the beginning, instead of since the line before.
    #[serde(default)]
    pub(crate) accumulated: bool,
    /// Metres of travel per unit.
    pub(crate) metres: f64,
    /// Metres between the left and the right wheels.
    pub(crate) track: f64,
    /// Where the turns come from.
    #[serde(default)]
    pub(crate) turn: Turn,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Turn {
    /// The difference of the wheels.
    #[default]
    Wheels,
    /// The heading of the same line, where it has one.
    Heading,
}

/// Commands to motors, for robots that do not measure how far their wheels turn.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Motors {
    pub(crate) left: Column,
    pub(crate) right: Column,
    /// How long the commands of the line before lasted.
    pub(crate) lasted: Column,
    /// Seconds per unit of `lasted`.
    #[serde(default = "one")]
    pub(crate) seconds: f64,
    /// Metres per second per unit of a command.
    pub(crate) speed: f64,
    /// Degrees of a turn on the spot, however long it lasted.
    pub(crate) turn_deg: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct HeadingColumn {
    pub(crate) column: Column,
    /// Degrees per unit; radians where it is missing.
    pub(crate) degrees: Option<f64>,
    #[serde(default)]
    pub(crate) clockwise: bool,
    /// Degrees to add, counter-clockwise, after everything else.
    #[serde(default)]
    pub(crate) offset_deg: f64,
    /// Values that mean "not known".
    #[serde(default)]
    pub(crate) invalid: Vec<f64>,
    /// The standard deviation of a reading; of a gyro's, its drift left aside.
    pub(crate) deviation_deg: f64,
    /// Whether a gyro adds it up, so that it drifts.
    #[serde(default)]
    pub(crate) gyro: bool,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "RangesText")]
pub(crate) struct Ranges {
    /// The sensor that they come from.
    pub(crate) sensor: String,
    /// Metres per unit.
    pub(crate) metres: f64,
    /// Values (before the unit) that mean "no echo".
    pub(crate) no_echo: Vec<f64>,
    /// Values from this one on mean "no echo".
    pub(crate) no_echo_from: Option<f64>,
    /// Values that are no measurement.
    pub(crate) invalid: Vec<f64>,
    /// Seconds from the first beam to the last, which is fired at the line's stamp but for the latency.
    pub(crate) sweep_s: f64,
    /// Seconds from the last beam to the line's stamp: the odometry of the line has gone on since.
    pub(crate) latency_s: f64,
    pub(crate) layout: Layout,
}

/// How the ranges of a line are laid out.
#[derive(Debug, Clone)]
pub(crate) enum Layout {
    /// One column per beam, in any order.
    Columns(Vec<Column>),
    /// One column per beam from this one on.
    From(Column),
    /// A single beam whose bearing (degrees) is in one column and its range in another.
    Beam(BeamText),
    /// Pairs `bearing/range`, one per column; beams without a pair have no echo.
    Pairs(PairsText),
    /// `x y` of points in the sensor's frame, two columns each.
    Points(PointsText),
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BeamText {
    pub(crate) bearing: Column,
    pub(crate) range: Column,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PairsText {
    /// The first pair.
    pub(crate) from: Column,
    /// Degrees to add to a bearing.
    #[serde(default)]
    pub(crate) offset_deg: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointsText {
    /// How many points follow.
    pub(crate) count: Column,
    /// x of the first.
    pub(crate) from: Column,
    /// Degrees from the robot's nose to the sensor's axis.
    #[serde(default)]
    pub(crate) offset_deg: f64,
}

/// Ranges as a description writes them: exactly one layout is given.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RangesText {
    sensor: String,
    #[serde(default = "one")]
    metres: f64,
    #[serde(default)]
    no_echo: Vec<f64>,
    no_echo_from: Option<f64>,
    #[serde(default)]
    invalid: Vec<f64>,
    #[serde(default)]
    sweep_s: f64,
    #[serde(default)]
    latency_s: f64,
    columns: Option<Vec<Column>>,
    from: Option<Column>,
    beam: Option<BeamText>,
    pairs: Option<PairsText>,
    points: Option<PointsText>,
}

impl TryFrom<RangesText> for Ranges {
    type Error = String;

    fn try_from(text: RangesText) -> Result<Self, String> {
        let given = [
            text.columns.map(Layout::Columns),
            text.from.map(Layout::From),
            text.beam.map(Layout::Beam),
            text.pairs.map(Layout::Pairs),
            text.points.map(Layout::Points),
        ];
        let mut layouts = given.into_iter().flatten();
        let (Some(layout), None) = (layouts.next(), layouts.next()) else {
            return Err(format!(
                "the ranges of `{}` need one of `columns`, `from`, `beam`, `pairs` and `points`",
                text.sensor
            ));
        };
        let RangesText { sensor, metres, no_echo, no_echo_from, invalid, sweep_s, latency_s, .. } = text;
        Ok(Self { sensor, metres, no_echo, no_echo_from, invalid, sweep_s, latency_s, layout })
    }
}

fn one() -> f64 {
    1.0
}

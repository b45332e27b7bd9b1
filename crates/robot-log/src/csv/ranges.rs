use std::sync::Arc;

use local_grid::{Heading, RangeSensor, Reading, Scan};

use super::fields::Fields;
use crate::description::{BeamText, Layout, PairsText, PointsText, Ranges};
use crate::error::{Fault, LogErrorKind};
use crate::lines::parse;

/// The scan that a line holds in the columns that `ranges` describes.
pub(super) fn scan(ranges: &Ranges, sensor: &Arc<RangeSensor>, line: &[u8], fields: &Fields) -> Result<Scan, Fault> {
    let beams = sensor.mounts().len();
    let reading = |index: Option<usize>| number(fields, line, index).map(|raw| meaning(ranges, sensor, raw));
    let readings = match &ranges.layout {
        Layout::Columns(columns) => {
            columns.iter().map(|column| reading(fields.index(*column))).collect::<Result<_, _>>()?
        }
        Layout::From(from) => {
            let first = fields.index(*from).unwrap_or(fields.len());
            (first..first + beams).map(|index| reading(Some(index))).collect::<Result<_, _>>()?
        }
        Layout::Beam(BeamText { bearing, range }) => {
            let mut readings = vec![Reading::Invalid; beams];
            let degrees = fields.number(line, *bearing, "the bearing of the beam in degrees")?;
            // A servo that overshoots its range has no beam in the description: the reading is left out.
            if let Some(beam) = beam_at(sensor, degrees.to_radians()) {
                readings[beam] = reading(fields.index(*range))?;
            }
            readings
        }
        Layout::Pairs(PairsText { from, offset_deg }) => {
            pairs(ranges, sensor, line, fields, fields.index(*from), *offset_deg)?
        }
        Layout::Points(PointsText { count, from, offset_deg }) => {
            let count = fields.number(line, *count, "the number of points")?;
            points(ranges, sensor, line, fields, fields.index(*from), (count, *offset_deg))?
        }
    };
    Scan::new(Arc::clone(sensor), readings).map_err(|error| {
        let kind =
            LogErrorKind::Field { expected: format!("readings of `{}`", sensor.name()), found: error.to_string() };
        Fault { kind, span: None }
    })
}

const RANGE: &str = "a range, finite and not negative";

fn number(fields: &Fields, line: &[u8], index: Option<usize>) -> Result<f64, Fault> {
    let value = fields.number_at(line, index, RANGE)?;
    if value < 0.0 { Err(Fault::field(line, fields.span(line, index), RANGE)) } else { Ok(value) }
}

/// What the number `raw` in a column means for a beam.
fn meaning(ranges: &Ranges, sensor: &RangeSensor, raw: f64) -> Reading {
    if ranges.invalid.contains(&raw) {
        Reading::Invalid
    } else if ranges.no_echo.contains(&raw) || ranges.no_echo_from.is_some_and(|from| raw >= from) {
        Reading::NoEcho
    } else {
        sensor.reading(raw * ranges.metres)
    }
}

/// `bearing/range` in degrees and the table's unit, one pair per column.
fn pairs(
    ranges: &Ranges,
    sensor: &RangeSensor,
    line: &[u8],
    fields: &Fields,
    first: Option<usize>,
    offset_deg: f64,
) -> Result<Vec<Reading>, Fault> {
    let mut readings = vec![Reading::NoEcho; sensor.mounts().len()];
    for index in first.unwrap_or(fields.len())..fields.len() {
        let span = fields.span(line, Some(index));
        let text = &line[span.clone()];
        let slash = text.iter().position(|byte| *byte == b'/');
        let parts = slash.and_then(|slash| Some((parse(&text[..slash])?, parse(&text[slash + 1..])?)));
        let sound = |(bearing, range): &(f64, f64)| bearing.is_finite() && range.is_finite() && *range >= 0.0;
        let Some((bearing, range)) = parts.filter(sound) else {
            return Err(Fault::field(line, span, "a bearing in degrees, `/` and a range"));
        };
        if let Some(beam) = beam_at(sensor, (bearing + offset_deg).to_radians()) {
            readings[beam] = meaning(ranges, sensor, range);
        }
    }
    Ok(readings)
}

/// Points in the sensor's frame; each is the reading of the ray nearest to it, the nearer point where two share a ray.
/// Rays without a point tell nothing: the log does not say whether they fired.
fn points(
    ranges: &Ranges,
    sensor: &RangeSensor,
    line: &[u8],
    fields: &Fields,
    first: Option<usize>,
    (count, offset_deg): (f64, f64),
) -> Result<Vec<Reading>, Fault> {
    let first = first.unwrap_or(fields.len());
    let mut readings = vec![Reading::Invalid; sensor.mounts().len()];
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates; a line has fewer columns")]
    let stated = (count.max(0.0) as usize).min(fields.len() + 1); // too many are found missing below
    for pair in 0..stated {
        let coordinate = |k: usize| fields.number_at(line, Some(first + 2 * pair + k), "a coordinate of a point");
        let (x, y) = (coordinate(0)? * ranges.metres, coordinate(1)? * ranges.metres);
        let Some(beam) = beam_at(sensor, y.atan2(x) + offset_deg.to_radians()) else { continue };
        let reading = sensor.reading(x.hypot(y));
        match (readings[beam], reading) {
            (Reading::Echo(known), Reading::Echo(range)) if known <= range => {}
            (_, reading) => readings[beam] = reading,
        }
    }
    Ok(readings)
}

/// The beam that looks along `bearing`, in radians from the robot's nose, to within half a beam width or half a degree.
fn beam_at(sensor: &RangeSensor, bearing: f64) -> Option<usize> {
    let mounts = sensor.mounts();
    let apart =
        |beam: usize| (Heading::from_radians(bearing) - Heading::from_radians(mounts[beam].rotation.angle())).abs();
    let tolerance = (sensor.beam_width() / 2.0).max(0.5f64.to_radians()) + 1e-9;
    let guess = in_fan(sensor, bearing).filter(|beam| apart(*beam) <= tolerance);
    // The sensors of a ring stand in no order: the nearest is searched for.
    let nearest =
        || (0..mounts.len()).min_by(|a, b| apart(*a).total_cmp(&apart(*b))).filter(|beam| apart(*beam) <= tolerance);
    guess.or_else(nearest)
}

/// The beam that looks along `bearing` if the beams are at equal steps, as their first two are.
fn in_fan(sensor: &RangeSensor, bearing: f64) -> Option<usize> {
    let mounts = sensor.mounts();
    let first = mounts[0].rotation.angle();
    let step = mounts[0].rotation.angle_to(&mounts.get(1)?.rotation);
    let beam = ((bearing - first) / step).round();
    let turn = (std::f64::consts::TAU / step).abs().round();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative; checked against the number of beams"
    )]
    let beam = beam.rem_euclid(turn) as usize;
    (beam < mounts.len()).then_some(beam)
}

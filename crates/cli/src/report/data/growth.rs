use hierarchy::{Atlas, Growth};
use serde::Serialize;

use super::{mm, whole};
use crate::report::base64::base64_u16;

/// How the map grew, for the slider of the page.
#[derive(Debug, Serialize)]
pub(super) struct GrowthData {
    /// Where each place was put when it was new.
    x: Vec<i64>,
    y: Vec<i64>,
    /// Links there were when the places were relaxed.
    links: Vec<usize>,
    before: Vec<f64>,
    after: Vec<f64>,
    expected: Vec<usize>,
    /// How many places there were.
    places: Vec<usize>,
    /// Relaxations there were in all.
    of: usize,
    /// Millimetres per unit of `offsets`.
    unit: i64,
    /// For each relaxation and each of its places: where it was, less where it is in the end, `x` and then `y`.
    offsets: String,
}

/// The largest offset that 16 bits hold.
const LARGEST: i64 = 32_767;

impl GrowthData {
    pub(super) fn new(growth: &Growth, atlas: &Atlas) -> Self {
        let relaxations = || growth.relaxations.iter();
        let offsets: Vec<i64> = relaxations()
            .flat_map(|relaxation| relaxation.positions.iter().zip(&atlas.places))
            .map(|(then, now)| then - now.position)
            .flat_map(|offset| [mm(offset.x), mm(offset.y)])
            .collect();
        let farthest = offsets.iter().map(|offset| offset.abs()).max().unwrap_or(0);
        let unit = farthest / LARGEST + 1;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "two's complement, within bounds")]
        let stored = |offset: &i64| (offset / unit) as i16 as u16;
        Self {
            x: growth.arrivals.iter().map(|place| mm(place.x)).collect(),
            y: growth.arrivals.iter().map(|place| mm(place.y)).collect(),
            links: relaxations().map(|relaxation| relaxation.links).collect(),
            before: relaxations().map(|relaxation| rounded(relaxation.energy_before)).collect(),
            after: relaxations().map(|relaxation| rounded(relaxation.energy_after)).collect(),
            expected: relaxations().map(|relaxation| relaxation.degrees_of_freedom).collect(),
            places: relaxations().map(|relaxation| relaxation.positions.len()).collect(),
            of: growth.n_relaxations,
            unit,
            offsets: base64_u16(offsets.iter().map(stored)),
        }
    }
}

/// To four decimals: what the page prints.
fn rounded(value: f64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "an energy is no larger than a float holds exactly")]
    let whole = whole(value * 1e4) as f64;
    whole / 1e4
}

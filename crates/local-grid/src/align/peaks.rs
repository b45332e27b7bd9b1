use nalgebra::Vector2;

use super::search::Volume;
use super::{AlignOptions, PEAK_TURN};

/// A pose at which the score is high.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Peak {
    pub(crate) offset: Vector2<f64>,
    pub(crate) turn: f64,
    pub(crate) score: f64,
}

/// How many peaks are looked at closely.
const MOST: usize = 8;
/// How many poses are sorted to find them.
const MOST_SORTED: usize = 4096;
/// Poses that score less than this share of the best are no rivals.
const WORTH_A_LOOK: f64 = 0.5;

/// The best poses of the volume, each a separation away from all better ones.
pub(crate) fn of(volume: &Volume, options: &AlignOptions) -> Vec<Peak> {
    let best = volume.scored().map(|scored| scored.0).fold(0.0, f64::max);
    let mut order: Vec<(f64, u32)> = volume.scored().filter(|scored| scored.0 >= WORTH_A_LOOK * best).collect();
    let falling = |a: &(f64, u32), b: &(f64, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if order.len() > MOST_SORTED {
        order.select_nth_unstable_by(MOST_SORTED, falling);
        order.truncate(MOST_SORTED);
    }
    order.sort_unstable_by(falling);
    let mut peaks: Vec<Peak> = Vec::new();
    for (_, index) in order {
        let peak = volume.peak(index);
        let apart = |other: &Peak| {
            let turned = (peak.turn - other.turn).abs();
            (peak.offset - other.offset).norm() >= options.peak_separation
                || turned.min(std::f64::consts::TAU - turned) > PEAK_TURN
        };
        if peaks.iter().all(apart) {
            peaks.push(peak);
        }
        if peaks.len() == MOST {
            break;
        }
    }
    peaks
}

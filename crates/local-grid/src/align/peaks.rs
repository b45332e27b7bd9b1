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

/// The best poses of the volume, each a separation away from all better ones.
pub(crate) fn of(volume: &Volume, options: &AlignOptions) -> Vec<Peak> {
    let mut order: Vec<u32> = volume.scored().collect();
    let enough = order.len().min(4096);
    if enough < order.len() {
        order.select_nth_unstable_by(enough, |&a, &b| volume.rank(b).total_cmp(&volume.rank(a)).then(a.cmp(&b)));
        order.truncate(enough);
    }
    order.sort_by(|&a, &b| volume.rank(b).total_cmp(&volume.rank(a)).then(a.cmp(&b)));
    let mut peaks: Vec<Peak> = Vec::new();
    for index in order {
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

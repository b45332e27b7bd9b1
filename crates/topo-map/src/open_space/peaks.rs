use local_grid::{Cell, Grid, Heading};

use super::{FeatureOptions, OpenSpace};
use crate::RangeRose;

/// How openings are picked from the network's answers all around.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct PeakOptions {
    /// A direction counts from this smoothed answer on, in `[0, 1]`.
    pub threshold: f32,
    /// Openings lie at least so many radians apart.
    pub separation: f64,
}

impl Default for PeakOptions {
    fn default() -> Self {
        Self { threshold: 0.5, separation: 45_f64.to_radians() }
    }
}

/// A direction in which the way looks open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// The direction, in the map frame.
    pub toward: Heading,
    /// The network's answer, smoothed, in `[0, 1]`.
    pub confidence: f64,
}

impl OpenSpace {
    /// The openings around a place, surest first: the network's answers in all 48 directions, smoothed by
    /// `[1, 2, 1] / 4`, and of those their local maxima, each taking its surroundings out of the running.
    #[must_use]
    pub fn openings<C: Cell>(
        &self,
        rose: &RangeRose,
        grid: &Grid<C>,
        features: &FeatureOptions,
        options: &PeakOptions,
    ) -> Vec<Opening> {
        const N: usize = RangeRose::DIRECTIONS;
        let raw: [f32; N] = std::array::from_fn(|bin| self.openness(&features.of(rose, grid, bin)));
        let smooth: [f32; N] = std::array::from_fn(|bin| {
            let (before, after) = (raw[(bin + N - 1) % N], raw[(bin + 1) % N]);
            0.25 * before + 0.5 * raw[bin] + 0.25 * after
        });
        let mut bins: Vec<usize> = (0..N).filter(|&bin| is_peak(&smooth, bin, options.threshold)).collect();
        bins.sort_by(|&a, &b| smooth[b].total_cmp(&smooth[a]).then(a.cmp(&b)));
        let mut openings: Vec<Opening> = Vec::new();
        for bin in bins {
            let toward = RangeRose::heading(bin);
            if openings.iter().all(|other| (other.toward - toward).abs() >= options.separation - 1e-9) {
                openings.push(Opening { toward, confidence: f64::from(smooth[bin]) });
            }
        }
        openings
    }
}

/// Whether no neighbour is higher; on a plateau every direction counts, and separation thins them out.
fn is_peak(smooth: &[f32; RangeRose::DIRECTIONS], bin: usize, threshold: f32) -> bool {
    let n = smooth.len();
    let (before, here, after) = (smooth[(bin + n - 1) % n], smooth[bin], smooth[(bin + 1) % n]);
    here > threshold && here >= before && here >= after
}

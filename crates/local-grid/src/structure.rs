//! The directions in which a building's walls run: a compass of its own, modulo a right angle.

mod compass;
mod runs;
mod segments;

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::{Echo, Heading};
use segments::segments;

pub use compass::{Learnt, WallCompass, WallCompassOptions};
pub use runs::{FollowedWall, WallEcho, WallRun, WallRunOptions, WallRuns};

/// How directions are gathered, and when walls are believed to carry a heading.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct StructureOptions {
    /// Half the width of a direction's peak, in radians.
    pub peak: f64,
    /// The least share of all surface that must run within the peak; a round room shows a ninth, clutter up to two fifths.
    pub least_share: f64,
    /// The least total length of surface, in metres.
    pub least_length: f64,
}

impl Default for StructureOptions {
    fn default() -> Self {
        Self { peak: 5f64.to_radians(), least_share: 0.5, least_length: 3.0 }
    }
}

/// The dominant direction of walls, modulo 90°, and how far it carries.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WallDirection {
    /// Radians from `+x` of the frame in which the walls were given, in `[0, π/2)`.
    pub direction: f64,
    /// The share of all surface that runs in this direction or square to it, in `[0, 1]`.
    pub share: f64,
    /// Standard deviation of the direction in radians.
    pub sigma: f64,
    /// Length of all surface that was seen, in metres.
    pub length: f64,
}

impl WallDirection {
    /// The turn in radians, in `(−π/4, π/4]`, that would bring these walls in line with walls of direction `reference`.
    #[must_use]
    pub fn turn_to(&self, reference: f64) -> f64 {
        let quarter_turns = Heading::from_radians(4.0 * (reference - self.direction));
        0.25 * quarter_turns.radians()
    }
}

/// The wall direction that the echoes of one scan show, in the robot's frame.
///
/// `None` where the walls carry no heading: too few, or in all directions.
#[must_use]
pub fn wall_direction_of_echoes(echoes: &[Echo], options: &StructureOptions) -> Option<WallDirection> {
    let mut angles = AngleHistogram::default();
    for (echo, next) in echoes.iter().zip(echoes.iter().skip(1)) {
        // Each echo stands for the surface up to the next one, unless there is a gap between them.
        let step = (next.point - echo.point).norm();
        if let (Some(normal), true) = (echo.normal, step < MOST_PER_ECHO) {
            angles.add(normal.y.atan2(normal.x), step);
        }
    }
    angles.dominant(options)
}

/// The least total length of straight walls, in metres, from which a direction is taken.
const LEAST_WALLS: f64 = 1.5;

/// The direction of the long straight walls of one scan alone: it shows among chairs and people, and to a noisy scanner,
/// where [`wall_direction_of_echoes`] is silent; but a single wall at an odd angle counts for the building.
#[must_use]
pub fn wall_direction_of_segments(echoes: &[Echo], options: &StructureOptions) -> Option<WallDirection> {
    let mut angles = AngleHistogram::default();
    for segment in segments(echoes) {
        angles.add(segment.direction, segment.length);
    }
    angles.dominant(&StructureOptions { least_length: LEAST_WALLS, ..options.clone() })
}

/// The longest surface that one echo may stand for, in metres.
const MOST_PER_ECHO: f64 = 0.5;

/// Directions modulo 90°, weighted by length.
#[derive(Debug, Clone, Default)]
struct AngleHistogram {
    /// `(direction in [0, π/2), length)`.
    entries: Vec<(f64, f64)>,
}

/// How true walls are, in radians.
const STRAIGHTNESS: f64 = 0.006;
/// Bins of one degree.
const BINS: usize = 90;

impl AngleHistogram {
    fn add(&mut self, angle: f64, length: f64) {
        self.entries.push((angle.rem_euclid(FRAC_PI_2), length));
    }

    fn dominant(&self, options: &StructureOptions) -> Option<WallDirection> {
        let length: f64 = self.entries.iter().map(|entry| entry.1).sum();
        if length < options.least_length {
            return None;
        }
        let mut direction = self.highest_bin(options.peak);
        let (mut within, mut square) = (0.0, 0.0);
        for _ in 0..3 {
            let mut sum = 0.0;
            (within, square) = (0.0, 0.0);
            for &(angle, weight) in &self.entries {
                let off = difference(angle, direction);
                if off.abs() <= options.peak {
                    sum += weight * off;
                    square += weight * off * off;
                    within += weight;
                }
            }
            if within <= 0.0 {
                return None;
            }
            direction = (direction + sum / within).rem_euclid(FRAC_PI_2);
        }
        let share = within / length;
        // Neighbouring echoes see the same wall: about one independent measurement per metre of it,
        // and no wall is straighter than a third of a degree.
        let sigma = (square / within / within.max(1.0) + STRAIGHTNESS * STRAIGHTNESS).sqrt();
        (share >= options.least_share).then_some(WallDirection { direction, share, sigma, length })
    }

    /// The middle of the window of `±peak` that holds most length.
    #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "90 bins")]
    fn highest_bin(&self, peak: f64) -> f64 {
        let width = FRAC_PI_2 / BINS as f64;
        let mut bins = [0.0; BINS];
        for &(angle, weight) in &self.entries {
            bins[((angle / width) as usize).min(BINS - 1)] += weight;
        }
        let reach = ((peak / width).round() as usize).clamp(1, BINS / 2 - 1);
        let held = |bin: usize| (0..=2 * reach).map(|k| bins[(bin + BINS + k - reach) % BINS]).sum::<f64>();
        let best = (0..BINS).max_by(|&a, &b| held(a).total_cmp(&held(b)).then(b.cmp(&a))).unwrap_or(0);
        (best as f64 + 0.5) * width
    }
}

/// The difference of two directions modulo 90°, in `(−π/4, π/4]`.
fn difference(a: f64, b: f64) -> f64 {
    let turns = (a - b) / FRAC_PI_2;
    (turns - turns.round()) * (TAU / 4.0)
}

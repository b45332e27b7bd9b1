use local_grid::{Cell, Grid, Heading};

use super::{FeatureOptions, OpenSpace};
use crate::RangeRose;

/// How openings are picked from the network's answers all around.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct PeakOptions {
    /// A direction counts as open from this smoothed answer on, in `[0, 1]`.
    pub threshold: f32,
    /// An open arc holds one opening per so many radians, at least one.
    pub spread: f64,
}

impl Default for PeakOptions {
    /// Rather low a threshold: a false place costs one short trip, a missed door a room. And so wide a spread that a corridor,
    /// open over some 100° each way, is one opening ahead and one behind.
    fn default() -> Self {
        Self { threshold: 0.2, spread: 97_f64.to_radians() }
    }
}

/// A direction in which the way looks open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// The direction, in the map frame.
    pub toward: Heading,
    /// The network's answer, smoothed, in `[0, 1]`.
    pub confidence: f64,
    /// Whether this is the middle of an open arc or of an even part of it; the other open directions come after.
    pub central: Central,
}

/// Whether an opening is the middle of something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Central {
    /// It is: the best way into that part.
    Middle,
    /// It is just one more open direction, worth trying where nothing else leads.
    Beside,
}

impl OpenSpace {
    /// The openings around a place: the middles first, each kind with the surest first.
    ///
    /// The network's answers in all 48 directions are smoothed by `[1, 2, 1] / 4`. Neighbouring directions that are open
    /// form an arc; a narrow arc, as a door makes it, is one opening in its middle, a wide one is divided evenly. The
    /// highest answer would be no good choice: where space is open the answers are all close to one, and the highest of
    /// them leans to some wall.
    #[must_use]
    pub fn openings<C: Cell>(
        &self,
        rose: &RangeRose,
        grid: &Grid<C>,
        features: &FeatureOptions,
        options: &PeakOptions,
    ) -> Vec<Opening> {
        let raw: [f32; N] = std::array::from_fn(|bin| self.openness(&features.of(rose, grid, bin)));
        let smooth: [f32; N] = std::array::from_fn(|bin| {
            let (before, after) = (raw[(bin + N - 1) % N], raw[(bin + 1) % N]);
            0.25 * before + 0.5 * raw[bin] + 0.25 * after
        });
        let open = smooth.map(|answer| answer > options.threshold);
        let surest_first = |toward: &mut dyn Iterator<Item = Heading>, central: Central| {
            let confidence = |toward| f64::from(smooth[RangeRose::bin_of(toward)]);
            let mut openings: Vec<Opening> =
                toward.map(|toward| Opening { toward, confidence: confidence(toward), central }).collect();
            openings.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
            openings
        };
        let arcs = arcs(&open);
        let mut middles =
            arcs.iter().flat_map(|&(first, length)| divided(first, length, options.spread)).map(Heading::from_radians);
        let mut others = (0..N).filter(|&bin| open[bin]).map(RangeRose::heading);
        let mut openings = surest_first(&mut middles, Central::Middle);
        openings.extend(surest_first(&mut others, Central::Beside));
        openings
    }
}

const N: usize = RangeRose::DIRECTIONS;

/// The arcs of open directions on the circle: where each begins, and how many directions it has.
fn arcs(open: &[bool; N]) -> Vec<(usize, usize)> {
    let Some(closed) = open.iter().position(|open| !open) else { return vec![(0, N)] };
    let mut arcs: Vec<(usize, usize)> = Vec::new();
    let mut inside = false;
    for bin in (1..=N).map(|step| (closed + step) % N) {
        match (open[bin], inside, arcs.last_mut()) {
            (true, true, Some((_, length))) => *length += 1,
            (true, ..) => arcs.push((bin, 1)),
            (false, ..) => {}
        }
        inside = open[bin];
    }
    arcs
}

/// Directions in radians that divide an arc evenly, each in the middle of its part.
fn divided(first: usize, length: usize, spread: f64) -> impl Iterator<Item = f64> {
    let bin = std::f64::consts::TAU / as_f64(N);
    let width = as_f64(length) * bin;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few per circle")]
    let parts = ((width / spread.max(bin)).round() as usize).max(1);
    let begin = (as_f64(first) - 0.5) * bin;
    (0..parts).map(move |part| begin + width * (as_f64(part) + 0.5) / as_f64(parts))
}

#[expect(clippy::cast_precision_loss, reason = "at most 48")]
fn as_f64(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_go_round_the_seam() {
        let mut open = [false; N];
        for bin in [46, 47, 0, 1, 10, 11] {
            open[bin] = true;
        }
        assert_eq!(arcs(&open), [(10, 2), (46, 4)]);
        assert_eq!(arcs(&[true; N]), [(0, N)]);
        assert_eq!(arcs(&[false; N]), []);
    }

    #[test]
    fn a_door_is_one_opening_in_its_middle_and_a_hall_is_divided() {
        let spread = PeakOptions::default().spread;
        let door: Vec<f64> = divided(10, 3, spread).collect();
        approx::assert_relative_eq!(door[0], RangeRose::heading(11).radians(), epsilon = 1e-12);
        assert_eq!(door.len(), 1);
        let hall: Vec<f64> = divided(0, N, spread).collect();
        assert_eq!(hall.len(), 4);
        approx::assert_relative_eq!(hall[1] - hall[0], 90_f64.to_radians(), epsilon = 1e-12); // the even part nearest to the spread
    }
}

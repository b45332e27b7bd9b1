//! Headings from turns: the step before positions when no compass tells them.
//!
//! Each link says by how much its two places' headings differ. Two ways to the headings that agree best, both one sparse linear solution:
//! * [`HeadingMethod::Linear`]: the angles themselves, after whole turns have been rounded away around every cycle
//!   (Carlone, Aragues, Castellanos & Bona 2012/2014). Right as long as the noise gathered around a cycle stays below half a turn.
//! * [`HeadingMethod::Chordal`]: the direction vectors `(cos φ, sin φ)`, with no rounding at all; the better one when noise is heavy.
//!
//! With the headings known, positions are the linear problem of a [`Network`](crate::Network).

mod chordal;
mod linear;
mod tree;

pub(crate) use chordal::chordal;
pub(crate) use linear::linear;
pub(crate) use tree::{Forest, Joint};

use crate::unknowns::Unknowns;

/// A measured difference of two headings: `φ_to − φ_from = angle`, up to whole turns.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Turn {
    /// The node turned from.
    pub from: usize,
    /// The node turned to.
    pub to: usize,
    /// Radians, counter-clockwise; any number of turns.
    pub angle: f64,
    /// Variance of the angle, rad².
    pub variance: f64,
}

/// A compass reading: the heading of one node, absolute.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Compass {
    /// The node where it was read.
    pub node: usize,
    /// Radians counter-clockwise from `+x`.
    pub heading: f64,
    /// Variance of the reading, rad².
    pub variance: f64,
}

/// How headings are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum HeadingMethod {
    /// Least squares on angles after rounding whole turns away.
    Linear,
    /// Least squares on direction vectors.
    #[default]
    Chordal,
}

/// Headings, and how well the turns around each node agree.
#[derive(Debug, Clone, PartialEq)]
pub struct Headings {
    /// Radians in `[-π, π]`, one for each node.
    pub headings: Vec<f64>,
    /// Length of the mean direction vector of each node: 1 where all turns agree, less where they do not. Always 1 with [`HeadingMethod::Linear`].
    pub agreement: Vec<f64>,
}

/// Why headings could not be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HeadingError {
    /// A turn or a reading names a node that does not exist.
    #[error("{what} {index}: node {node} does not exist, there are {nodes} nodes (numbered from 0)")]
    NodeOutOfRange {
        /// `turn` or `compass reading`.
        what: &'static str,
        /// Its number.
        index: usize,
        /// The node it names.
        node: usize,
        /// How many nodes there are.
        nodes: usize,
    },
    /// An angle is NaN or infinite.
    #[error("{what} {index}: angle must be a finite number, got {angle}")]
    AngleNotFinite {
        /// `turn` or `compass reading`.
        what: &'static str,
        /// Its number.
        index: usize,
        /// The angle.
        angle: f64,
    },
    /// A variance is zero, negative, NaN or infinite.
    #[error("{what} {index}: variance must be positive and finite, got {variance}")]
    VarianceNotPositive {
        /// `turn` or `compass reading`.
        what: &'static str,
        /// Its number.
        index: usize,
        /// The variance.
        variance: f64,
    },
    /// The variances span more orders of magnitude than 64-bit numbers can hold together.
    #[error("the variances are too far apart to be solved together (seen at node {node})")]
    TooFarApart {
        /// Where it was seen.
        node: usize,
    },
    /// More nodes or turns than 32-bit indices can tell apart.
    #[error("{nodes} nodes and {turns} turns are too many, at most 2^32 - 2 of each")]
    TooMany {
        /// How many nodes there are.
        nodes: usize,
        /// How many turns there are.
        turns: usize,
    },
}

/// The headings that agree best with `turns` between the nodes `0..nodes` and with the `compass` readings.
///
/// ```text
/// Linear:   min Σ (φ_j − φ_i − δ_ij + 2π k_ij)² / s_ij² + Σ (φ_i − c_i + 2π k_i)² / s_i²     k from a spanning tree
/// Chordal:  min Σ |z_j − R(δ_ij) z_i|² / s_ij² + Σ |z_i − (cos c_i, sin c_i)|² / s_i²         φ_i = atan2(z_i)
/// ```
///
/// A connected component without any compass reading has its lowest-numbered node at heading 0.
///
/// # Errors
/// A turn or reading that names a missing node, is not finite, or has no positive variance.
///
/// ```
/// use relaxation::{Compass, HeadingMethod, Turn, headings};
///
/// let turn = |from, to, degrees: f64| Turn { from, to, angle: degrees.to_radians(), variance: 1.0 };
/// // A square driven around, its last corner measured 20° too wide.
/// let turns = [turn(0, 1, 90.0), turn(1, 2, 90.0), turn(2, 3, 90.0), turn(3, 0, 110.0)];
/// let linear = headings(4, &turns, &[], HeadingMethod::Linear)?;
/// assert!((linear.headings[1].to_degrees() - 85.0).abs() < 1e-9);
/// # Ok::<(), relaxation::HeadingError>(())
/// ```
pub fn headings(
    nodes: usize,
    turns: &[Turn],
    compass: &[Compass],
    method: HeadingMethod,
) -> Result<Headings, HeadingError> {
    check(nodes, turns, compass)?;
    let joints: Vec<Joint> = turns.iter().map(|turn| Joint::new(turn.from, turn.to)).collect();
    let forest = Forest::breadth_first(nodes, &joints);
    let mut held = vec![None; nodes];
    let mut has_compass = vec![false; nodes];
    for reading in compass {
        has_compass[forest.root_of(reading.node)] = true;
    }
    for root in forest.roots().filter(|root| !has_compass[*root]) {
        held[root] = Some(0.0);
    }
    let unknowns = Unknowns::new(nodes, |node| held[node].is_some(), turns.iter().map(|turn| (turn.from, turn.to)));
    match method {
        HeadingMethod::Linear => linear(&unknowns, turns, compass, &held, &forest),
        HeadingMethod::Chordal => chordal(&unknowns, turns, compass, &held),
    }
}

fn check(nodes: usize, turns: &[Turn], compass: &[Compass]) -> Result<(), HeadingError> {
    if nodes >= u32::MAX as usize || turns.len() >= u32::MAX as usize {
        return Err(HeadingError::TooMany { nodes, turns: turns.len() });
    }
    for (index, turn) in turns.iter().enumerate() {
        check_one("turn", index, &[turn.from, turn.to], nodes, turn.angle, turn.variance)?;
    }
    for (index, reading) in compass.iter().enumerate() {
        check_one("compass reading", index, &[reading.node], nodes, reading.heading, reading.variance)?;
    }
    Ok(())
}

fn check_one(
    what: &'static str,
    index: usize,
    named: &[usize],
    nodes: usize,
    angle: f64,
    variance: f64,
) -> Result<(), HeadingError> {
    if let Some(&node) = named.iter().find(|node| **node >= nodes) {
        return Err(HeadingError::NodeOutOfRange { what, index, node, nodes });
    }
    if !angle.is_finite() {
        return Err(HeadingError::AngleNotFinite { what, index, angle });
    }
    if !(variance > 0.0 && variance.is_finite() && (1.0 / variance).is_finite()) {
        return Err(HeadingError::VarianceNotPositive { what, index, variance });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::wrap;
    use approx::assert_relative_eq;
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    fn turn(from: usize, to: usize, degrees: f64) -> Turn {
        Turn { from, to, angle: degrees.to_radians(), variance: 1.0 }
    }

    fn square(last: f64) -> [Turn; 4] {
        [turn(0, 1, 90.0), turn(1, 2, 90.0), turn(2, 3, 90.0), turn(3, 0, last)]
    }

    fn degrees(headings: &Headings) -> Vec<f64> {
        headings.headings.iter().map(|h| h.to_degrees().rem_euclid(360.0)).collect()
    }

    #[test]
    fn four_right_angles_close_without_any_residual() {
        for method in [HeadingMethod::Linear, HeadingMethod::Chordal] {
            let result = headings(4, &square(90.0), &[], method).unwrap();
            for (got, expected) in degrees(&result).into_iter().zip([0.0, 90.0, 180.0, 270.0]) {
                assert_relative_eq!(got, expected, epsilon = 1e-9);
            }
        }
    }

    #[test]
    fn a_corner_of_110_degrees_is_shared_by_all_corners() {
        let linear = headings(4, &square(110.0), &[], HeadingMethod::Linear).unwrap();
        for (got, expected) in degrees(&linear).into_iter().zip([0.0, 85.0, 170.0, 255.0]) {
            assert_relative_eq!(got, expected, epsilon = 1e-9);
        }
        let chordal = headings(4, &square(110.0), &[], HeadingMethod::Chordal).unwrap();
        for (got, expected) in degrees(&chordal).into_iter().zip([0.0, 85.04, 170.00, 254.96]) {
            assert_relative_eq!(got, expected, epsilon = 5e-3);
        }
        for (got, expected) in chordal.agreement.iter().zip([1.0, 0.9886, 0.9848, 0.9886]) {
            assert_relative_eq!(*got, expected, epsilon = 5e-5);
        }
    }

    #[test]
    fn a_compass_turns_the_whole_component_and_needs_no_anchor() {
        let readings: Vec<Compass> = (0..4)
            .map(|node| Compass { node, heading: 3.0 + node as f64 * 90f64.to_radians(), variance: 0.01 })
            .collect();
        for method in [HeadingMethod::Linear, HeadingMethod::Chordal] {
            let result = headings(5, &square(90.0), &readings, method).unwrap();
            for (heading, reading) in result.headings.iter().zip(&readings) {
                assert_relative_eq!(wrap(heading - reading.heading), 0.0, epsilon = 1e-9);
            }
            assert_eq!(result.headings[4], 0.0);
        }
    }

    #[test]
    fn both_methods_agree_under_light_noise_and_renumbering_changes_nothing() {
        let mut random = Pcg64Mcg::new(5);
        let nodes = 60;
        let truth: Vec<f64> = (0..nodes).map(|_| random.random_range(-3.0..3.0)).collect();
        let mut turns = Vec::new();
        for k in 0..150 {
            let (from, to) =
                if k < nodes - 1 { (k, k + 1) } else { (random.random_range(0..nodes), random.random_range(0..nodes)) };
            turns.push(Turn {
                from,
                to,
                angle: truth[to] - truth[from] + random.random_range(-0.01..0.01),
                variance: 1e-4,
            });
        }
        let linear = headings(nodes, &turns, &[], HeadingMethod::Linear).unwrap();
        let chordal = headings(nodes, &turns, &[], HeadingMethod::Chordal).unwrap();
        let flipped: Vec<Turn> =
            turns.iter().rev().map(|t| Turn { from: t.to, to: t.from, angle: -t.angle, ..*t }).collect();
        let other = headings(nodes, &flipped, &[], HeadingMethod::Linear).unwrap();
        for node in 0..nodes {
            assert_relative_eq!(wrap(linear.headings[node] - chordal.headings[node]), 0.0, epsilon = 1e-3);
            assert_relative_eq!(wrap(linear.headings[node] - other.headings[node]), 0.0, epsilon = 1e-9);
        }
    }

    #[test]
    fn wrong_input_is_told_apart() {
        let err = |turn: Turn| headings(2, &[turn], &[], HeadingMethod::Linear).unwrap_err().to_string();
        assert_eq!(err(turn(0, 2, 0.0)), "turn 0: node 2 does not exist, there are 2 nodes (numbered from 0)");
        assert_eq!(err(turn(0, 1, f64::NAN)), "turn 0: angle must be a finite number, got NaN");
        assert_eq!(
            err(Turn { variance: 0.0, ..turn(0, 1, 1.0) }),
            "turn 0: variance must be positive and finite, got 0"
        );
        assert!(headings(0, &[], &[], HeadingMethod::Chordal).unwrap().headings.is_empty());
    }
}

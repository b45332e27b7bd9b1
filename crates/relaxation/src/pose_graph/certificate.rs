//! What can be said for sure about poses: what holds the graph together, what strains it.

use nalgebra::Vector3;

use super::PoseGraph;
use crate::bridges::are_bridges;
use crate::pose::Pose;

/// What is known of some poses of a graph, whoever computed them.
///
/// How much one more step could lower χ² is said by [`RelaxedPoses::gap`](super::RelaxedPoses::gap); that no other minimum is
/// lower cannot be proven here, for the cost has many.
///
/// ```
/// use relaxation::{certify_poses, nalgebra::Matrix3, Pose, PoseGraph, PoseSpring};
///
/// let spring = |from, to, x| PoseSpring { from, to, from_to: Pose::new(x, 0.0, 0.0), information: Matrix3::identity() };
/// // Two measurements of the same metre, and a place that nothing checks.
/// let graph = PoseGraph::new(3, &[spring(0, 1, 1.0), spring(0, 1, 1.2), spring(1, 2, 1.0)])?;
/// let poses = [Pose::default(), Pose::new(1.1, 0.0, 0.0), Pose::new(2.1, 0.0, 0.0)];
/// let certificate = certify_poses(&graph, &poses, 1);
/// assert_eq!(certificate.bridges, [2]);
/// assert_eq!(certificate.degrees_of_freedom, 3);
/// assert!((certificate.strained[0].sigmas - 0.1).abs() < 1e-12);
/// # Ok::<(), relaxation::PoseGraphError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PoseCertificate {
    /// g2o's χ².
    pub chi2: f64,
    /// How many parts without a spring between them there are.
    pub components: usize,
    /// The springs that are part of no loop, ascending: nothing checks what they measured.
    pub bridges: Vec<usize>,
    /// Measured numbers less free ones: what χ² comes to, about, when the information matrices are right. Springs of weight
    /// zero measure nothing.
    pub degrees_of_freedom: i64,
    /// The springs with the largest errors, the worst first.
    pub strained: Vec<PoseStrain>,
}

/// How far a pose spring is from what it measured.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PoseStrain {
    /// The spring.
    pub spring: usize,
    /// `z⁻¹ (x_from⁻¹ x_to)`: metres, metres, radians, as seen from the measured pose.
    pub error: Vector3<f64>,
    /// Its length in standard deviations of the spring (Mahalanobis distance, weight included).
    pub sigmas: f64,
}

/// Looks at `poses` and names the `strained` springs with the largest errors.
///
/// # Panics
/// When there are fewer poses than nodes.
#[must_use]
pub fn certify_poses(graph: &PoseGraph, poses: &[Pose], strained: usize) -> PoseCertificate {
    let counts = |index: usize| graph.weights()[index] > 0.0;
    let ends = graph.springs().iter().enumerate();
    let ends: Vec<_> = ends.map(|(index, s)| (s.from, if counts(index) { s.to } else { s.from })).collect();
    let bridge = are_bridges(graph.len(), &ends);
    let number = |count: usize| i64::try_from(count).unwrap_or(i64::MAX);
    let free = (0..graph.len()).filter(|&node| graph.held(node).is_none()).count();
    let measured = (0..ends.len()).filter(|&index| counts(index)).count();
    PoseCertificate {
        chi2: graph.chi2(poses),
        components: graph.components(),
        bridges: (0..bridge.len()).filter(|&spring| bridge[spring]).collect(),
        degrees_of_freedom: 3 * (number(measured) - number(free)),
        strained: worst(graph, poses, strained),
    }
}

/// The springs with the largest errors in standard deviations, the worst first.
fn worst(graph: &PoseGraph, poses: &[Pose], count: usize) -> Vec<PoseStrain> {
    let springs = graph.springs().iter().zip(graph.weights()).enumerate();
    let mut all: Vec<PoseStrain> = springs
        .map(|(spring, (s, weight))| {
            let (from, to) = (poses[s.from], poses[s.to]);
            PoseStrain { spring, error: s.error(from, to), sigmas: (weight * s.chi2(from, to)).sqrt() }
        })
        .collect();
    let worse = |a: &PoseStrain, b: &PoseStrain| b.sigmas.total_cmp(&a.sigmas).then(a.spring.cmp(&b.spring));
    if count < all.len() {
        all.select_nth_unstable_by(count, worse);
        all.truncate(count);
    }
    all.sort_unstable_by(worse);
    all
}

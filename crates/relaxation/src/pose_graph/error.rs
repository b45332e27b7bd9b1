//! What can be wrong with a pose graph.

use super::PoseSpring;

/// Why springs do not make a pose graph.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseGraphError {
    /// A spring names a node that does not exist.
    #[error("spring {spring}: node {node} does not exist, there are {nodes} nodes (numbered from 0)")]
    NodeOutOfRange {
        /// The spring's number.
        spring: usize,
        /// The node it names.
        node: usize,
        /// How many nodes there are.
        nodes: usize,
    },
    /// A measured pose is NaN or infinite.
    #[error("spring {spring}: the measured pose must be finite, got ({x}, {y}, {heading})")]
    PoseNotFinite {
        /// The spring's number.
        spring: usize,
        /// Metres.
        x: f64,
        /// Metres.
        y: f64,
        /// Radians.
        heading: f64,
    },
    /// An information matrix is not symmetric, not positive definite or not finite.
    #[error("spring {spring}: the information matrix must be symmetric and positive definite, got rows {rows:?}")]
    InformationNotPositiveDefinite {
        /// The spring's number.
        spring: usize,
        /// The matrix as it was given.
        rows: [[f64; 3]; 3],
    },
    /// A node to be held does not exist.
    #[error("held node {node} does not exist, there are {nodes} nodes (numbered from 0)")]
    HeldNodeOutOfRange {
        /// The node.
        node: usize,
        /// How many nodes there are.
        nodes: usize,
    },
    /// The pose a node is to be held at is NaN or infinite.
    #[error("held node {node}: its pose must be finite")]
    HeldPoseNotFinite {
        /// The node.
        node: usize,
    },
    /// Not one weight for each spring.
    #[error("{weights} weights for {springs} springs")]
    WeightCount {
        /// How many weights there are.
        weights: usize,
        /// How many springs there are.
        springs: usize,
    },
    /// A weight is negative, NaN or infinite.
    #[error("spring {spring}: weight must be finite and not negative, got {weight}")]
    WeightNegative {
        /// The spring's number.
        spring: usize,
        /// Its weight.
        weight: f64,
    },
    /// Not one start pose for each node, or one that is not finite.
    #[error("start: expected {nodes} finite poses, got {poses} (first that is wrong: {first_wrong})")]
    StartWrong {
        /// How many nodes there are.
        nodes: usize,
        /// How many poses there are.
        poses: usize,
        /// The first one missing or not finite.
        first_wrong: usize,
    },
    /// The information matrices span more orders of magnitude than 64-bit numbers can hold together.
    #[error("the information matrices are too far apart to be solved together (seen at node {node})")]
    TooFarApart {
        /// Where it was seen.
        node: usize,
    },
    /// More nodes or springs than 32-bit indices can tell apart.
    #[error("{nodes} nodes and {springs} springs are too many, at most 2^32 - 2 of each")]
    TooMany {
        /// How many nodes there are.
        nodes: usize,
        /// How many springs there are.
        springs: usize,
    },
}

pub(super) fn check(index: usize, spring: &PoseSpring, nodes: usize) -> Result<(), PoseGraphError> {
    if let Some(node) = [spring.from, spring.to].into_iter().find(|node| *node >= nodes) {
        return Err(PoseGraphError::NodeOutOfRange { spring: index, node, nodes });
    }
    let z = spring.from_to;
    if !z.is_finite() {
        return Err(PoseGraphError::PoseNotFinite { spring: index, x: z.x, y: z.y, heading: z.heading });
    }
    let i = &spring.information;
    let symmetric = i.m12 == i.m21 && i.m13 == i.m31 && i.m23 == i.m32;
    if !(symmetric && is_positive_definite(i)) {
        let rows = [[i.m11, i.m12, i.m13], [i.m21, i.m22, i.m23], [i.m31, i.m32, i.m33]];
        return Err(PoseGraphError::InformationNotPositiveDefinite { spring: index, rows });
    }
    Ok(())
}

/// By the pivots of its Cholesky factor, each of which must keep some digits of what it started from.
pub(crate) fn is_positive_definite(i: &nalgebra::Matrix3<f64>) -> bool {
    const DIGITS: f64 = 1e-13;
    let first = i.m11;
    let second = i.m22 - i.m12 * i.m12 / first;
    let third = i.m33 - i.m13 * i.m13 / first - (i.m23 - i.m12 * i.m13 / first).powi(2) / second;
    let keeps = |pivot: f64, of: f64| pivot > DIGITS * of && of.is_finite() && of > 0.0;
    keeps(first, i.m11) && keeps(second, i.m22) && keeps(third, i.m33)
}

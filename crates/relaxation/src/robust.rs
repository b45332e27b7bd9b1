//! Springs that may be false: kernels, graduated non-convexity, pairwise consistency.
//!
//! A recognised place may be the wrong one, and one false closure bends a whole map. So springs are of two kinds: *trusted* ones (travelled
//! links, odometry) and *suspects* (closures). Every suspect gets a weight in `[0, 1]` that multiplies its information;
//! trusted springs keep weight 1, and so do bridges: a spring on no cycle is contradicted by nothing, whatever it says.
//!
//! | method | weight of a spring with normalised squared residual `e²` |
//! |---|---|
//! | [`Kernel::Huber`] | `1` if `e ≤ δ`, else `δ / e` |
//! | [`Kernel::Cauchy`] | `1 / (1 + e²/δ²)` |
//! | [`Kernel::GemanMcClure`] | `(δ² / (δ² + e²))²` |
//! | [`Kernel::Dcs`] | `min(1, 2Φ / (Φ + e²))²` |
//! | [`RobustMethod::TruncatedLeastSquares`] | graduated from convex to `1` if `e² < c²`, else `0` |
//! | [`RobustMethod::GemanMcClure`] | graduated from convex to `(c² / (c² + e²))²` |
//!
//! The graduated methods need no good start when the problem is linear (positions), and begin at a set of mutually
//! consistent closures when it is not (poses). What none of these can see is a group of false springs that agree with each other and outnumber the true ones.

mod consistency;
mod graduate;
mod kernel;
mod network;
mod poses;

pub use consistency::consistent_closures;
pub use kernel::{Kernel, RobustMethod, RobustOptions};
pub use network::{RobustPositions, relax_robustly};
pub use poses::{RobustPoses, relax_poses_robustly, relax_poses_robustly_from};

use crate::bridges::are_bridges;
use crate::pose_graph::PoseGraphError;

/// Why robust relaxation is not possible.
///
/// The text is a fragment that fits after "could not relax robustly: ".
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RobustError {
    /// Not one flag for each spring.
    #[error("{flags} flags of trust for {springs} springs")]
    TrustCount {
        /// How many flags there are.
        flags: usize,
        /// How many springs there are.
        springs: usize,
    },
    /// A kernel's scale or an inlier bound is zero, negative, NaN or infinite.
    #[error("the scale of a robust method must be positive and finite, got {scale}")]
    ScaleNotPositive {
        /// The scale.
        scale: f64,
    },
    /// The pose graph cannot be solved.
    #[error(transparent)]
    PoseGraph(#[from] PoseGraphError),
    /// Stiffnesses span more orders of magnitude than 64-bit numbers can hold together.
    #[error("the stiffnesses of the springs are too far apart to be solved together (seen at node {node})")]
    TooFarApart {
        /// Where it was seen.
        node: usize,
    },
}

/// The suspects: springs that are neither trusted nor bridges nor loops of one node.
fn suspects(nodes: usize, ends: &[(usize, usize)], trusted: &[bool]) -> Result<Vec<usize>, RobustError> {
    if trusted.len() != ends.len() {
        return Err(RobustError::TrustCount { flags: trusted.len(), springs: ends.len() });
    }
    let bridge = are_bridges(nodes, ends);
    Ok((0..ends.len()).filter(|&k| !trusted[k] && !bridge[k] && ends[k].0 != ends[k].1).collect())
}

//! How sure a pose graph is of its poses.

use nalgebra::Matrix3;

use super::descend::system;
use super::{PoseGraph, PoseGraphError};
use crate::pose::Pose;

/// The covariance of each pose `(x, y, heading)` in the map frame relative to the held nodes: m², m·rad, rad². Held nodes have zero.
///
/// Exact for the cost linearised at `poses`, which should be its minimum: the diagonal blocks of `(JᵀIJ)⁻¹`, all of them for about the
/// price of three factorisations.
///
/// # Errors
/// Not one finite pose for each node, or information matrices too far apart.
pub fn pose_covariances(graph: &PoseGraph, poses: &[Pose]) -> Result<Vec<Matrix3<f64>>, PoseGraphError> {
    let nodes = graph.len();
    let wrong = |k: &usize| *k >= nodes || !poses.get(*k).is_some_and(|p| p.is_finite());
    if let Some(first_wrong) = (0..nodes.max(poses.len())).find(wrong) {
        return Err(PoseGraphError::StartWrong { nodes, poses: poses.len(), first_wrong });
    }
    let mut system = system(graph);
    let mut matrix = system.unknowns.matrix(3);
    let mut right = vec![0.0; 3 * system.unknowns.count()];
    system.linearize(poses, &mut matrix, &mut right);
    matrix.factorize().map_err(|error| PoseGraphError::TooFarApart { node: error.node })?;
    let blocks = matrix.inverse_blocks();
    let one = |node| match system.unknowns.of(node) {
        Some(unknown) => Matrix3::from_row_slice(&blocks[9 * unknown..9 * unknown + 9]),
        None => Matrix3::zeros(),
    };
    Ok((0..nodes).map(one).collect())
}

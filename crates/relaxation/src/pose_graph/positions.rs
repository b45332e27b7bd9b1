//! Positions when the headings are known: the paper's linear problem, with the springs' full information.

use super::linearize::System;
use super::{PoseGraph, PoseGraphError};
use crate::pose::Pose;

/// Gives `poses`, whose headings are taken as known, the positions of least χ²: one linear solution.
pub(super) fn place(graph: &PoseGraph, system: &System, poses: &mut [Pose]) -> Result<(), PoseGraphError> {
    let unknowns = &system.unknowns;
    let mut matrix = unknowns.matrix(2);
    let mut right = vec![0.0; 2 * unknowns.count()];
    for (edge, spring) in system.springs.iter().enumerate().filter(|(_, s)| s.from != s.to) {
        // Free nodes count from the origin, so that the error is what the solution has to make up for.
        let origin = |node: usize| Pose { heading: poses[node].heading, ..graph.held(node).unwrap_or_default() };
        let from = origin(spring.from);
        let at = spring.in_map(from, from.heading.sin_cos(), origin(spring.to));
        let [xx, xy, yy] = at.g;
        let [fx, fy, _] = at.force();
        for (node, sign) in [(spring.from, 1.0), (spring.to, -1.0)] {
            if let Some(k) = unknowns.of(node) {
                matrix.add(unknowns.diagonal(k), &[[xx, xy], [xy, yy]]);
                right[2 * k] += sign * fx;
                right[2 * k + 1] += sign * fy;
            }
        }
        if let Some(slot) = unknowns.pair(edge) {
            matrix.add(slot, &[[-xx, -xy], [-xy, -yy]]);
        }
    }
    matrix.factorize().map_err(|error| PoseGraphError::TooFarApart { node: error.node })?;
    matrix.solve(&mut right);
    for (node, pose) in poses.iter_mut().enumerate() {
        match (unknowns.of(node), graph.held(node)) {
            (Some(k), _) => (pose.x, pose.y) = (right[2 * k], right[2 * k + 1]),
            (None, held) => *pose = held.unwrap_or_default(),
        }
    }
    Ok(())
}

//! Where to descend from: two linear solutions that need no start themselves.

use super::linearize::System;
use super::{PoseGraph, PoseGraphError, positions};
use crate::headings::{HeadingError, Turn, chordal};
use crate::pose::Pose;

/// Headings as direction vectors first, then positions with these headings.
pub(super) fn chordal_start(graph: &PoseGraph, system: &System) -> Result<Vec<Pose>, PoseGraphError> {
    let turns: Vec<Turn> = system
        .springs
        .iter()
        .map(|spring| Turn {
            from: spring.from,
            to: spring.to,
            angle: spring.z.heading,
            variance: 1.0 / spring.turn_information(),
        })
        .collect();
    let held: Vec<Option<f64>> = graph.held.iter().map(|held| held.map(|pose| pose.heading)).collect();
    let headings = chordal(&system.unknowns, &turns, &[], &held).map_err(too_far_apart)?;
    let mut poses: Vec<Pose> = headings.headings.into_iter().map(|heading| Pose::new(0.0, 0.0, heading)).collect();
    positions::place(graph, system, &mut poses)?;
    Ok(poses)
}

fn too_far_apart(error: HeadingError) -> PoseGraphError {
    match error {
        HeadingError::TooFarApart { node } => PoseGraphError::TooFarApart { node },
        _ => unreachable!("the graph has been checked"),
    }
}

/// Headings and positions at once, as one linear problem: direction vectors and coordinates, without the condition that the vectors have length one.
pub(super) fn joint_start(graph: &PoseGraph, system: &System) -> Result<Vec<Pose>, PoseGraphError> {
    let unknowns = &system.unknowns;
    let mut matrix = unknowns.matrix(4);
    let mut right = vec![0.0; 4 * unknowns.count()];
    for (edge, spring) in system.springs.iter().enumerate().filter(|(_, s)| s.from != s.to) {
        let (n, w) = (spring.translation_information(), spring.turn_information());
        let (sin, cos) = spring.z.heading.sin_cos();
        let (x, y) = (spring.z.x, spring.z.y);
        // Errors: t_j − t_i − [c −s; s c] z and (c, s)_j − R (c, s)_i; rows of the Jacobian at i; at j it is the identity.
        let at_from = [[-1.0, 0.0, -x, y], [0.0, -1.0, -y, -x], [0.0, 0.0, -cos, sin], [0.0, 0.0, -sin, -cos]];
        let weights = [n, n, w, w];
        let square = |a: &[[f64; 4]; 4], b: &[[f64; 4]; 4]| -> [[f64; 4]; 4] {
            std::array::from_fn(|r| std::array::from_fn(|c| (0..4).map(|k| a[k][r] * weights[k] * b[k][c]).sum()))
        };
        let one: [[f64; 4]; 4] = std::array::from_fn(|r| std::array::from_fn(|c| if r == c { 1.0 } else { 0.0 }));
        let ends = [(spring.from, at_from), (spring.to, one)];
        for (node, jacobian) in &ends {
            if let Some(k) = unknowns.of(*node) {
                matrix.add(unknowns.diagonal(k), &square(jacobian, jacobian));
            }
        }
        if let Some(slot) = unknowns.pair(edge) {
            matrix.add(slot, &square(&at_from, &one));
        }
        for ((node, jacobian), (other, other_jacobian)) in [(ends[0], ends[1]), (ends[1], ends[0])] {
            let (Some(k), None) = (unknowns.of(node), unknowns.of(other)) else { continue };
            let held = graph.held(other).unwrap_or_default();
            let (sin, cos) = held.heading.sin_cos();
            let value = [held.x, held.y, cos, sin];
            let block = square(&jacobian, &other_jacobian);
            for r in 0..4 {
                right[4 * k + r] -= (0..4).map(|c| block[r][c] * value[c]).sum::<f64>();
            }
        }
    }
    matrix.factorize().map_err(|error| PoseGraphError::TooFarApart { node: error.node })?;
    matrix.solve(&mut right);
    let heading = |node: usize| match (unknowns.of(node), graph.held(node)) {
        (Some(k), _) => right[4 * k + 3].atan2(right[4 * k + 2]),
        (None, held) => held.unwrap_or_default().heading,
    };
    let mut poses: Vec<Pose> = (0..graph.len()).map(|node| Pose::new(0.0, 0.0, heading(node))).collect();
    positions::place(graph, system, &mut poses)?;
    Ok(poses)
}

//! Where to descend from.

use super::descend::{Descent, system};
use super::linearize::System;
use super::{PoseGraph, PoseGraphError, PoseOptions, RelaxedPoses, positions};
use crate::headings::{HeadingError, Turn, chordal};
use crate::pose::Pose;

/// The poses of least χ², from the springs alone.
///
/// # Errors
/// Information matrices too far apart for 64-bit numbers.
pub fn relax_poses(graph: &PoseGraph, options: &PoseOptions) -> Result<RelaxedPoses, PoseGraphError> {
    let mut system = system(graph);
    let start = chordal_start(graph, &system)?;
    Descent::new(&mut system).run(start, options)
}

fn chordal_start(graph: &PoseGraph, system: &System) -> Result<Vec<Pose>, PoseGraphError> {
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

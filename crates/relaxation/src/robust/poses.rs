//! Robust pose graphs: a consistent beginning, then reweighting with a descent after each.

use super::graduate::{check, reweight};
use super::network::{FLOOR, spanning};
use super::{RobustError, RobustMethod, RobustOptions, consistent_closures, suspects};
use crate::pose::Pose;
use crate::pose_graph::{PoseGraph, PoseOptions, Reweighting, relax_poses};

/// Poses, and what was believed on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustPoses {
    /// One for each node.
    pub poses: Vec<Pose>,
    /// One for each spring: what its information was multiplied by. Trusted springs and bridges have 1.
    pub weights: Vec<f64>,
    /// Springs with a weight below one half.
    pub rejected: Vec<usize>,
    /// The weighted χ².
    pub chi2: f64,
    /// How many times the graph was relaxed.
    pub iterations: usize,
}

/// Beyond so many suspects, comparing every two of them would take longer than all the rest.
const MOST_COMPARED: usize = 6000;
/// The bound that decides about consistency: 99 % of χ² with three degrees of freedom.
const CONSISTENT: f64 = 11.345;

/// Poses when some springs may be false. `trusted` says of each spring that it is not (odometry); bridges need no such word.
///
/// A pose graph is not convex, so what is found depends on the beginning. It begins at the largest set of closures of which every
/// two agree ([`consistent_closures`]), relaxed without any start; from there the method reweights all suspects.
///
/// # Errors
/// Not one flag for each spring, a scale that is not positive, information matrices too far apart.
pub fn relax_poses_robustly(
    graph: &PoseGraph,
    trusted: &[bool],
    options: &RobustOptions,
    descent: &PoseOptions,
) -> Result<RobustPoses, RobustError> {
    check(options.method)?;
    let ends: Vec<(usize, usize)> = graph.springs().iter().map(|s| (s.from, s.to)).collect();
    let suspects = suspects(graph.len(), &ends, trusted)?;
    let kept = spanning(graph.len(), &ends, &suspects);
    let mut weights = vec![1.0; ends.len()];
    let poses = beginning(graph, &kept, &suspects, descent)?;
    let rough = PoseOptions { tolerance: descent.tolerance.max(1e-5), max_iterations: descent.max_iterations.min(20) };
    let mut relaxation = Reweighting::new(graph, poses);
    let e2 = relaxation.errors();
    let mut iterations = 1;
    if !suspects.is_empty() {
        iterations += reweight(options, &suspects, &mut weights, e2, |weights| {
            relaxation.relax(&floored(weights, &kept), &rough)?;
            Ok(relaxation.errors())
        })?;
    }
    relaxation.relax(&floored(&weights, &kept), descent)?;
    if let RobustMethod::TruncatedLeastSquares { bound } = options.method {
        iterations += settle(&mut relaxation, &mut weights, &suspects, &kept, bound, descent)?;
    }
    let e2 = relaxation.errors();
    let chi2 = weights.iter().zip(&e2).map(|(w, e2)| w * e2).sum();
    let rejected = (0..weights.len()).filter(|k| weights[*k] < 0.5).collect();
    Ok(RobustPoses { poses: relaxation.poses, weights, rejected, chi2, iterations })
}

/// Poses to begin with: relaxed with the largest consistent set of closures alone.
fn beginning(
    graph: &PoseGraph,
    kept: &[bool],
    suspects: &[usize],
    descent: &PoseOptions,
) -> Result<Vec<Pose>, RobustError> {
    let mut weights = vec![1.0; kept.len()];
    if suspects.len() <= MOST_COMPARED {
        for k in suspects {
            weights[*k] = 0.0;
        }
        let mut odometry = kept.to_vec();
        odometry.iter_mut().zip(&weights).for_each(|(kept, w)| *kept |= *w == 1.0);
        for k in consistent_closures(graph, &odometry, suspects, CONSISTENT) {
            weights[k] = 1.0;
        }
    }
    Ok(relax_poses(&graph.reweighted(&floored(&weights, kept))?, descent)?.poses)
}

/// Takes in what fits and lets go what does not, until nothing changes: the conditions of a minimum of truncated least squares.
fn settle(
    relaxation: &mut Reweighting,
    weights: &mut [f64],
    suspects: &[usize],
    kept: &[bool],
    bound: f64,
    descent: &PoseOptions,
) -> Result<usize, RobustError> {
    const ROUNDS: usize = 10;
    for round in 0..ROUNDS {
        let e2 = relaxation.errors();
        let mut changed = false;
        for &k in suspects {
            let weight = f64::from(u8::from(e2[k] <= bound));
            changed |= weight != weights[k];
            weights[k] = weight;
        }
        if !changed {
            return Ok(round);
        }
        relaxation.relax(&floored(weights, kept), descent)?;
    }
    Ok(ROUNDS)
}

/// A spring that alone holds a part of the map keeps some stiffness, however small, or the part floats away.
fn floored(weights: &[f64], kept: &[bool]) -> Vec<f64> {
    weights.iter().zip(kept).map(|(w, kept)| if *kept { w.max(FLOOR) } else { *w }).collect()
}

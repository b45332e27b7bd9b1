//! Robust pose graphs: a consistent beginning, then reweighting with a descent after each.

use super::consistency::supported_closures;
use super::graduate::{check, reweight};
use super::network::{FLOOR, spanning};
use super::{RobustError, RobustMethod, RobustOptions, consistent_closures, suspects};
use crate::pose::Pose;
use crate::pose_graph::{PoseGraph, PoseOptions, Reweighting};

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
const MOST_COMPARED: usize = 10_000;
/// Beyond so many, the largest consistent set is not looked for.
const MOST_IN_SETS: usize = 600;
/// The bound that decides about consistency: 99 % of χ² with three degrees of freedom.
const CONSISTENT: f64 = 11.345;

/// Poses when some springs may be false. `trusted` says of each spring that it is not (odometry); bridges need no such word.
///
/// A pose graph is not convex, so what is found depends on the beginning. Several are relaxed without any start (with all closures, with none,
/// with those that support each other, with the largest set of which every two agree, see [`consistent_closures`]); from the one with the lowest
/// truncated cost, the method reweights all suspects.
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
    let rough = PoseOptions { tolerance: descent.tolerance.max(1e-4), max_iterations: descent.max_iterations.min(20) };
    let mut relaxation = Reweighting::new(graph, graph.odometry());
    begin(&mut relaxation, graph, &kept, &suspects, &rough)?;
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

/// Relaxes with different closures and stays at what has the lowest truncated cost.
fn begin(
    relaxation: &mut Reweighting<'_>,
    graph: &PoseGraph,
    kept: &[bool],
    suspects: &[usize],
    rough: &PoseOptions,
) -> Result<(), RobustError> {
    let mut suspected = vec![false; kept.len()];
    suspects.iter().for_each(|k| suspected[*k] = true);
    let odometry: Vec<bool> = kept.iter().zip(&suspected).map(|(kept, suspected)| *kept || !suspected).collect();
    let mut sets = vec![vec![]];
    if suspects.len() <= MOST_COMPARED {
        sets.push(supported_closures(graph, &odometry, suspects, CONSISTENT));
    }
    if suspects.len() <= MOST_IN_SETS {
        sets.push(consistent_closures(graph, &odometry, suspects, CONSISTENT));
        sets.push(suspects.to_vec());
    }
    let mut best = (f64::INFINITY, vec![]);
    for set in sets {
        let mut weights: Vec<f64> = suspected.iter().map(|suspected| f64::from(u8::from(!suspected))).collect();
        set.iter().for_each(|k| weights[*k] = 1.0);
        relaxation.restart(&floored(&weights, kept), rough)?;
        let truncated = |(e2, suspected): (&f64, &bool)| if *suspected { e2.min(CONSISTENT) } else { *e2 };
        let cost: f64 = relaxation.errors().iter().zip(&suspected).map(truncated).sum();
        if cost < best.0 {
            best = (cost, relaxation.poses.clone());
        }
    }
    relaxation.poses = best.1;
    Ok(())
}

/// Takes in what fits and lets go what does not, until nothing changes: the conditions of a minimum of truncated least squares.
fn settle(
    relaxation: &mut Reweighting<'_>,
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

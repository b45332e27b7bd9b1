//! Robust pose graphs: a consistent beginning, then reweighting with a descent after each.

use super::consistency::supported_closures;
use super::graduate::{check, reweight};
use super::network::{FLOOR, spanning};
use super::{RobustError, RobustMethod, RobustOptions, consistent_closures, suspects};
use crate::pose::Pose;
use crate::pose_graph::{PoseGraph, PoseOptions, Reweighting, check_start};

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
    robustly(graph, None, trusted, options, descent)
}

/// The same from poses that are about right, as those of a map are to which a closure was added: nothing is relaxed without a
/// start, and closures are not compared in pairs, so that a small graph costs little.
///
/// # Errors
/// As [`relax_poses_robustly`]; not one finite pose for each node.
pub fn relax_poses_robustly_from(
    graph: &PoseGraph,
    start: &[Pose],
    trusted: &[bool],
    options: &RobustOptions,
    descent: &PoseOptions,
) -> Result<RobustPoses, RobustError> {
    check_start(graph, start)?;
    robustly(graph, Some(start), trusted, options, descent)
}

fn robustly(
    graph: &PoseGraph,
    start: Option<&[Pose]>,
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
    let mut relaxation = Reweighting::new(graph, start.map_or_else(|| graph.odometry(), <[Pose]>::to_vec));
    if start.is_none() {
        begin(&mut relaxation, graph, &kept, &suspects, &rough)?;
    }
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

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::pose_graph::{PoseSpring, descend};

    /// A square of 40 places walked round twice, each place of the second round recognised from the first; the last closure is
    /// false.
    fn rounds() -> (PoseGraph, Vec<bool>) {
        let spring = |from: usize, to: usize, from_to: Pose| PoseSpring {
            from,
            to,
            from_to,
            information: Matrix3::from_diagonal(&[2500.0, 2500.0, 1e5].into()),
        };
        let step =
            |k: usize| Pose::new(1.0, 0.002, if k.is_multiple_of(10) { std::f64::consts::FRAC_PI_2 } else { 0.0 });
        let driven = (1..80).map(|k| spring(k - 1, k, step(k)));
        let closures = (40..80).map(|k| spring(k, k - 40, Pose::default()));
        let wrong = spring(75, 5, Pose::default());
        let springs: Vec<PoseSpring> = driven.chain(closures).chain([wrong]).collect();
        let trusted = (0..springs.len()).map(|k| k < 79).collect();
        (PoseGraph::new(80, &springs).unwrap(), trusted)
    }

    #[test]
    fn from_where_all_closures_put_the_poses_the_false_one_is_let_go() {
        let (graph, trusted) = rounds();
        let options = PoseOptions::default();
        let start = descend(&graph, &graph.odometry(), &options).unwrap().poses;
        let robust = relax_poses_robustly_from(&graph, &start, &trusted, &RobustOptions::default(), &options).unwrap();
        assert_eq!(robust.rejected, [119]);
        let anew = relax_poses_robustly(&graph, &trusted, &RobustOptions::default(), &options).unwrap();
        approx::assert_relative_eq!(robust.chi2, anew.chi2, max_relative = 1e-6);
        assert!(relax_poses_robustly_from(&graph, &start[1..], &trusted, &RobustOptions::default(), &options).is_err());
    }
}

//! To the global minimum: a good start, and where its descent was long, other starts and shaken landscapes.
//!
//! χ² has many minima when headings are noisy, and none of the ways to a start finds the basin of the lowest one always. What tells
//! the cases apart is how far the descent had to go: a start whose χ² falls by less than half was in the right basin in every
//! case we could check. Otherwise the landscape is *shaken*: with headings trusted three times more or less, or with springs that
//! disagree trusted less, minima lie elsewhere; descending there and then on the true cost leads out of shallow basins.

use super::descend::{Descent, system};
use super::linearize::System;
use super::starts::{chordal_start, joint_start};
use super::{PoseGraph, PoseGraphError, PoseOptions, RelaxedPoses};
use crate::pose::Pose;

/// A start whose χ² is less than so many times the minimum's needs no second opinion.
const CLEAR: f64 = 2.0;
/// A minimum lower by less than this share is the same one.
const LOWER: f64 = 1e-6;
/// A descent that explores stops where a step promises less than this share, and goes on only if it ended below so many times the best.
const EXPLORED: f64 = 1e-2;
const PROMISING: f64 = 1.1;
const MOST_EXPLORED: usize = 40;
/// Rounds of shaking without end would not help either; each continues only if the one before found something.
const ROUNDS: usize = 6;

/// The poses of least χ², from the springs alone: no start is needed.
///
/// Headings as direction vectors first (chordal relaxation), positions with these headings known as in the paper, then Gauss-Newton on
/// the whole cost. If that last descent was long, other starts are tried and the lowest minimum is taken
/// ([`RelaxedPoses::descents`] tells how many). That it is the lowest of all is what experience says, not what a proof says.
///
/// # Errors
/// Information matrices too far apart for 64-bit numbers.
///
/// ```
/// use relaxation::nalgebra::Matrix3;
/// use relaxation::{Pose, PoseGraph, PoseOptions, PoseSpring, relax_poses};
///
/// // A square of 1 m driven around, whose last side came out 0.2 m long.
/// let side = |from, to, length| PoseSpring {
///     from,
///     to,
///     from_to: Pose::new(length, 0.0, 90f64.to_radians()),
///     information: Matrix3::identity(),
/// };
/// let graph = PoseGraph::new(4, &[side(0, 1, 1.0), side(1, 2, 1.0), side(2, 3, 1.0), side(3, 0, 1.2)])?;
/// let relaxed = relax_poses(&graph, &PoseOptions::default())?;
/// assert!(relaxed.converged && relaxed.chi2 < 0.2 * 0.2);
/// # Ok::<(), relaxation::PoseGraphError>(())
/// ```
pub fn relax_poses(graph: &PoseGraph, options: &PoseOptions) -> Result<RelaxedPoses, PoseGraphError> {
    let mut system = system(graph);
    let start = chordal_start(graph, &system)?;
    let first = Descent::new(&mut system).run(start, options)?;
    // Dead reckoning is hardly ever better than a minimum; where it is, false springs have pulled the headings aside.
    let reckoned = Some(graph.odometry()).filter(|poses| graph.chi2(poses) < first.chi2);
    if first.chi2_start <= CLEAR * first.chi2 && reckoned.is_none() {
        return Ok(first);
    }
    search(graph, &mut system, first, reckoned, options)
}

/// How the landscape is changed for one descent.
#[derive(Debug, Clone, Copy)]
enum Shake {
    /// Headings count more or less; from where we are.
    Headings(f64),
    /// The same, from the joint linear start.
    Joint(f64),
    /// A spring of χ² counts `1 / (1 + χ² / scale)`; from where we are.
    Residuals(f64),
}

/// The mild ones first; the others only when something lower has been found at all.
const SHAKES: [&[Shake]; 2] =
    [&[Shake::Headings(0.3), Shake::Headings(3.0)], &[Shake::Joint(0.3), Shake::Joint(3.0), Shake::Residuals(0.3)]];

fn search(
    graph: &PoseGraph,
    system: &mut System,
    first: RelaxedPoses,
    reckoned: Option<Vec<Pose>>,
    options: &PoseOptions,
) -> Result<RelaxedPoses, PoseGraphError> {
    let alone = first.chi2;
    let mut best = first;
    let mut descents = 1;
    for start in reckoned.into_iter().chain([joint_start(graph, system)?]) {
        explore(system, start, &mut best, options)?;
        descents += 1;
    }
    for _ in 0..ROUNDS {
        let before = best.chi2;
        for shakes in SHAKES {
            for &shake in shakes {
                let start = shaken(graph, system, &best, shake, options)?;
                explore(system, start, &mut best, options)?;
                descents += 1;
            }
            if best.chi2 >= alone {
                // Three other ways led no lower than the first: it is the minimum as far as anyone can tell.
                break;
            }
        }
        if best.chi2 >= before {
            break;
        }
    }
    let last = Descent::new(system).run(best.poses, options)?;
    let iterations = best.iterations + last.iterations;
    Ok(RelaxedPoses { chi2_start: best.chi2_start, iterations, descents, ..last })
}

/// Descends from `start` and keeps where it ends if that is lower than the best.
fn explore(
    system: &mut System,
    start: Vec<Pose>,
    best: &mut RelaxedPoses,
    options: &PoseOptions,
) -> Result<(), PoseGraphError> {
    let mut descent = Descent::new(system);
    let rough = descent.run(start, &roughly(options))?;
    if rough.chi2 < best.chi2 * PROMISING {
        let fine = descent.run(rough.poses, &PoseOptions { tolerance: options.tolerance.max(LOWER), ..*options })?;
        if fine.chi2 < best.chi2 * (1.0 - 2.0 * LOWER) {
            let iterations = rough.iterations + fine.iterations;
            *best = RelaxedPoses { chi2_start: rough.chi2_start, iterations, ..fine };
        }
    }
    Ok(())
}

fn roughly(options: &PoseOptions) -> PoseOptions {
    PoseOptions {
        tolerance: options.tolerance.max(EXPLORED),
        max_iterations: options.max_iterations.min(MOST_EXPLORED),
    }
}

/// The minimum of the changed cost.
fn shaken(
    graph: &PoseGraph,
    system: &System,
    best: &RelaxedPoses,
    shake: Shake,
    options: &PoseOptions,
) -> Result<Vec<Pose>, PoseGraphError> {
    let mut changed = system.clone();
    match shake {
        Shake::Headings(factor) | Shake::Joint(factor) => {
            changed.springs.iter_mut().for_each(|spring| spring.trust_heading(factor));
        }
        Shake::Residuals(scale) => {
            for (prepared, spring) in changed.springs.iter_mut().zip(graph.springs()) {
                let chi2 = spring.chi2(best.poses[spring.from], best.poses[spring.to]);
                prepared.trust(1.0 / (1.0 + chi2 / scale));
            }
        }
    }
    let start = match shake {
        Shake::Joint(_) => joint_start(graph, &changed)?,
        _ => best.poses.clone(),
    };
    Ok(Descent::new(&mut changed).run(start, &roughly(options))?.poses)
}

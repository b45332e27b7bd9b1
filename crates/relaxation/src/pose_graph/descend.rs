//! Down to the nearest minimum: Gauss-Newton, damped (Levenberg-Marquardt) where a full step would go up.

use super::linearize::{Prepared, System};
use super::{PoseGraph, PoseGraphError};
use crate::block_cholesky::BlockCholesky;
use crate::pose::{Pose, wrap};
use crate::unknowns::Unknowns;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct PoseOptions {
    /// At most so many linear solutions in one descent.
    pub max_iterations: usize,
    /// Stop when the next step promises less than this share of χ².
    pub tolerance: f64,
}

impl Default for PoseOptions {
    fn default() -> Self {
        Self { max_iterations: 200, tolerance: 1e-10 }
    }
}

/// Poses at a minimum of χ², and how they were found.
#[derive(Debug, Clone, PartialEq)]
pub struct RelaxedPoses {
    /// One for each node.
    pub poses: Vec<Pose>,
    /// χ² at the start of the descent.
    pub chi2_start: f64,
    /// χ² now.
    pub chi2: f64,
    /// By how much one more step of Gauss-Newton could lower χ², to second order: how near this is to the minimum it lies at.
    pub gap: f64,
    /// Linear solutions of the descent that led here.
    pub iterations: usize,
    /// How many minima were descended to, this being the lowest.
    pub descents: usize,
    /// The tolerance was reached.
    pub converged: bool,
}

/// Follows χ² down from `start` to the nearest minimum. Held nodes are first put where they are held.
///
/// # Errors
/// Not one finite start pose for each node, or information matrices too far apart.
pub fn descend(graph: &PoseGraph, start: &[Pose], options: &PoseOptions) -> Result<RelaxedPoses, PoseGraphError> {
    check_start(graph, start)?;
    let mut poses = start.to_vec();
    for (pose, held) in poses.iter_mut().zip(&graph.held) {
        *pose = held.unwrap_or(*pose);
    }
    let mut system = system(graph);
    Descent::new(&mut system).run(poses, options)
}

/// That there is one finite pose for each node.
pub(crate) fn check_start(graph: &PoseGraph, start: &[Pose]) -> Result<(), PoseGraphError> {
    let nodes = graph.len();
    let is_wrong = |k: &usize| *k >= nodes || !start.get(*k).is_some_and(|pose| pose.is_finite());
    match (0..nodes.max(start.len())).find(is_wrong) {
        Some(first_wrong) => Err(PoseGraphError::StartWrong { nodes, poses: start.len(), first_wrong }),
        None => Ok(()),
    }
}

/// The springs of `graph`, prepared, and its pattern, analysed.
pub(super) fn system(graph: &PoseGraph) -> System {
    let springs = graph.springs.iter().zip(&graph.weights).map(|(s, w)| Prepared::new(s, *w)).collect();
    let ends = graph.springs.iter().map(|s| (s.from, s.to));
    System::new(springs, Unknowns::new(graph.len(), |node| graph.held[node].is_some(), ends))
}

/// The damping a failed step begins with, relative to the diagonal.
const FIRST_DAMPING: f64 = 1e-4;
/// Beyond this a step is so short that there is nothing to gain.
const LAST_DAMPING: f64 = 1e10;
/// Below this damping changes nothing and is dropped.
const NO_DAMPING: f64 = 1e-7;

pub(super) struct Descent<'a> {
    system: &'a mut System,
    matrix: BlockCholesky,
    right: Vec<f64>,
    step: Vec<f64>,
    diagonal: Vec<f64>,
}

impl<'a> Descent<'a> {
    pub(super) fn new(system: &'a mut System) -> Self {
        let matrix = system.unknowns.matrix(3);
        let size = 3 * system.unknowns.count();
        Self { system, matrix, right: vec![0.0; size], step: vec![0.0; size], diagonal: vec![0.0; size] }
    }

    pub(super) fn run(&mut self, mut poses: Vec<Pose>, options: &PoseOptions) -> Result<RelaxedPoses, PoseGraphError> {
        let mut chi2 = self.system.linearize(&poses, &mut self.matrix, &mut self.right);
        let chi2_start = chi2;
        let (mut damping, mut growth) = (0.0, 4.0);
        let mut candidate = poses.clone();
        let report = |poses, chi2, gap, iterations, converged| {
            Ok(RelaxedPoses { poses, chi2_start, chi2, gap, iterations, descents: 1, converged })
        };
        let mut gap = f64::INFINITY;
        for iteration in 0..options.max_iterations {
            self.matrix.diagonal(&mut self.diagonal);
            if damping > 0.0 {
                self.damp(damping);
            }
            if let Err(error) = self.matrix.factorize() {
                if damping > LAST_DAMPING {
                    return Err(PoseGraphError::TooFarApart { node: error.node });
                }
                damping = if damping > 0.0 { damping * 100.0 } else { FIRST_DAMPING };
                self.system.linearize(&poses, &mut self.matrix, &mut self.right);
                continue;
            }
            self.step.copy_from_slice(&self.right);
            self.matrix.solve(&mut self.step);
            let promised = self.promised(damping);
            if damping == 0.0 {
                gap = promised;
            }
            // At the limit of what the numbers can hold: coordinates of 1e3 m resolve 1e-13 m.
            let negligible = promised <= options.tolerance * chi2 || self.is_rounding(&poses);
            self.apply(&poses, &mut candidate);
            let reached = self.system.chi2(&candidate);
            if reached <= chi2 {
                std::mem::swap(&mut poses, &mut candidate);
                let share = (chi2 - reached) / promised;
                chi2 = reached;
                if negligible && damping == 0.0 {
                    return report(poses, chi2, gap, iteration + 1, true);
                }
                // A step as good as its promise needs less damping (Nielsen 1999).
                damping *= (1.0 - (2.0 * share - 1.0).powi(3)).clamp(0.1, 2.0);
                growth = 4.0;
                if damping < NO_DAMPING {
                    damping = 0.0;
                }
            } else {
                if negligible || damping > LAST_DAMPING {
                    return report(poses, chi2, gap, iteration + 1, negligible);
                }
                damping = if damping > 0.0 { damping * growth } else { FIRST_DAMPING };
                growth *= 2.0;
            }
            chi2 = self.system.linearize(&poses, &mut self.matrix, &mut self.right);
        }
        report(poses, chi2, gap, options.max_iterations, false)
    }

    fn damp(&mut self, damping: f64) {
        for unknown in 0..self.system.unknowns.count() {
            let mut entries = [[0.0; 3]; 3];
            for (k, row) in entries.iter_mut().enumerate() {
                row[k] = damping * self.diagonal[3 * unknown + k];
            }
            self.matrix.add(self.system.unknowns.diagonal(unknown), &entries);
        }
    }

    /// By how much χ² would fall if it were the quadratic it looks like from here.
    fn promised(&self, damping: f64) -> f64 {
        let mut sum = 0.0;
        for ((step, right), diagonal) in self.step.iter().zip(&self.right).zip(&self.diagonal) {
            sum += step * (right + damping * diagonal * step);
        }
        sum
    }

    fn is_rounding(&self, poses: &[Pose]) -> bool {
        let size = poses.iter().fold(1.0f64, |size, pose| size.max(pose.x.abs()).max(pose.y.abs()));
        self.step.iter().all(|step| step.abs() <= 1e-15 * size)
    }

    fn apply(&self, poses: &[Pose], candidate: &mut [Pose]) {
        for (node, (pose, moved)) in poses.iter().zip(candidate).enumerate() {
            *moved = match self.system.unknowns.of(node) {
                Some(k) => Pose {
                    x: pose.x + self.step[3 * k],
                    y: pose.y + self.step[3 * k + 1],
                    heading: wrap(pose.heading + self.step[3 * k + 2]),
                },
                None => *pose,
            };
        }
    }
}

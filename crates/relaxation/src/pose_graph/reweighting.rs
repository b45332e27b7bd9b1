//! One graph relaxed again and again with other weights: the pattern is analysed once.

use super::descend::{Descent, system};
use super::linearize::{Prepared, System};
use super::{PoseGraph, PoseGraphError, PoseOptions};
use crate::pose::Pose;

/// A graph, where it is now, and what is kept from one relaxation to the next.
pub(crate) struct Reweighting<'a> {
    graph: &'a PoseGraph,
    system: System,
    pub(crate) poses: Vec<Pose>,
}

impl<'a> Reweighting<'a> {
    pub(crate) fn new(graph: &'a PoseGraph, poses: Vec<Pose>) -> Self {
        Self { graph, system: system(graph), poses }
    }

    /// Descends from where it is with these weights (times those the graph has).
    pub(crate) fn relax(&mut self, weights: &[f64], options: &PoseOptions) -> Result<(), PoseGraphError> {
        let springs = self.graph.springs.iter().zip(&self.graph.weights).zip(weights);
        self.system.springs.clear();
        self.system.springs.extend(springs.map(|((spring, own), weight)| Prepared::new(spring, own * weight)));
        self.poses = Descent::new(&mut self.system).run(std::mem::take(&mut self.poses), options)?.poses;
        Ok(())
    }

    /// Every spring's χ² without the weight of [`relax`](Self::relax).
    pub(crate) fn errors(&self) -> Vec<f64> {
        let springs = self.graph.springs.iter().zip(&self.graph.weights);
        springs.map(|(spring, own)| own * spring.chi2(self.poses[spring.from], self.poses[spring.to])).collect()
    }
}

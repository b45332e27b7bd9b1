//! One graph relaxed again and again with other weights: the pattern is analysed only when springs come or go.

use super::descend::Descent;
use super::linearize::{Prepared, System};
use super::starts::chordal_start;
use super::{PoseGraph, PoseGraphError, PoseOptions};
use crate::pose::Pose;
use crate::unknowns::Unknowns;

/// Springs of less weight are left out: they would only fill the factor.
pub(crate) const LEAST_WEIGHT: f64 = 1e-6;

/// A graph, where it is now, and what is kept from one relaxation to the next.
pub(crate) struct Reweighting<'a> {
    graph: &'a PoseGraph,
    /// Springs of some weight when the pattern was analysed.
    active: Vec<usize>,
    system: Option<System>,
    pub(crate) poses: Vec<Pose>,
}

impl<'a> Reweighting<'a> {
    pub(crate) fn new(graph: &'a PoseGraph, poses: Vec<Pose>) -> Self {
        Self { graph, active: vec![], system: None, poses }
    }

    /// Descends from where it is with these weights (times those the graph has).
    pub(crate) fn relax(&mut self, weights: &[f64], options: &PoseOptions) -> Result<(), PoseGraphError> {
        self.prepare(weights);
        if let Some(system) = &mut self.system {
            self.poses = Descent::new(system).run(std::mem::take(&mut self.poses), options)?.poses;
        }
        Ok(())
    }

    /// Relaxes with these weights from the springs alone.
    pub(crate) fn restart(&mut self, weights: &[f64], options: &PoseOptions) -> Result<(), PoseGraphError> {
        self.prepare(weights);
        if let Some(system) = &mut self.system {
            let start = chordal_start(self.graph, system)?;
            self.poses = Descent::new(system).run(start, options)?.poses;
        }
        Ok(())
    }

    fn prepare(&mut self, weights: &[f64]) {
        let all = &self.graph.springs;
        let active: Vec<usize> = (0..weights.len()).filter(|k| weights[*k] >= LEAST_WEIGHT).collect();
        let springs = active.iter().map(|&k| Prepared::new(&all[k], self.graph.weights[k] * weights[k])).collect();
        match &mut self.system {
            Some(system) if self.active == active => system.springs = springs,
            _ => {
                let ends = active.iter().map(|&k| (all[k].from, all[k].to));
                let unknowns = Unknowns::new(self.graph.len(), |node| self.graph.held[node].is_some(), ends);
                self.system = Some(System::new(springs, unknowns));
                self.active = active;
            }
        }
    }

    /// Every spring's χ² without the weight of [`relax`](Self::relax).
    pub(crate) fn errors(&self) -> Vec<f64> {
        let springs = self.graph.springs.iter().zip(&self.graph.weights);
        springs.map(|(spring, own)| own * spring.chi2(self.poses[spring.from], self.poses[spring.to])).collect()
    }
}

//! Multilevel relaxation: sweeps on the map, on a coarser map, on a still coarser one.

mod hierarchy;
mod matrix;

pub(crate) use hierarchy::Hierarchy;
pub(crate) use matrix::{Entry, Matrix};

use nalgebra::{Matrix2, Point2, Vector2};

use crate::certificate::forces;
use crate::gauss_seidel::iterate;
use crate::network::Network;
use crate::solver::{RelaxOptions, Relaxed, Solver};

/// Multilevel relaxation, after Frese, Larsson & Duckett (2005).
///
/// A sweep evens out what neighbours disagree on, and hardly touches what a whole wing of the map agrees on. So about every
/// second place is kept for a coarser map, on which that is a disagreement between neighbours again; and so on until eight
/// places are left. The others follow the kept ones by interpolation:
///
/// ```text
/// p_i = Σ_{j kept} (−a_ij) p_j / (a_ii + Σ_{k not kept} a_ik),   A_coarse = Pᵀ A P
/// ```
///
/// One cycle sweeps each level once on the way down and once, backward, on the way up. It costs about four sweeps, and
/// shrinks the error to a fifth on loops of any length, to about two thirds on even grids. On large irregular maps whose
/// springs differ much in stiffness cycles alone become slow (500 of them leave an excess of 5e-5 at 10⁵ places); there they are
/// to be used as the preconditioner of [`ConjugateGradient`](crate::ConjugateGradient), which is its default.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Multilevel {
    /// When to stop; a cycle counts as a sweep.
    pub options: RelaxOptions,
}

impl Default for Multilevel {
    fn default() -> Self {
        Self { options: RelaxOptions { max_sweeps: 500, ..RelaxOptions::default() } }
    }
}

impl Solver for Multilevel {
    fn name(&self) -> &'static str {
        "multilevel"
    }

    fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        if network.is_isotropic() {
            self.cycles::<f64>(network, start)
        } else {
            self.cycles::<Matrix2<f64>>(network, start)
        }
    }
}

impl Multilevel {
    fn cycles<E: Entry>(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        let unknowns = Unknowns::new(network);
        let hierarchy = Hierarchy::<E>::new(unknowns.matrix(network));
        tracing::debug!(complexity = hierarchy.operator_complexity(), "levels built");
        iterate(network, start, &self.options, |_, positions| {
            let residual = unknowns.forces(network, positions);
            let mut step = vec![Vector2::zeros(); residual.len()];
            hierarchy.cycle(&residual, &mut step);
            unknowns.advance(positions, &step, 1.0);
        })
    }
}

/// The free nodes and their numbers.
#[derive(Debug)]
pub(crate) struct Unknowns {
    number: Vec<u32>,
    free: Vec<u32>,
}

impl Unknowns {
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    pub(crate) fn new(network: &Network) -> Self {
        let mut number = vec![u32::MAX; network.len()];
        let free: Vec<u32> =
            (0..network.len()).filter(|&node| !network.is_anchor(node)).map(|node| node as u32).collect();
        for (at, &node) in (0_u32..).zip(&free) {
            number[node as usize] = at;
        }
        Self { number, free }
    }

    pub(crate) fn matrix<E: Entry>(&self, network: &Network) -> Matrix<E> {
        Matrix::of(network, &self.number, &self.free)
    }

    /// The forces on the free nodes.
    pub(crate) fn forces(&self, network: &Network, positions: &[Point2<f64>]) -> Vec<Vector2<f64>> {
        let all = forces(network, positions);
        self.free.iter().map(|&node| all[node as usize]).collect()
    }

    /// `p ← p + factor · step` at the free nodes.
    pub(crate) fn advance(&self, positions: &mut [Point2<f64>], step: &[Vector2<f64>], factor: f64) {
        for (&node, step) in self.free.iter().zip(step) {
            positions[node as usize] += step * factor;
        }
    }
}

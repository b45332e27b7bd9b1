//! The paper's relaxation: each node in turn moves to where its neighbours think it should be.

mod rows;

pub(crate) use rows::{SweepRows, inverse};

use nalgebra::Point2;

use crate::network::Network;
use crate::solver::{RelaxOptions, Relaxed, Solver};

/// In which order a sweep visits the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum SweepOrder {
    /// By number, every time: the paper's sweep.
    Forward,
    /// By number, and back the next time: no direction is favoured.
    #[default]
    Symmetric,
}

/// Sweeps of single-node relaxation, the method of the paper.
///
/// ```text
/// p_i ← (Σ_j (p_j + t_ji) / u_ij) / (Σ_j 1 / u_ij)
/// ```
///
/// Every such step minimises the energy over that one node exactly, so the energy never rises; the matrix is positive
/// definite, so the sweeps converge to the one optimum from any start. How fast is another matter: on a corridor of `n`
/// places an error shrinks by `cos²(π/2n)` per sweep, so that `O(n²)` sweeps are needed. Good for keeping a map relaxed
/// between loop closures, and for small maps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct GaussSeidel {
    /// When to stop.
    pub options: RelaxOptions,
    /// In which order to visit the nodes.
    pub order: SweepOrder,
}

impl Solver for GaussSeidel {
    fn name(&self) -> &'static str {
        match self.order {
            SweepOrder::Forward => "gauss-seidel",
            SweepOrder::Symmetric => "symmetric-gauss-seidel",
        }
    }

    fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        let _span = tracing::debug_span!("relax", nodes = network.len(), springs = network.springs().len()).entered();
        let rows = network.rows();
        iterate(network, start, &self.options, |sweep, positions| match self.order {
            SweepOrder::Symmetric if sweep % 2 == 1 => rows.sweep_backward(positions),
            _ => rows.sweep_forward(positions),
        })
    }
}

/// One sweep over all places in the order of their numbers, in place: what the paper does each time a place is added.
///
/// Anchors stay. The first sweep over a network prepares its rows, later ones only read them.
///
/// # Panics
///
/// If there is not exactly one position per node.
pub fn sweep(network: &Network, positions: &mut [Point2<f64>]) {
    assert_eq!(positions.len(), network.len(), "one position per node");
    network.rows().sweep_forward(positions);
}

/// Repeats `step` until the energy is proven near enough to the optimum.
///
/// The proof costs about two sweeps, so it is asked for after every eighth part more sweeps: at most 12 % of the sweeps are
/// in vain, and the proofs cost at most a quarter of the whole.
pub(crate) fn iterate(
    network: &Network,
    start: &[Point2<f64>],
    options: &RelaxOptions,
    mut step: impl FnMut(usize, &mut [Point2<f64>]),
) -> Relaxed {
    let mut report = Relaxed::judged(network, network.usable_start(start), 0, options.tolerance);
    while !report.converged && report.sweeps < options.max_sweeps {
        let until = (report.sweeps + 1 + report.sweeps / 8).min(options.max_sweeps);
        let mut positions = report.positions;
        for sweep in report.sweeps..until {
            step(sweep, &mut positions);
        }
        report = Relaxed::judged(network, positions, until, options.tolerance);
        tracing::trace!(sweeps = report.sweeps, energy = report.energy, gap = report.gap);
        if !report.energy.is_finite() {
            break;
        }
    }
    tracing::debug!(sweeps = report.sweeps, energy = report.energy, gap = report.gap, converged = report.converged);
    report
}

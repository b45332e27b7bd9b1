//! What all solvers share: the trait, the options, and the report of how it went.

use nalgebra::Point2;

use crate::certificate::{energy_floor, gap_bound};
use crate::gauss_seidel::GaussSeidel;
use crate::network::Network;

/// A way to the positions of least energy.
///
/// All solvers answer the same question and are tested on one table of problems; they differ in what it costs them.
/// Each moves the free nodes only: the anchor of each component stays where `start` has it.
/// A start coordinate that is not finite is replaced by dead reckoning.
pub trait Solver {
    /// The solver's name, as reports print it.
    fn name(&self) -> &'static str;

    /// Sets out from `start` (one position per node, in metres) and goes as near the optimum as the solver's options ask.
    ///
    /// # Panics
    ///
    /// If there is not exactly one start position per node.
    fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed;
}

/// Positions and how they came about.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Relaxed {
    /// The position of each node, in metres.
    pub positions: Vec<Point2<f64>>,
    /// Sweeps, cycles or iterations made; 0 for a solver that computes the answer at once.
    pub sweeps: usize,
    /// Whether the energy is proven to be within the tolerance of the optimum.
    pub converged: bool,
    /// The energy at [`positions`](Self::positions), each spring counted once.
    pub energy: f64,
    /// Proven bound on how far the energy is above the optimum: `energy − gap ≤ optimum ≤ energy`.
    pub gap: f64,
}

impl Relaxed {
    /// Measures `positions`: their energy, and how far above the optimum it can be.
    pub(crate) fn judged(network: &Network, positions: Vec<Point2<f64>>, sweeps: usize, tolerance: f64) -> Self {
        let energy = network.energy(&positions);
        let gap = gap_bound(network, &positions);
        let converged = gap <= tolerance * energy || gap <= energy_floor(network, &positions);
        Self { positions, sweeps, converged, energy, gap }
    }
}

/// When an iteration may stop.
///
/// Iterations stop on *energy*: the excess over the optimum is bounded by a proof that costs about as much as two sweeps
/// (see [`gap_bound`](crate::gap_bound)). A small step or a small residual proves nothing on long chains:
/// there both become tiny while the map is still metres off.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct RelaxOptions {
    /// Give up after so many sweeps (or cycles, or iterations).
    pub max_sweeps: usize,
    /// Stop when the energy is proven to be within this fraction of the optimum.
    pub tolerance: f64,
}

impl Default for RelaxOptions {
    fn default() -> Self {
        Self { max_sweeps: 20_000, tolerance: 1e-9 }
    }
}

/// Moves every place to where its neighbours think it should be, until the energy is as low as it can be.
///
/// Minimises the energy of Duckett, Marsland & Shapiro (2000), each link a spring of stiffness `1/v_ij`:
///
/// ```text
/// E = Σ_ij |p_j − p_i − d_ij (cos θ_ij, sin θ_ij)|² / v_ij
/// ```
///
/// by Gauss-Seidel sweeps, forward and backward in turn. `start` gives the coordinates to set out from, in metres; the
/// anchor of each component keeps its own, and coordinates that are not finite are replaced by dead reckoning.
/// Running out of sweeps is no error: see [`Relaxed::converged`]; it is what happens on large maps, where
/// `Auto` is the solver to take. A `Network` cannot be ill-posed: its constructor checked that.
///
/// # Panics
///
/// If there is not exactly one start position per node.
///
/// # Examples
///
/// ```
/// use relaxation::{relax, nalgebra::Vector2, Network, RelaxOptions, Spring};
///
/// let network = Network::new(2, &[Spring::isotropic(0, 1, Vector2::new(2.0, 0.0), 0.01)])?;
/// let relaxed = relax(&network, &network.dead_reckoning(), &RelaxOptions::default());
/// assert_eq!(relaxed.positions[1].x, 2.0);
/// # Ok::<(), relaxation::NetworkError>(())
/// ```
#[must_use]
pub fn relax(network: &Network, start: &[Point2<f64>], options: &RelaxOptions) -> Relaxed {
    GaussSeidel { options: *options, ..GaussSeidel::default() }.solve(network, start)
}

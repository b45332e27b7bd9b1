//! The direct solution with faer: sparse Cholesky of the whole normal matrix, the oracle of every other solver.

use faer::linalg::solvers::Solve;
use faer::prelude::Reborrow;
use faer::sparse::linalg::LltError;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{Argsort, Pair, SymbolicSparseColMat};
use faer::{Mat, Side};
use nalgebra::{Point2, Vector2};

use crate::certificate::forces;
use crate::network::Network;
use crate::solver::{RelaxOptions, Relaxed, Solver};

/// Sparse Cholesky factorisation with [`faer`], of all free nodes at once.
///
/// A well-tested general library on the whole matrix: what the other solvers are held against. For one solution
/// `Elimination` is quicker; to solve again and again with other weights on the same springs, keep a
/// [`DirectFactor`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Direct;

impl Solver for Direct {
    fn name(&self) -> &'static str {
        "direct"
    }

    fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        let tolerance = RelaxOptions::default().tolerance;
        match DirectFactor::new(network) {
            Ok(factor) => factor.solve(network, start),
            // Weights so far apart that a pivot rounds away: eliminating spring by spring subtracts nothing and cannot fail.
            Err(_) => {
                Relaxed { converged: false, ..Relaxed::judged(network, network.usable_start(start), 0, tolerance) }
            }
        }
    }
}

/// The positions of least energy, each component held where its anchor is: the exact answer, computed directly.
///
/// # Errors
///
/// Stiffnesses or coordinates so far apart that 64-bit numbers cannot hold the answer.
///
/// ```
/// use relaxation::{nalgebra::Vector2, optimum, Network, Spring};
///
/// // A square whose last side is 0.4 m short of closing: each side takes a quarter of the error.
/// let side = |from, to, x, y| Spring::isotropic(from, to, Vector2::new(x, y), 1.0);
/// let network = Network::new(4, &[side(0, 1, 1.0, 0.0), side(1, 2, 0.0, 1.0), side(2, 3, -1.0, 0.0), side(3, 0, 0.4, -1.0)])?;
/// let positions = optimum(&network)?;
/// assert!((positions[1].x - 0.9).abs() < 1e-12);
/// assert!((network.energy(&positions) - 0.04).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn optimum(network: &Network) -> Result<Vec<Point2<f64>>, SolveError> {
    let anchored: Vec<_> = network.anchors().iter().map(|anchor| anchor.position).collect();
    let positions = crate::elimination::eliminate(network, &anchored);
    match positions.iter().position(|p| !(p.x.is_finite() && p.y.is_finite())) {
        Some(node) => Err(SolveError::NotFinite { node }),
        None => Ok(positions),
    }
}

/// Why there is no solution in numbers.
///
/// The text is a fragment that fits after "could not solve the network: ".
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// Rounding made the normal matrix indefinite: the stiffnesses are too far apart for a general factorisation.
    #[error("the stiffnesses of the springs are too far apart: the matrix is not positive definite in 64-bit numbers")]
    NotPositiveDefinite,
    /// The network is too large for the memory or the indices of the factorisation.
    #[error("the factor of {nodes} nodes is too large for this machine")]
    TooLarge {
        /// How many nodes the network has.
        nodes: usize,
    },
    /// A factor was used with a network that is not of the shape it was made for.
    #[error("the factor was made for other springs or anchors than those of this network")]
    OtherShape,
    /// A node was asked for that does not exist.
    #[error("node {node} does not exist, the network has {nodes} nodes (numbered from 0)")]
    NoSuchNode {
        /// The node asked for.
        node: usize,
        /// How many there are.
        nodes: usize,
    },
    /// The optimum has a coordinate too large for a 64-bit number.
    #[error("node {node}: its coordinate is too large for a 64-bit number")]
    NotFinite {
        /// The first such node.
        node: usize,
    },
}

/// A factorisation that is kept: the order of elimination once, the numbers as often as the weights change.
#[derive(Debug)]
pub struct DirectFactor {
    /// The first unknown of each node, or `u32::MAX` for anchors.
    unknown: Vec<u32>,
    unknowns: usize,
    isotropic: bool,
    /// The nodes each active spring joins: the shape the factor was made for.
    ends: Vec<(usize, usize)>,
    pattern: SymbolicSparseColMat<u32>,
    argsort: Argsort<u32>,
    symbolic: SymbolicLlt<u32>,
    numeric: Llt<u32, f64>,
}

impl DirectFactor {
    /// Orders and factors the normal matrix of `network`.
    ///
    /// # Errors
    ///
    /// Stiffnesses too far apart for 64-bit numbers, or a factor too large for the machine.
    pub fn new(network: &Network) -> Result<Self, SolveError> {
        let too_large = SolveError::TooLarge { nodes: network.len() };
        let (unknown, unknowns) = number(network);
        let mut pairs = Vec::new();
        for_each_entry(network, &unknown, |row, column, _| pairs.push(Pair::new(row, column)));
        let (pattern, argsort) =
            SymbolicSparseColMat::try_new_from_indices(unknowns, unknowns, &pairs).map_err(|_| too_large.clone())?;
        let symbolic = SymbolicLlt::try_new(pattern.rb(), Side::Lower).map_err(|_| too_large)?;
        let numeric = factor(network, &unknown, &pattern, &argsort, &symbolic)?;
        let isotropic = network.is_isotropic();
        let ends = active_ends(network).collect();
        Ok(Self { unknown, unknowns, isotropic, ends, pattern, argsort, symbolic, numeric })
    }

    /// Factors again, with the weights of `network`: the same nodes, anchors and springs, some of them perhaps re-weighted.
    ///
    /// The order of elimination and the pattern of the factor are kept, which saves most of the time.
    ///
    /// # Errors
    ///
    /// A network of another shape, or stiffnesses too far apart. The factor is then as it was.
    pub fn refactor(&mut self, network: &Network) -> Result<(), SolveError> {
        let (unknown, _) = number(network);
        if unknown != self.unknown
            || network.is_isotropic() != self.isotropic
            || !active_ends(network).eq(self.ends.iter().copied())
        {
            return Err(SolveError::OtherShape);
        }
        self.numeric = factor(network, &unknown, &self.pattern, &self.argsort, &self.symbolic)?;
        Ok(())
    }

    /// The positions of least energy, the anchors where `start` has them.
    ///
    /// # Panics
    ///
    /// If there is not exactly one start position per node.
    #[must_use]
    pub fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        // Solved for the way from dead reckoning to the optimum: numbers of the size of the error, not of the map.
        let mut positions = reckoned_from(network, start);
        for _ in 0..2 {
            self.correct(network, &mut positions);
        }
        Relaxed::judged(network, positions, 0, RelaxOptions::default().tolerance)
    }

    /// How every node moves under a force on one of them: `A⁻¹ f`. Anchors do not move.
    pub(crate) fn response(&self, node: usize, force: Vector2<f64>) -> impl Fn(usize) -> Vector2<f64> {
        let mut rhs = Mat::<f64>::zeros(self.unknowns, if self.isotropic { 2 } else { 1 });
        let unknown = self.unknown.clone();
        let isotropic = self.isotropic;
        let place = move |at: usize, axis: usize| if isotropic { (at, axis) } else { (at + axis, 0) };
        let at = unknown[node] as usize;
        if unknown[node] != u32::MAX {
            rhs[place(at, 0)] = force.x;
            rhs[place(at, 1)] = force.y;
        }
        let moved = self.numeric.solve(&rhs);
        move |node| match unknown[node] {
            u32::MAX => Vector2::zeros(),
            at => Vector2::new(moved[place(at as usize, 0)], moved[place(at as usize, 1)]),
        }
    }

    /// One Newton step, exact but for rounding: `p ← p + A⁻¹ r`.
    fn correct(&self, network: &Network, positions: &mut [Point2<f64>]) {
        let forces = forces(network, positions);
        let free = |node: usize| (self.unknown[node] != u32::MAX).then_some(self.unknown[node] as usize);
        let mut rhs = Mat::<f64>::zeros(self.unknowns, if self.isotropic { 2 } else { 1 });
        let place = |at: usize, axis: usize| {
            if self.isotropic { (at, axis) } else { (at + axis, 0) }
        };
        for (node, force) in forces.iter().enumerate() {
            if let Some(at) = free(node) {
                rhs[place(at, 0)] = force.x;
                rhs[place(at, 1)] = force.y;
            }
        }
        let step = self.numeric.solve(&rhs);
        for (node, position) in positions.iter_mut().enumerate() {
            if let Some(at) = free(node) {
                position.x += step[place(at, 0)];
                position.y += step[place(at, 1)];
            }
        }
    }
}

/// Dead reckoning, each component moved to where `start` has its anchor.
pub(crate) fn reckoned_from(network: &Network, start: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let start = network.usable_start(start);
    let mut positions = network.dead_reckoning();
    let shifts: Vec<_> = network.anchors().iter().map(|a| start[a.node] - a.position).collect();
    for (node, position) in positions.iter_mut().enumerate() {
        *position += shifts[network.component(node)];
    }
    positions
}

/// Numbers the unknowns: one per free node, or two where x and y are coupled.
#[expect(
    clippy::cast_possible_truncation,
    reason = "`Network` checked that every index fits 32 bits, with one to spare"
)]
fn number(network: &Network) -> (Vec<u32>, usize) {
    let width = if network.is_isotropic() { 1 } else { 2 };
    let mut unknown: Vec<u32> = Vec::with_capacity(network.len());
    let mut next = 0_usize;
    for node in 0..network.len() {
        let anchored = network.is_anchor(node);
        unknown.push(if anchored { u32::MAX } else { next as u32 });
        next += if anchored { 0 } else { width };
    }
    (unknown, next)
}

/// The nodes that each spring of positive weight joins.
fn active_ends(network: &Network) -> impl Iterator<Item = (usize, usize)> {
    let springs = network.springs().iter().enumerate();
    springs.filter(|&(index, _)| network.weight(index) > 0.0).map(|(_, s)| (s.from, s.to))
}

/// Every entry of the lower triangle of the normal matrix, spring by spring; entries of one place are to be summed.
fn for_each_entry(network: &Network, unknown: &[u32], mut entry: impl FnMut(u32, u32, f64)) {
    let width = if network.is_isotropic() { 1_u32 } else { 2 };
    for (index, s) in network.springs().iter().enumerate() {
        if s.from == s.to || network.weight(index) == 0.0 {
            continue;
        }
        let w = network.information(index);
        let (a, b) = (unknown[s.from], unknown[s.to]);
        for row in 0..width {
            for column in 0..width {
                let value = w[(row as usize, column as usize)];
                for end in [a, b] {
                    if end != u32::MAX && row >= column {
                        entry(end + row, end + column, value);
                    }
                }
                if a != u32::MAX && b != u32::MAX {
                    entry(a.max(b) + row, a.min(b) + column, -value);
                }
            }
        }
    }
}

fn factor(
    network: &Network,
    unknown: &[u32],
    pattern: &SymbolicSparseColMat<u32>,
    argsort: &Argsort<u32>,
    symbolic: &SymbolicLlt<u32>,
) -> Result<Llt<u32, f64>, SolveError> {
    let mut values = Vec::new();
    for_each_entry(network, unknown, |_, _, value| values.push(value));
    let matrix = faer::sparse::SparseColMat::new_from_argsort(pattern.clone(), argsort, &values)
        .map_err(|_| SolveError::TooLarge { nodes: network.len() })?;
    Llt::try_new_with_symbolic(symbolic.clone(), matrix.rb(), Side::Lower).map_err(|error| match error {
        LltError::Numeric(_) => SolveError::NotPositiveDefinite,
        LltError::Generic(_) => SolveError::TooLarge { nodes: network.len() },
    })
}

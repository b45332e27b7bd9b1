//! How near the optimum a map is, proven without a solution; and what else a user should know of it.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::bridges::bridges;
use crate::network::Network;

/// What can be said for sure about a map: how far from the optimum it is, what holds it together, what strains it.
///
/// ```
/// use relaxation::{certify, nalgebra::Vector2, optimum, Network, Spring};
///
/// let side = |from, to, x, y| Spring::isotropic(from, to, Vector2::new(x, y), 0.01);
/// let network = Network::new(4, &[side(0, 1, 1.0, 0.0), side(1, 2, 0.0, 1.0), side(2, 0, -1.2, -1.0), side(2, 3, 1.0, 0.0)])?;
/// let certificate = certify(&network, &optimum(&network)?, 2);
/// assert!(certificate.relative_gap < 1e-12);
/// assert_eq!(certificate.bridges, [3]); // nothing checks the last spring
/// assert_eq!(certificate.degrees_of_freedom, 2); // one loop, closed in x and in y
/// assert_eq!(certificate.strained.len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Certificate {
    /// The energy: the χ² of all springs.
    pub energy: f64,
    /// Proven bound on how far the energy is above the optimum, see [`gap_bound`].
    pub gap: f64,
    /// `gap / energy`; 0 where both are nothing but rounding.
    pub relative_gap: f64,
    /// Proven bound on how far any place is from where the optimum has it, in metres.
    pub max_shift: f64,
    /// The Euclidean norm of the forces on the free nodes, in 1/m: the residual of the normal equations.
    pub residual_norm: f64,
    /// How many connected components there are, each with its own anchor.
    pub components: usize,
    /// The springs that are part of no loop, ascending: nothing checks what they measured.
    pub bridges: Vec<usize>,
    /// Measured coordinates less free ones: how many numbers the loops check. The energy of a map whose covariances are right is
    /// about this.
    pub degrees_of_freedom: usize,
    /// The springs with the largest residuals, the worst first.
    pub strained: Vec<Strain>,
}

/// How far a spring is from its rest.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Strain {
    /// The spring.
    pub spring: usize,
    /// `p_to − p_from − rest`, in metres.
    pub residual: Vector2<f64>,
    /// Its length in standard deviations of the spring (Mahalanobis distance, weight included).
    pub sigmas: f64,
}

/// Measures `positions` and names the `strained` springs with the largest residuals.
///
/// # Panics
///
/// If there is not exactly one position per node.
#[must_use]
pub fn certify(network: &Network, positions: &[Point2<f64>], strained: usize) -> Certificate {
    let energy = network.energy(positions);
    let gap = gap_bound(network, positions);
    let rounding = energy_floor(network, positions);
    let active = (0..network.springs().len()).filter(|&spring| network.weight(spring) > 0.0).count();
    let forces = forces(network, positions);
    let free = (0..network.len()).filter(|&node| !network.is_anchor(node));
    Certificate {
        energy,
        gap,
        relative_gap: if energy <= rounding { 0.0 } else { gap / energy },
        max_shift: (gap * longest_way(network)).sqrt(),
        residual_norm: free.map(|node| forces[node].norm_squared()).sum::<f64>().sqrt(),
        components: network.components(),
        bridges: bridges(network),
        degrees_of_freedom: 2 * (active + network.components() - network.len()),
        strained: worst(network, positions, strained),
    }
}

/// The springs with the largest residuals in standard deviations, the worst first.
fn worst(network: &Network, positions: &[Point2<f64>], count: usize) -> Vec<Strain> {
    let springs = network.springs().iter().enumerate();
    let mut all: Vec<Strain> = springs
        .map(|(spring, s)| {
            let residual = positions[s.to] - positions[s.from] - s.rest;
            Strain { spring, residual, sigmas: network.spring_energy(spring, positions).sqrt() }
        })
        .collect();
    let worse = |a: &Strain, b: &Strain| b.sigmas.total_cmp(&a.sigmas).then(a.spring.cmp(&b.spring));
    if count < all.len() {
        all.select_nth_unstable_by(count, worse);
        all.truncate(count);
    }
    all.sort_unstable_by(worse);
    all
}

/// The largest variance of a node by the spanning tree alone: no node can be less sure than that.
///
/// With `e` the way to the optimum, `eᵀ A e = gap`, hence `|e_i|² ≤ gap · λ((A⁻¹)_ii)`, and loops only make a node surer.
fn longest_way(network: &Network) -> f64 {
    let tree = network.tree();
    let mut variance = vec![0.0; network.len()];
    let mut longest = 0.0_f64;
    for &node in &tree.order[network.components()..] {
        let parent = tree.parent[node as usize];
        let along = variance[parent.node as usize] + network.covariance(parent.spring as usize).trace();
        variance[node as usize] = along;
        longest = longest.max(along);
    }
    // The trace counts both directions where they are alike.
    if network.is_isotropic() { 0.5 * longest } else { longest }
}

/// An upper bound on how far the energy at `positions` is above the optimum, in the unit of the energy.
///
/// At the optimum the forces on every node cancel. What is left of them, `r = b − A p`, must flow to the anchors, and by
/// Thomson's principle every flow that carries it there bounds the excess energy from above:
///
/// ```text
/// E(p) − E* = rᵀ A⁻¹ r = min_flow Σ_springs fᵀ U f  ≤  Σ_tree f_tᵀ U_t f_t
/// ```
///
/// where `f_t`, the flow through the spring of a spanning tree, is the sum of the forces in the subtree behind it. That
/// takes one pass over the springs and one over the tree. On a tree the bound is exact, on a map with loops it is too large by
/// the stretch of the tree (a small factor on corridors, more on wide grids); it goes to zero with the excess itself.
///
/// # Panics
///
/// If there is not exactly one position per node.
#[must_use]
pub fn gap_bound(network: &Network, positions: &[Point2<f64>]) -> f64 {
    let mut flow = forces(network, positions);
    let tree = network.tree();
    let mut bound = 0.0;
    for &node in tree.order[network.components()..].iter().rev() {
        let (f, parent) = (flow[node as usize], tree.parent[node as usize]);
        bound += f.dot(&(network.covariance(parent.spring as usize) * f));
        flow[parent.node as usize] += f;
    }
    bound
}

/// The force on each node: minus half the gradient of the energy, `r = b − A p`, in 1/m. Zero at the optimum, except
/// at the anchors, which hold against whatever pulls at them (the entry there is not a residual).
///
/// # Panics
///
/// If there is not exactly one position per node.
#[must_use]
pub fn forces(network: &Network, positions: &[Point2<f64>]) -> Vec<Vector2<f64>> {
    assert_eq!(positions.len(), network.len(), "one position per node");
    let mut forces = vec![Vector2::zeros(); network.len()];
    for (index, s) in network.springs().iter().enumerate() {
        let stretch = positions[s.to] - positions[s.from] - s.rest;
        let pull: Vector2<f64> = if network.is_isotropic() {
            stretch * network.stiffness(index)
        } else {
            network.information(index) * stretch
        };
        forces[s.from] += pull;
        forces[s.to] -= pull;
    }
    forces
}

/// The excess energy that rounding alone accounts for: no solver can be asked for less.
///
/// Coordinates `p` are known to `ε |p|`, so a spring's residual is known to `ε (|p_i| + |p_j| + |t|)`; in-place iterations
/// come to rest within a few times that.
pub(crate) fn energy_floor(network: &Network, positions: &[Point2<f64>]) -> f64 {
    let size = |v: &Vector2<f64>| v.x.abs() + v.y.abs();
    network
        .springs()
        .iter()
        .enumerate()
        .map(|(index, s)| {
            let doubt =
                f64::EPSILON * (size(&positions[s.from].coords) + size(&positions[s.to].coords) + size(&s.rest));
            let information: Matrix2<f64> = network.information(index);
            64.0 * doubt * doubt * information.trace()
        })
        .sum()
}

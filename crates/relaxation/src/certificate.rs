//! How near the optimum a map is: a bound that needs no solution.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::network::Network;

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

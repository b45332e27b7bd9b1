//! The scheme of the year 2000, in which nodes carry variances too: kept to compare with.

use nalgebra::{Point2, Vector2};

use crate::gauss_seidel::iterate;
use crate::network::Network;
use crate::solver::{RelaxOptions, Relaxed, Solver};

/// Relaxation with node variances, after Duckett, Marsland & Shapiro (2000): a historical variant, **not** the optimum.
///
/// Each node carries a variance beside its position; the anchor has none. An estimate that comes over a spring is as unsure
/// as the neighbour and the spring together, and the estimates are fused by inverse variance:
///
/// ```text
/// v_ji = v_j + u_ji,   v_i ← 1 / Σ_j (1 / v_ji),   p_i ← v_i Σ_j (p_j + t_ji) / v_ji
/// ```
///
/// Two facts make it unfit for more than comparison:
/// * the weight `1/(v_j + u_ij)` is not the same seen from `i` and from `j`, so its fixed point minimises no energy. On a
///   square of four unit links with a closure error of 0.4 m it stops at an energy of 0.0434, the optimum being 0.0400. It is
///   right on trees and wherever the measurements agree anyway;
/// * a node's variance counts evidence twice: the neighbour's estimate contains the node's own. Two unit links in a row
///   give 0.732 and 1.732 where 1 and 2 are true; on long rings it saturates while the truth grows with their length.
///   Use [`Covariance`](crate::Covariance) for how sure a position is.
///
/// Springs with 2×2 covariances enter with the mean of their two variances. [`Relaxed::converged`] says whether the
/// *optimum* was reached, so here it is mostly `false`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct NodeVariances {
    /// How many sweeps to make.
    pub options: RelaxOptions,
}

impl Solver for NodeVariances {
    fn name(&self) -> &'static str {
        "node-variances"
    }

    fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        let mut variances = vec![0.0; network.len()];
        // Before the first sweep a node is as unsure as the way to it is long.
        let tree = network.tree();
        for &node in &tree.order[network.components()..] {
            let parent = tree.parent[node as usize];
            variances[node as usize] = variances[parent.node as usize] + variance(network, parent.spring);
        }
        iterate(network, start, &self.options, |_, positions| sweep_with_variances(network, positions, &mut variances))
    }
}

/// The variance of a spring, per axis.
fn variance(network: &Network, spring: u32) -> f64 {
    0.5 * network.covariance(spring as usize).trace()
}

/// One sweep of the variant: positions in metres, variances in square metres (zero at the anchors), both in place.
///
/// # Panics
///
/// If there is not exactly one position and one variance per node.
pub fn sweep_with_variances(network: &Network, positions: &mut [Point2<f64>], variances: &mut [f64]) {
    assert_eq!(
        (positions.len(), variances.len()),
        (network.len(), network.len()),
        "one position and variance per node"
    );
    let adjacency = network.adjacency();
    for node in 0..network.len() {
        if network.is_anchor(node) {
            continue;
        }
        let (mut total, mut sum) = (0.0, Vector2::zeros());
        for end in adjacency.ends(node) {
            let there = end.node as usize;
            let weight = (variances[there] + variance(network, end.spring)).recip();
            let seen_from_there =
                positions[there] - network.rest_from(u32::try_from(node).unwrap_or(u32::MAX), end.spring);
            total += weight;
            sum += seen_from_there.coords * weight;
        }
        variances[node] = total.recip();
        positions[node] = (sum / total).into();
    }
}

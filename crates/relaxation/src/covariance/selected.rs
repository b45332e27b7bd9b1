//! The blocks of the inverse that belong to nodes and springs: first those of the core, then those of each pass before.

use crate::elimination::{Compliance, Factor, Graph, Level, Springs, dissect, steps};
use crate::multilevel::Entry;
use crate::network::Network;

/// Marginals of the nodes of a graph, and the covariance between the ends of each of its springs (row: the spring's `a`).
type Blocks<C> = (Vec<C>, Vec<C>);

/// All blocks of the network.
pub(super) fn blocks<C: Compliance + Entry, const WIDTH: usize>(network: &Network) -> Blocks<C> {
    let steps = steps::<C>(network);
    let core = steps.last().map(|(_, core)| core_blocks::<C, WIDTH>(core));
    let mut inner = core.unwrap_or_default();
    for (at, (level, left)) in steps.iter().enumerate().rev() {
        inner = match at.checked_sub(1) {
            Some(before) => outer_blocks(&steps[before].1, steps[before].1.edges.len(), level, left, &inner),
            None => outer_blocks(network, network.springs().len(), level, left, &inner),
        };
    }
    inner
}

/// Takahashi's recursion over the supernodes of the core, from the root of the tree down.
///
/// For a column with the entries `l` below its diagonal `d`, and `Z` the inverse among its rows, which is known,
///
/// ```text
/// z = −Z l / d,   z_dd = 1/d² − lᵀ z / d
/// ```
fn core_blocks<C: Compliance + Entry, const WIDTH: usize>(core: &Graph<C>) -> Blocks<C> {
    let anchored = vec![nalgebra::Point2::origin(); core.anchors.len()];
    let order = dissect(core, &core.reckoned(&anchored));
    let factor = Factor::<WIDTH>::new(core, order);
    let mut found = (vec![C::ZERO; core.nodes], vec![C::ZERO; core.edges.len()]);
    // The inverse over all rows of a supernode, kept while one of its descendants may need it.
    let mut open: Vec<(u32, Vec<f64>)> = Vec::new();
    for id in (0..factor.symbolic.supernodes.len()).rev() {
        let supernode = factor.symbolic.supernodes[id];
        while open.last().is_some_and(|(above, _)| *above != supernode.parent) {
            open.pop();
        }
        let inverse = factor.inverse_block(id, open.last().map(|(above, block)| (*above as usize, block.as_slice())));
        collect(core, &factor, id, &inverse, &mut found);
        open.push((u32::try_from(id).expect("supernodes are counted in 32 bits"), inverse));
    }
    found
}

/// Takes the blocks of a supernode's nodes, and of the springs from them to later ones, out of its inverse.
fn collect<C: Compliance + Entry, const WIDTH: usize>(
    core: &Graph<C>,
    factor: &Factor<WIDTH>,
    id: usize,
    inverse: &[f64],
    (nodes, springs): &mut Blocks<C>,
) {
    let supernode = factor.symbolic.supernodes[id];
    let rows = factor.symbolic.rows(id);
    let count = (supernode.end - supernode.first) as usize;
    let stride = (count + rows.len()) * WIDTH;
    let block =
        |row: usize, column: usize| C::from_entries(|r, c| inverse[(column * WIDTH + c) * stride + row * WIDTH + r]);
    for (column, position) in (supernode.first..supernode.end).enumerate() {
        let node = factor.order.node[position as usize];
        nodes[node as usize] = block(column, column);
        for end in core.ends(node as usize) {
            let other = factor.order.position[end.node as usize];
            if other <= position || other == u32::MAX {
                continue;
            }
            let row = if other < supernode.end {
                (other - supernode.first) as usize
            } else {
                count + rows.partition_point(|&r| r < other)
            };
            let forward = core.edges[end.spring as usize].a == node;
            springs[end.spring as usize] = if forward { block(column, row) } else { block(row, column) };
        }
    }
}

/// Where a node of a graph went in a pass.
#[derive(Debug, Clone, Copy)]
enum Place {
    Kept,
    /// The node is `links[link]` of `chains[chain]`.
    Link {
        chain: u32,
        link: u32,
    },
    /// The node hangs from another.
    Leaf {
        parent: u32,
    },
}

/// The blocks of a graph from those of what a pass left of it.
fn outer_blocks<C: Compliance + Entry>(
    outer: &impl Springs<C>,
    springs: usize,
    level: &Level<C>,
    left: &Graph<C>,
    inner: &Blocks<C>,
) -> Blocks<C> {
    let mut place = vec![Place::Kept; level.nodes];
    let mut nodes = vec![C::ZERO; level.nodes];
    for (&node, &block) in level.kept.iter().zip(&inner.0) {
        nodes[node as usize] = block;
    }
    let ends = Ends { level, left, inner };
    for (number, chain) in (0_u32..).zip(&level.chains) {
        for link in chain.first..chain.end {
            let node = level.links[link as usize].node;
            let at = Place::Link { chain: number, link };
            place[node as usize] = at;
            nodes[node as usize] = ends.between(at, at, node, node);
        }
    }
    for leaf in level.leaves.iter().rev() {
        place[leaf.node as usize] = Place::Leaf { parent: leaf.parent };
        nodes[leaf.node as usize] = nodes[leaf.parent as usize].plus(leaf.compliance);
    }
    let springs = (0..springs).map(|index| {
        #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
        let edge = outer.edge(index as u32);
        let (a, b) = (edge.a, edge.b);
        match (place[a as usize], place[b as usize]) {
            _ if a == b => nodes[a as usize],
            (Place::Leaf { parent }, _) if parent == b => nodes[b as usize],
            (_, Place::Leaf { parent }) if parent == a => nodes[a as usize],
            // A spring of weight zero may join what is far apart: it is not in the graph and has no covariance there.
            (Place::Leaf { .. }, _) | (_, Place::Leaf { .. }) => C::ZERO,
            (at_a, at_b) => ends.between(at_a, at_b, a, b),
        }
    });
    let springs = springs.collect();
    (nodes, springs)
}

/// What is known of the ends of chains.
struct Ends<'a, C> {
    level: &'a Level<C>,
    left: &'a Graph<C>,
    inner: &'a Blocks<C>,
}

impl<C: Compliance + Entry> Ends<'_, C> {
    /// The covariance of two nodes of one chain, its ends included, or of two kept nodes that a spring joins.
    ///
    /// Given the ends `a` and `b`, a node behind the compliance `U_i` of a chain of compliance `U` is at
    /// `(1 − G_i) a + G_i b` with `G_i = U_i U⁻¹`, give or take a bridge of covariance `U_i − U_i U⁻¹ U_j` (`i` before `j`).
    fn between(&self, at_i: Place, at_j: Place, i: u32, j: u32) -> C {
        let chain = match (at_i, at_j) {
            (Place::Link { chain, .. }, _) | (_, Place::Link { chain, .. }) => self.level.chains[chain as usize],
            _ => return self.kept(i, j),
        };
        let behind = |at: Place, node: u32| match at {
            Place::Link { link, .. } => self.level.links[link as usize].compliance,
            _ if node == chain.a => C::ZERO,
            _ => chain.compliance,
        };
        let (u_i, u_j) = (behind(at_i, i), behind(at_j, j));
        let inverse = chain.compliance.inverted();
        let (g_i, g_j) = (u_i.product(inverse), u_j.product(inverse));
        let (h_i, h_j) = (C::ONE.plus(g_i.negated()), C::ONE.plus(g_j.negated()));
        let (aa, ab, bb) = (self.kept(chain.a, chain.a), self.kept(chain.a, chain.b), self.kept(chain.b, chain.b));
        let (from_a, from_b) =
            (h_i.product(aa).plus(g_i.product(ab.transposed())), h_i.product(ab).plus(g_i.product(bb)));
        let ends = from_a.product(h_j.transposed()).plus(from_b.product(g_j.transposed()));
        let order = |at: Place, node: u32| match at {
            Place::Link { link, .. } => i64::from(link),
            _ if node == chain.a => -1,
            _ => i64::MAX,
        };
        let bridge = if order(at_i, i) <= order(at_j, j) {
            u_i.product(C::ONE.plus(g_j.transposed().negated()))
        } else {
            h_i.product(u_j)
        };
        ends.plus(bridge)
    }

    /// The covariance of two kept nodes, which are the same or joined by a spring of what is left.
    fn kept(&self, i: u32, j: u32) -> C {
        let (i, j) = (self.level.index[i as usize], self.level.index[j as usize]);
        if i == j {
            return self.inner.0[i as usize];
        }
        let Some(end) = self.left.ends(i as usize).iter().find(|end| end.node == j) else { return C::ZERO };
        let block = self.inner.1[end.spring as usize];
        if self.left.edges[end.spring as usize].a == i { block } else { block.transposed() }
    }
}

//! Leaves and chains leave the graph, exactly and in one pass; they come back when the rest is solved.
//!
//! Most places of a topological map have one or two neighbours. A leaf follows its neighbour wherever that goes; the places
//! of a chain share the misfit between its two ends in proportion to the compliance that lies behind them. So both are known as
//! soon as the *core*, the places where chains meet, is. No number is subtracted from a nearly equal one on the way, so
//! stiffnesses may be as far apart as they like.

use nalgebra::{Point2, Vector2};

use super::compliance::Compliance;
use super::graph::{Edge, Graph, Springs};

/// A node with one neighbour.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leaf<C> {
    pub(crate) node: u32,
    pub(crate) parent: u32,
    /// Displacement `parent → node`.
    pub(crate) rest: Vector2<f64>,
    pub(crate) compliance: C,
}

/// A row of nodes with two neighbours each, between the nodes `a` and `b` (which may be the same).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chain<C> {
    pub(crate) a: u32,
    pub(crate) b: u32,
    /// Its links are `links[first..end]` of the level.
    pub(crate) first: u32,
    pub(crate) end: u32,
    /// All its springs in series.
    pub(crate) rest: Vector2<f64>,
    pub(crate) compliance: C,
}

/// A node of a chain, measured from the chain's end `a`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Link<C> {
    pub(crate) node: u32,
    pub(crate) rest: Vector2<f64>,
    pub(crate) compliance: C,
}

/// What one pass took out of a graph.
#[derive(Debug, Clone)]
pub(crate) struct Level<C> {
    /// Number of nodes before the pass.
    pub(crate) nodes: usize,
    /// In the order they were taken: a leaf's parent may be a leaf after it.
    pub(crate) leaves: Vec<Leaf<C>>,
    pub(crate) chains: Vec<Chain<C>>,
    pub(crate) links: Vec<Link<C>>,
    /// The old number of each node that stayed.
    pub(crate) kept: Vec<u32>,
    /// The new number of each node that stayed, `u32::MAX` for the others.
    pub(crate) index: Vec<u32>,
}

/// A graph reduced as far as it pays, and how to get back.
#[derive(Debug, Clone)]
pub(crate) struct Reduction<C> {
    pub(crate) levels: Vec<Level<C>>,
    pub(crate) core: Graph<C>,
}

/// The degree of an anchor: it is a junction, however few springs end there.
const ANCHOR: u32 = 1 << 31;

/// A degree from which on a node stays.
const JUNCTION: u32 = 3;

/// A graph and the pass that left it.
pub(crate) type Step<C> = (Level<C>, Graph<C>);

/// Every pass with the graph it left, the core last.
pub(crate) fn steps<C: Compliance>(springs: &impl Springs<C>) -> Vec<Step<C>> {
    let mut steps = vec![reduce(springs)];
    while let Some((_, graph)) = steps.last()
        && pays(graph)
    {
        let next = reduce(graph);
        steps.push(next);
    }
    steps
}

/// Whether another pass is worth its while: merging parallel springs has made new leaves and chains, at least of one node in
/// sixteen. Fewer are as quickly eliminated with the rest.
fn pays<C: Compliance>(left: &Graph<C>) -> bool {
    let few = (0..left.nodes).filter(|&node| left.ends(node).len() < JUNCTION as usize).count();
    few * 16 > left.nodes + 16 * left.anchors.len()
}

impl<C: Compliance> Reduction<C> {
    /// Takes leaves and chains out while that pays.
    pub(crate) fn new(springs: &impl Springs<C>) -> Self {
        let (level, mut core) = reduce(springs);
        let mut levels = vec![level];
        while pays(&core) {
            let (level, next) = reduce(&core);
            levels.push(level);
            core = next;
        }
        Self { levels, core }
    }
}

/// The positions of all nodes from those of the core.
pub(super) fn expanded<C: Compliance>(levels: &[Level<C>], core: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    levels.iter().rev().fold(core, |inner, level| level.expand(&inner))
}

impl<C: Compliance> Level<C> {
    fn expand(&self, inner: &[Point2<f64>]) -> Vec<Point2<f64>> {
        let mut positions = vec![Point2::origin(); self.nodes];
        for (&node, &position) in self.kept.iter().zip(inner) {
            positions[node as usize] = position;
        }
        for chain in &self.chains {
            let (a, b) = (positions[chain.a as usize], positions[chain.b as usize]);
            // What is left to close when one follows the chain from a to b, per compliance.
            let pull = chain.compliance.stiffness().times(a + chain.rest - b);
            for link in &self.links[chain.first as usize..chain.end as usize] {
                positions[link.node as usize] = a + (link.rest - link.compliance.times(pull));
            }
        }
        for leaf in self.leaves.iter().rev() {
            positions[leaf.node as usize] = positions[leaf.parent as usize] + leaf.rest;
        }
        positions
    }
}

/// One pass: leaves first, then the chains between what has three springs or more.
#[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
fn reduce<C: Compliance>(springs: &impl Springs<C>) -> (Level<C>, Graph<C>) {
    let nodes = springs.nodes();
    // The degree among what is still there; 0 marks what is gone.
    let mut degree: Vec<u32> = (0..nodes).map(|node| springs.ends(node).len() as u32).collect();
    let anchors = springs.anchors();
    for &anchor in &anchors {
        degree[anchor as usize] |= ANCHOR;
    }
    let leaves = take_leaves(springs, &mut degree);

    let mut kept = Vec::new();
    let mut index = vec![u32::MAX; nodes];
    for (node, &degree) in degree.iter().enumerate() {
        if degree >= JUNCTION {
            index[node] = kept.len() as u32;
            kept.push(node as u32);
        }
    }
    let mut walker = Walker { springs, degree, chains: Vec::new(), links: Vec::new() };
    let mut edges = Vec::new();
    for &junction in &kept {
        for &end in springs.ends(junction as usize) {
            let found = match walker.degree[end.node as usize] {
                0 => continue,
                1..JUNCTION => walker.walk(junction, end),
                // A spring between two junctions is met at both; it counts where it starts.
                _ => match springs.edge(end.spring) {
                    edge if edge.a == junction => edge,
                    _ => continue,
                },
            };
            if found.a != found.b {
                edges.push(Edge { a: index[found.a as usize], b: index[found.b as usize], ..found });
            }
        }
    }
    let anchors = anchors.iter().map(|&a| index[a as usize]).collect();
    let core = Graph::merged(kept.len(), edges, anchors);
    (Level { nodes, leaves, chains: walker.chains, links: walker.links, kept, index }, core)
}

/// Takes every node with one neighbour, and whatever becomes one by that.
fn take_leaves<C: Compliance>(springs: &impl Springs<C>, degree: &mut [u32]) -> Vec<Leaf<C>> {
    let mut leaves = Vec::new();
    for first in 0..degree.len() {
        let mut node = first;
        while degree[node] == 1 {
            let Some(&end) = springs.ends(node).iter().find(|end| degree[end.node as usize] != 0) else { break };
            let edge = springs.edge(end.spring).leaving(end.node);
            leaves.push(Leaf { node: edge.b, parent: end.node, rest: edge.rest, compliance: edge.compliance });
            degree[node] = 0;
            node = end.node as usize;
            degree[node] -= 1;
        }
    }
    leaves
}

/// Follows chains from junction to junction.
struct Walker<'a, C, S> {
    springs: &'a S,
    degree: Vec<u32>,
    chains: Vec<Chain<C>>,
    links: Vec<Link<C>>,
}

impl<C: Compliance, S: Springs<C>> Walker<'_, C, S> {
    /// Takes the chain that leaves junction `a` by `end`, and returns the one spring it amounts to.
    #[expect(clippy::cast_possible_truncation, reason = "a level has fewer links than the network has nodes")]
    fn walk(&mut self, a: u32, mut end: super::graph::End) -> Edge<C> {
        let first = self.links.len() as u32;
        let edge = self.springs.edge(end.spring).leaving(a);
        let (mut rest, mut compliance) = (edge.rest, edge.compliance);
        while self.degree[end.node as usize] < JUNCTION {
            let node = end.node;
            self.links.push(Link { node, rest, compliance });
            self.degree[node as usize] = 0;
            let onward = |next: &&super::graph::End| next.spring != end.spring && self.degree[next.node as usize] != 0;
            let Some(&next) = self.springs.ends(node as usize).iter().find(onward) else { break };
            let edge = self.springs.edge(next.spring).leaving(node);
            rest += edge.rest;
            compliance = compliance.series(edge.compliance);
            end = next;
        }
        let b = end.node;
        self.chains.push(Chain { a, b, first, end: self.links.len() as u32, rest, compliance });
        Edge { a, b, rest, compliance }
    }
}

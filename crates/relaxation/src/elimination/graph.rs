//! The graphs that elimination works on: the network itself first, then what is left of it.

use std::collections::VecDeque;

use nalgebra::{Point2, Vector2};

use super::compliance::Compliance;
pub(crate) use crate::network::End;
use crate::network::{Network, Passing};

/// A spring between two nodes of a reduced graph.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge<C> {
    pub(crate) a: u32,
    pub(crate) b: u32,
    /// Displacement `a → b`.
    pub(crate) rest: Vector2<f64>,
    pub(crate) compliance: C,
}

impl<C> Edge<C> {
    /// The same spring for one who leaves `node`.
    #[inline]
    pub(crate) fn leaving(self, node: u32) -> Self {
        if self.a == node { self } else { Self { a: self.b, b: self.a, rest: -self.rest, ..self } }
    }
}

/// What elimination asks of a graph.
pub(crate) trait Springs<C> {
    /// How many nodes.
    fn nodes(&self) -> usize;
    /// The springs at a node.
    fn ends(&self, node: usize) -> &[End];
    /// One spring.
    fn edge(&self, index: u32) -> Edge<C>;
    /// The nodes that stay where they are.
    fn anchors(&self) -> Vec<u32>;
}

impl<C: Compliance> Springs<C> for Network {
    fn nodes(&self) -> usize {
        self.len()
    }

    #[inline]
    fn ends(&self, node: usize) -> &[End] {
        self.adjacency().ends(node)
    }

    #[inline]
    fn edge(&self, index: u32) -> Edge<C> {
        edge_of(self, index)
    }

    fn anchors(&self) -> Vec<u32> {
        anchors_of(self)
    }
}

impl<C: Compliance> Springs<C> for Passing<'_> {
    fn nodes(&self) -> usize {
        self.network.len()
    }

    #[inline]
    fn ends(&self, node: usize) -> &[End] {
        self.adjacency.ends(node)
    }

    #[inline]
    fn edge(&self, index: u32) -> Edge<C> {
        edge_of(self.network, index)
    }

    fn anchors(&self) -> Vec<u32> {
        anchors_of(self.network)
    }
}

#[inline]
#[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
fn edge_of<C: Compliance>(network: &Network, index: u32) -> Edge<C> {
    let spring = &network.springs()[index as usize];
    let compliance = C::of(network, index as usize);
    Edge { a: spring.from as u32, b: spring.to as u32, rest: spring.rest, compliance }
}

#[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
fn anchors_of(network: &Network) -> Vec<u32> {
    network.anchors().iter().map(|anchor| anchor.node as u32).collect()
}

/// A graph with at most one spring between two nodes and none from a node to itself.
#[derive(Debug, Clone)]
pub(crate) struct Graph<C> {
    pub(crate) nodes: usize,
    pub(crate) edges: Vec<Edge<C>>,
    pub(crate) anchors: Vec<u32>,
    start: Vec<u32>,
    ends: Vec<End>,
}

impl<C: Compliance> Springs<C> for Graph<C> {
    fn nodes(&self) -> usize {
        self.nodes
    }

    #[inline]
    fn ends(&self, node: usize) -> &[End] {
        &self.ends[self.start[node] as usize..self.start[node + 1] as usize]
    }

    #[inline]
    fn edge(&self, index: u32) -> Edge<C> {
        self.edges[index as usize]
    }

    fn anchors(&self) -> Vec<u32> {
        self.anchors.clone()
    }
}

impl<C: Compliance> Graph<C> {
    /// Sorts `edges` by node and merges parallel ones. None may be from a node to itself.
    pub(crate) fn merged(nodes: usize, mut edges: Vec<Edge<C>>, anchors: Vec<u32>) -> Self {
        let (mut start, mut ends) = rows(nodes, &edges);
        if merge_parallel(nodes, &mut edges, &start, &ends) {
            edges.retain(|edge| edge.a != edge.b);
            (start, ends) = rows(nodes, &edges);
        }
        Self { nodes, edges, anchors, start, ends }
    }

    /// Dead reckoning breadth first from the anchors, which are at the given positions.
    pub(crate) fn reckoned(&self, anchored: &[Point2<f64>]) -> Vec<Point2<f64>> {
        let mut positions = vec![Point2::new(f64::NAN, f64::NAN); self.nodes];
        let mut queue: VecDeque<u32> = self.anchors.iter().copied().collect();
        for (&anchor, &position) in self.anchors.iter().zip(anchored) {
            positions[anchor as usize] = position;
        }
        while let Some(node) = queue.pop_front() {
            let here = positions[node as usize];
            for end in self.ends(node as usize) {
                let there = &mut positions[end.node as usize];
                if there.x.is_nan() {
                    *there = here + self.edges[end.spring as usize].leaving(node).rest;
                    queue.push_back(end.node);
                }
            }
        }
        positions
    }

    /// The force on each node at `positions`: `b − A p`.
    pub(crate) fn forces(&self, positions: &[Point2<f64>]) -> Vec<[f64; 2]> {
        let mut forces = vec![[0.0; 2]; self.nodes];
        for edge in &self.edges {
            let stretch = positions[edge.b as usize] - positions[edge.a as usize] - edge.rest;
            let pull = edge.compliance.stiffness().times(stretch);
            let a = &mut forces[edge.a as usize];
            (a[0], a[1]) = (a[0] + pull.x, a[1] + pull.y);
            let b = &mut forces[edge.b as usize];
            (b[0], b[1]) = (b[0] - pull.x, b[1] - pull.y);
        }
        forces
    }
}

/// Compressed rows of ends.
#[expect(clippy::cast_possible_truncation, reason = "a reduced graph has no more edges than the network has springs")]
fn rows<C>(nodes: usize, edges: &[Edge<C>]) -> (Vec<u32>, Vec<End>) {
    let mut start = vec![0_u32; nodes + 2];
    for edge in edges {
        start[edge.a as usize + 2] += 1;
        start[edge.b as usize + 2] += 1;
    }
    for i in 2..start.len() {
        start[i] += start[i - 1];
    }
    let mut ends = vec![End { node: 0, spring: 0 }; 2 * edges.len()];
    for (index, edge) in edges.iter().enumerate() {
        for (here, there) in [(edge.a, edge.b), (edge.b, edge.a)] {
            let slot = &mut start[here as usize + 1];
            ends[*slot as usize] = End { node: there, spring: index as u32 };
            *slot += 1;
        }
    }
    start.pop();
    (start, ends)
}

/// Merges each edge into the first between the same nodes and makes it a loop, to be dropped. Says whether there was any.
fn merge_parallel<C: Compliance>(nodes: usize, edges: &mut [Edge<C>], start: &[u32], ends: &[End]) -> bool {
    // For each node, the edge by which the node looked at last was seen to reach it.
    let mut first = vec![End { node: u32::MAX, spring: 0 }; nodes];
    let mut any = false;
    for (node, here) in (0_u32..).zip(start.windows(2)) {
        for end in &ends[here[0] as usize..here[1] as usize] {
            let seen = &mut first[end.node as usize];
            if seen.node != node {
                *seen = End { node, spring: end.spring };
            } else if end.node > node {
                let double = edges[end.spring as usize].leaving(node);
                let one = edges[seen.spring as usize].leaving(node);
                let (compliance, rest) = one.compliance.parallel(one.rest, double.compliance, double.rest);
                edges[seen.spring as usize] = Edge { rest, compliance, ..one };
                edges[end.spring as usize] = Edge { b: double.a, ..double };
                any = true;
            }
        }
    }
    any
}

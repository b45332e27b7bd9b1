//! Springs that are part of no loop.

use crate::network::{End, Network};

/// The springs whose loss would part the map (Tarjan 1974), ascending: no loop goes through them, so nothing checks them.
///
/// A robust estimator must not soften them: their residual is zero whatever they measured, and without them the map falls
/// apart. Springs of weight zero and self-springs are not counted; of parallel springs none is a bridge.
#[must_use]
pub fn bridges(network: &Network) -> Vec<usize> {
    let mut search =
        Search { found: vec![0; network.len()], low: vec![0; network.len()], next: 1, bridges: Vec::new() };
    for anchor in network.anchors() {
        search.from(network, anchor.node);
    }
    search.bridges.sort_unstable();
    search.bridges
}

/// A depth-first search without recursion, for maps may be one corridor of a million places.
struct Search {
    /// When each node was found, 0 for never.
    found: Vec<u32>,
    /// The earliest node that the subtree of each reaches by one spring outside the tree.
    low: Vec<u32>,
    next: u32,
    bridges: Vec<usize>,
}

impl Search {
    fn from(&mut self, network: &Network, root: usize) {
        let adjacency = network.adjacency();
        // The path from the root: each node, the spring that led there, and how many of its ends have been looked at.
        let mut path = vec![(root, u32::MAX, 0_usize)];
        self.discover(root);
        while let Some((node, came_by, looked)) = path.last_mut() {
            let (node, came_by) = (*node, *came_by);
            let Some(&End { node: there, spring }) = adjacency.ends(node).get(*looked) else {
                path.pop();
                if let Some(&(parent, _, _)) = path.last() {
                    self.low[parent] = self.low[parent].min(self.low[node]);
                    if self.low[node] > self.found[parent] {
                        self.bridges.push(came_by as usize);
                    }
                }
                continue;
            };
            *looked += 1;
            let there = there as usize;
            if spring == came_by {
                continue;
            }
            if self.found[there] == 0 {
                self.discover(there);
                path.push((there, spring, 0));
            } else {
                self.low[node] = self.low[node].min(self.found[there]);
            }
        }
    }

    fn discover(&mut self, node: usize) {
        self.found[node] = self.next;
        self.low[node] = self.next;
        self.next += 1;
    }
}

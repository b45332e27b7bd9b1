//! Which springs end at which node (compressed rows), and a spanning tree of each component.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::{Anchor, Spring};

/// One end of a spring as its node sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct End {
    /// The node at the other end.
    pub(crate) node: u32,
    /// The spring.
    pub(crate) spring: u32,
}

/// For each node, its ends: `ends[start[i]..start[i + 1]]`. Self-springs and springs of weight zero are absent.
#[derive(Debug, Clone)]
pub(crate) struct Adjacency {
    start: Vec<u32>,
    ends: Vec<End>,
}

impl Adjacency {
    /// Sorts the ends of all `active` springs by node: two passes of a counting sort.
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    pub(crate) fn new(nodes: usize, springs: &[Spring], active: impl Fn(usize) -> bool) -> Self {
        let mut start = vec![0_u32; nodes + 2];
        let present = |index: usize, s: &Spring| s.from != s.to && active(index);
        for (index, s) in springs.iter().enumerate() {
            if present(index, s) {
                start[s.from + 2] += 1;
                start[s.to + 2] += 1;
            }
        }
        for i in 2..start.len() {
            start[i] += start[i - 1];
        }
        let mut ends = vec![End { node: 0, spring: 0 }; start[nodes + 1] as usize];
        for (index, s) in springs.iter().enumerate() {
            if present(index, s) {
                for (here, there) in [(s.from, s.to), (s.to, s.from)] {
                    let slot = &mut start[here + 1];
                    ends[*slot as usize] = End { node: there as u32, spring: index as u32 };
                    *slot += 1;
                }
            }
        }
        start.pop();
        Self { start, ends }
    }

    /// The ends at `node`.
    pub(crate) fn ends(&self, node: usize) -> &[End] {
        &self.ends[self.start[node] as usize..self.start[node + 1] as usize]
    }
}

/// A spanning forest that hangs from the anchors, by the chains along which dead reckoning drifts least.
///
/// Where springs are about equally stiff those are the chains of fewest springs, and a breadth-first search finds them;
/// where stiffnesses are orders of magnitude apart, Dijkstra's search by variance does.
#[derive(Debug, Clone)]
pub(crate) struct SpanningTree {
    /// All nodes, parents before children, anchors included.
    pub(crate) order: Vec<u32>,
    /// The end through which each node hangs from its parent; of no meaning for anchors.
    pub(crate) parent: Vec<End>,
}

/// The mark of a node that the search has not reached.
const UNSEEN: End = End { node: u32::MAX, spring: u32::MAX };

impl SpanningTree {
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    pub(crate) fn breadth_first(nodes: usize, adjacency: &Adjacency, anchors: &[Anchor]) -> Self {
        let mut order = Vec::with_capacity(nodes);
        let mut parent = vec![UNSEEN; nodes];
        for anchor in anchors {
            let root = anchor.node as u32;
            parent[anchor.node] = End { node: root, spring: u32::MAX };
            order.push(root);
        }
        let mut head = 0;
        while head < order.len() {
            let node = order[head];
            head += 1;
            for end in adjacency.ends(node as usize) {
                let seen = &mut parent[end.node as usize];
                if seen.node == u32::MAX {
                    *seen = End { node, spring: end.spring };
                    order.push(end.node);
                }
            }
        }
        debug_assert_eq!(order.len(), nodes, "every component has an anchor");
        Self { order, parent }
    }

    /// The chains of least total `variance` (of a spring).
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    pub(crate) fn surest(
        nodes: usize,
        adjacency: &Adjacency,
        anchors: &[Anchor],
        variance: impl Fn(u32) -> f64,
    ) -> Self {
        let mut order = Vec::with_capacity(nodes);
        let mut parent = vec![UNSEEN; nodes];
        let mut least = vec![f64::INFINITY; nodes];
        let mut queue = BinaryHeap::new();
        for anchor in anchors {
            least[anchor.node] = 0.0;
            // Anchors come before everything else: their distance is less than any.
            queue.push(Reached { variance: -1.0, node: anchor.node as u32 });
        }
        while let Some(Reached { variance: so_far, node }) = queue.pop() {
            if so_far > least[node as usize] {
                continue;
            }
            order.push(node);
            let so_far = so_far.max(0.0);
            for end in adjacency.ends(node as usize) {
                let through = so_far + variance(end.spring);
                if through < least[end.node as usize] {
                    least[end.node as usize] = through;
                    parent[end.node as usize] = End { node, spring: end.spring };
                    queue.push(Reached { variance: through, node: end.node });
                }
            }
        }
        debug_assert_eq!(order.len(), nodes, "every component has an anchor");
        Self { order, parent }
    }
}

/// A node in the queue of Dijkstra's search.
#[derive(Debug, PartialEq)]
struct Reached {
    variance: f64,
    node: u32,
}

impl Eq for Reached {}

impl Ord for Reached {
    /// The nearest first, then the lowest number.
    fn cmp(&self, other: &Self) -> Ordering {
        other.variance.total_cmp(&self.variance).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

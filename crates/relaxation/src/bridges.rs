//! Springs that are part of no loop.

use crate::network::Network;

/// The springs whose loss would part the map (Tarjan 1974), ascending: no loop goes through them, so nothing checks them.
///
/// A robust estimator must not soften them: their residual is zero whatever they measured, and without them the map falls
/// apart. Springs of weight zero and self-springs are not counted; of parallel springs none is a bridge.
#[must_use]
pub fn bridges(network: &Network) -> Vec<usize> {
    let ends = network.springs().iter().enumerate().map(|(index, spring)| {
        // A spring without weight joins nothing, as a loop at one node does.
        (spring.from, if network.weight(index) > 0.0 { spring.to } else { spring.from })
    });
    let bridge = are_bridges(network.len(), &ends.collect::<Vec<_>>());
    (0..bridge.len()).filter(|&spring| bridge[spring]).collect()
}

const NONE: usize = usize::MAX;

/// For each of `ends` whether it is a bridge: the only connection between two parts of the graph.
///
/// A loop from a node to itself is none; of two parallel springs neither is.
pub(crate) fn are_bridges(nodes: usize, ends: &[(usize, usize)]) -> Vec<bool> {
    let mut starts = vec![0usize; nodes + 1];
    for &(a, b) in ends {
        starts[a + 1] += 1;
        starts[b + 1] += 1;
    }
    for node in 0..nodes {
        starts[node + 1] += starts[node];
    }
    let mut fill = starts.clone();
    let mut incident = vec![0usize; starts[nodes]];
    for (edge, &(a, b)) in ends.iter().enumerate() {
        for node in [a, b] {
            incident[fill[node]] = edge;
            fill[node] += 1;
        }
    }
    let mut bridge = vec![false; ends.len()];
    let (mut seen_at, mut low) = (vec![NONE; nodes], vec![NONE; nodes]);
    let mut next = starts.clone();
    let mut clock = 0;
    for root in 0..nodes {
        if seen_at[root] != NONE {
            continue;
        }
        // Depth first, with an own stack: chains of a million nodes are common.
        let mut stack = vec![(root, NONE)];
        (seen_at[root], low[root]) = (clock, clock);
        clock += 1;
        while let Some(&(node, by)) = stack.last() {
            if next[node] < starts[node + 1] {
                let edge = incident[next[node]];
                next[node] += 1;
                let (a, b) = ends[edge];
                let other = if a == node { b } else { a };
                if edge == by || other == node {
                    continue;
                }
                if seen_at[other] == NONE {
                    (seen_at[other], low[other]) = (clock, clock);
                    clock += 1;
                    stack.push((other, edge));
                } else {
                    low[node] = low[node].min(seen_at[other]);
                }
            } else {
                stack.pop();
                if let Some(&(parent, _)) = stack.last() {
                    low[parent] = low[parent].min(low[node]);
                    bridge[by] = low[node] > seen_at[parent];
                }
            }
        }
    }
    bridge
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn components(nodes: usize, ends: &[(usize, usize)], without: usize) -> usize {
        let mut set: Vec<usize> = (0..nodes).collect();
        for (k, &(a, b)) in ends.iter().enumerate().filter(|(k, _)| *k != without) {
            let _ = k;
            let (a, b) = (set[a], set[b]);
            set.iter_mut().filter(|s| **s == a).for_each(|s| *s = b);
        }
        set.sort_unstable();
        set.dedup();
        set.len()
    }

    proptest! {
        #[test]
        fn a_bridge_is_what_taking_it_out_splits(ends in proptest::collection::vec((0usize..9, 0usize..9), 0..14)) {
            let bridge = are_bridges(9, &ends);
            for (k, is_bridge) in bridge.iter().enumerate() {
                prop_assert_eq!(*is_bridge, components(9, &ends, k) > components(9, &ends, usize::MAX));
            }
        }
    }

    #[test]
    fn a_chain_of_a_million_is_walked_without_recursion() {
        let ends: Vec<_> = (0..1_000_000).map(|k| (k, k + 1)).collect();
        assert!(are_bridges(1_000_001, &ends).into_iter().all(|b| b));
    }
}

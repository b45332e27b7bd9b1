use std::collections::BTreeMap;

use relaxation::Network;

/// The springs that are part of no loop, each with the number of nodes on its smaller side.
///
/// A bridge belongs to every spanning tree, and in any of them the nodes behind it are those of its subtree.
pub(super) fn beyond(network: &Network) -> BTreeMap<usize, usize> {
    let bridges = relaxation::bridges(network);
    let tree = Tree::of(network);
    let size = |spring: usize| {
        let s = network.springs()[spring];
        let below = if tree.parent[s.to] == Some(s.from) { s.to } else { s.from };
        let whole = tree.behind[tree.root[below]];
        tree.behind[below].min(whole - tree.behind[below])
    };
    bridges.into_iter().map(|spring| (spring, size(spring))).collect()
}

/// A spanning tree of every component.
struct Tree {
    parent: Vec<Option<usize>>,
    root: Vec<usize>,
    /// Nodes of the subtree of each node, itself among them.
    behind: Vec<usize>,
}

impl Tree {
    fn of(network: &Network) -> Self {
        let n = network.len();
        let mut neighbors = vec![Vec::new(); n];
        for spring in network.springs() {
            neighbors[spring.from].push(spring.to);
            neighbors[spring.to].push(spring.from);
        }
        let mut tree = Self { parent: vec![None; n], root: (0..n).collect(), behind: vec![1; n] };
        let mut order: Vec<usize> = Vec::with_capacity(n);
        let mut seen = vec![false; n];
        for start in 0..n {
            let mut next = order.len();
            if !std::mem::replace(&mut seen[start], true) {
                order.push(start);
            }
            while let Some(&node) = order.get(next) {
                next += 1;
                for &there in &neighbors[node] {
                    if !std::mem::replace(&mut seen[there], true) {
                        (tree.parent[there], tree.root[there]) = (Some(node), start);
                        order.push(there);
                    }
                }
            }
        }
        for &node in order.iter().rev() {
            if let Some(parent) = tree.parent[node] {
                tree.behind[parent] += tree.behind[node];
            }
        }
        tree
    }
}

#[cfg(test)]
mod tests {
    use relaxation::Spring;
    use relaxation::nalgebra::Vector2;

    use super::*;

    #[test]
    fn a_corridor_between_two_rooms_holds_the_smaller_one() {
        let step = |from, to| Spring::isotropic(from, to, Vector2::x(), 1.0);
        // A triangle 0 1 2, a corridor 2 3, a square 3 4 5 6, a dead end 6 7; and two nodes of their own.
        let springs = [(0, 1), (1, 2), (2, 0), (3, 2), (3, 4), (4, 5), (5, 6), (6, 3), (6, 7), (9, 8)];
        let network = Network::new(10, &springs.map(|(from, to)| step(from, to))).unwrap();
        assert_eq!(beyond(&network), BTreeMap::from([(3, 3), (8, 1), (9, 1)]));
    }
}

//! Connected components, each with its anchor.

use nalgebra::Point2;

use super::{Anchor, NetworkError, is_finite};

/// Which component each node is in, and what holds each component.
#[derive(Debug, Clone)]
pub(super) struct Components {
    /// Component of each node; numbered by lowest node.
    pub(super) of_node: Vec<u32>,
    /// One per component, in that order.
    pub(super) anchors: Vec<Anchor>,
}

impl Components {
    /// Finds the components (disjoint sets, the lowest node of a set at its root) and anchors each at its lowest node.
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    pub(super) fn new(nodes: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut root: Vec<u32> = (0..nodes as u32).collect();
        for (a, b) in pairs {
            let (a, b) = (find(&mut root, a as u32), find(&mut root, b as u32));
            root[a.max(b) as usize] = a.min(b);
        }
        let mut anchors = Vec::new();
        for node in 0..nodes {
            // The root of a set is its lowest node, so it was renamed to its component's number before its members are.
            root[node] = if root[node] as usize == node {
                anchors.push(Anchor { node, position: Point2::origin() });
                anchors.len() as u32 - 1
            } else {
                root[root[node] as usize]
            };
        }
        Self { of_node: root, anchors }
    }

    /// With some anchors chosen by the caller.
    pub(super) fn with_anchors(mut self, chosen: &[Anchor]) -> Result<Self, NetworkError> {
        let mut taken: Vec<Option<usize>> = vec![None; self.anchors.len()];
        for &anchor in chosen {
            let Anchor { node, position } = anchor;
            if node >= self.of_node.len() {
                return Err(NetworkError::AnchorOutOfRange { node, nodes: self.of_node.len() });
            }
            if !is_finite(&position) {
                return Err(NetworkError::AnchorNotFinite { node, x: position.x, y: position.y });
            }
            let component = self.of_node[node] as usize;
            if let Some(first) = taken[component].replace(node) {
                return Err(NetworkError::TwoAnchors { first, second: node });
            }
            self.anchors[component] = anchor;
        }
        Ok(self)
    }

    /// With the anchors of the network this one came from. Where two of them meet (a spring that had been weighted away
    /// is back), the one of the lower component stays.
    pub(super) fn inheriting(mut self, old: &[Anchor]) -> Self {
        for &anchor in old.iter().rev() {
            let component = self.of_node[anchor.node] as usize;
            self.anchors[component] = anchor;
        }
        self
    }
}

/// The root of a node's set, halving the path on the way.
fn find(root: &mut [u32], mut node: u32) -> u32 {
    while root[node as usize] != node {
        let up = root[root[node as usize] as usize];
        root[node as usize] = up;
        node = up;
    }
    node
}

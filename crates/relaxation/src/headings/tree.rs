//! Spanning forests: which edges carry dead reckoning.

use std::collections::VecDeque;

const NONE: u32 = u32::MAX;

/// The two ends of an edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Joint {
    pub(crate) from: u32,
    pub(crate) to: u32,
}

impl Joint {
    #[expect(clippy::cast_possible_truncation, reason = "callers have checked that there are fewer than 2^32 nodes")]
    pub(crate) fn new(from: usize, to: usize) -> Self {
        Self { from: from as u32, to: to as u32 }
    }
}

/// One step of a walk over a forest, away from the root.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    /// Where it comes from.
    pub(crate) parent: usize,
    /// Where it goes.
    pub(crate) child: usize,
    /// The edge it takes.
    pub(crate) edge: usize,
    /// The edge leads from parent to child.
    pub(crate) forward: bool,
}

/// A spanning forest, rooted at the lowest node of each component unless told otherwise.
#[derive(Debug, Clone)]
pub(crate) struct Forest {
    root: Vec<u32>,
    /// Every node but the roots once, parents first.
    steps: Vec<Step>,
}

impl Forest {
    /// Shortest paths by number of edges, so that errors have few steps to gather in.
    pub(crate) fn breadth_first(nodes: usize, joints: &[Joint]) -> Self {
        Self::walk(nodes, joints, |_| true, |_| false)
    }

    /// Dead reckoning: edges between successive nodes first, then the others in their order; an edge that would close a cycle is left out.
    pub(crate) fn odometry(nodes: usize, joints: &[Joint], is_root: impl Fn(usize) -> bool) -> Self {
        let class = |edge: usize| usize::from(joints[edge].from.abs_diff(joints[edge].to) != 1);
        Self::preferring(nodes, joints, 2, class, is_root)
    }

    /// Only these edges; those that would close a cycle are left out. Where they do not reach, there are several trees.
    pub(crate) fn only(nodes: usize, joints: &[Joint], may_use: impl Fn(usize) -> bool) -> Self {
        Self::preferring(nodes, joints, 1, |edge| usize::from(!may_use(edge)), |_| false)
    }

    /// Edges of class 0 first, in their order, then those of class 1 and so on; an edge that would close a cycle is left out, as is one of
    /// no class below `classes`.
    pub(crate) fn preferring(
        nodes: usize,
        joints: &[Joint],
        classes: usize,
        class: impl Fn(usize) -> usize,
        is_root: impl Fn(usize) -> bool,
    ) -> Self {
        let mut sets: Vec<u32> = (0..Joint::new(nodes, 0).from).collect();
        let mut chosen = vec![false; joints.len()];
        for current in 0..classes {
            for (edge, joint) in joints.iter().enumerate().filter(|(edge, _)| class(*edge) == current) {
                let (a, b) = (find(&mut sets, joint.from), find(&mut sets, joint.to));
                if a != b {
                    sets[a.max(b) as usize] = a.min(b);
                    chosen[edge] = true;
                }
            }
        }
        Self::walk(nodes, joints, |edge| chosen[edge], is_root)
    }

    fn walk(nodes: usize, joints: &[Joint], use_edge: impl Fn(usize) -> bool, is_root: impl Fn(usize) -> bool) -> Self {
        let mut starts = vec![0usize; nodes + 1];
        let used = || joints.iter().enumerate().filter(|(edge, joint)| use_edge(*edge) && joint.from != joint.to);
        for (_, joint) in used() {
            starts[joint.from as usize + 1] += 1;
            starts[joint.to as usize + 1] += 1;
        }
        for node in 0..nodes {
            starts[node + 1] += starts[node];
        }
        let mut fill = starts.clone();
        let mut ends = vec![0usize; starts[nodes]];
        for (edge, joint) in used() {
            for node in [joint.from, joint.to] {
                ends[fill[node as usize]] = edge;
                fill[node as usize] += 1;
            }
        }
        let mut forest = Self { root: vec![NONE; nodes], steps: Vec::with_capacity(nodes) };
        let mut queue = VecDeque::new();
        let chosen = (0..nodes).filter(|node| is_root(*node));
        for seed in chosen.chain(0..nodes) {
            if forest.root[seed] != NONE {
                continue;
            }
            let root = Joint::new(seed, 0).from;
            forest.root[seed] = root;
            queue.push_back(seed);
            while let Some(parent) = queue.pop_front() {
                for &edge in &ends[starts[parent]..starts[parent + 1]] {
                    let joint = joints[edge];
                    let forward = joint.from as usize == parent;
                    let child = if forward { joint.to } else { joint.from } as usize;
                    if forest.root[child] == NONE {
                        forest.root[child] = root;
                        forest.steps.push(Step { parent, child, edge, forward });
                        queue.push_back(child);
                    }
                }
            }
        }
        forest
    }

    /// The root of a node's tree.
    pub(crate) fn root_of(&self, node: usize) -> usize {
        self.root[node] as usize
    }

    /// All roots in ascending order.
    pub(crate) fn roots(&self) -> impl Iterator<Item = usize> + '_ {
        self.root.iter().enumerate().filter(|(node, root)| **root as usize == *node).map(|(node, _)| node)
    }

    /// The walk from the roots outward.
    pub(crate) fn steps(&self) -> &[Step] {
        &self.steps
    }
}

fn find(sets: &mut [u32], mut node: u32) -> u32 {
    while sets[node as usize] != node {
        sets[node as usize] = sets[sets[node as usize] as usize];
        node = sets[node as usize];
    }
    node
}

//! Which nodes are free, and where the blocks of their matrix lie: shared by headings, positions and poses of one graph.

use std::sync::Arc;

use crate::block_cholesky::{BlockCholesky, Slot, Symbolic};

const HELD: u32 = u32::MAX;

/// The free nodes of a graph in the order of their numbers, and the analysed pattern of their matrix.
#[derive(Debug, Clone)]
pub(crate) struct Unknowns {
    of_node: Vec<u32>,
    symbolic: Arc<Symbolic>,
    diagonal: Vec<Slot>,
    /// For each edge the place of its off-diagonal block (row `from`, column `to`), if both ends are free and differ.
    pair: Vec<Option<Slot>>,
}

impl Unknowns {
    pub(crate) fn new(
        nodes: usize,
        is_held: impl Fn(usize) -> bool,
        edges: impl Iterator<Item = (usize, usize)> + Clone,
    ) -> Self {
        let mut of_node = vec![HELD; nodes];
        let mut count = 0;
        for (node, unknown) in of_node.iter_mut().enumerate() {
            if !is_held(node) {
                *unknown = count;
                count += 1;
            }
        }
        let free = edges.clone().map(|(i, j)| (of_node[i], of_node[j])).filter(|(i, j)| *i != HELD && *j != HELD);
        let symbolic = Symbolic::new(count as usize, free);
        let diagonal = (0..count as usize).map(|node| symbolic.diagonal(node)).collect();
        let pair = edges
            .map(|(i, j)| {
                let (i, j) = (of_node[i], of_node[j]);
                (i != HELD && j != HELD && i != j).then(|| symbolic.slot(i as usize, j as usize))
            })
            .collect();
        Self { of_node, symbolic: Arc::new(symbolic), diagonal, pair }
    }

    /// How many nodes are free.
    pub(crate) fn count(&self) -> usize {
        self.diagonal.len()
    }

    /// The number of a node among the free ones.
    #[inline(always)]
    pub(crate) fn of(&self, node: usize) -> Option<usize> {
        let unknown = self.of_node[node];
        (unknown != HELD).then_some(unknown as usize)
    }

    /// Where the diagonal block of a free node lies.
    #[inline(always)]
    pub(crate) fn diagonal(&self, unknown: usize) -> Slot {
        self.diagonal[unknown]
    }

    /// Where the block of an edge lies (row: its first node, column: its second), if it has one.
    #[inline(always)]
    pub(crate) fn pair(&self, edge: usize) -> Option<Slot> {
        self.pair[edge]
    }

    /// An empty matrix with blocks of this size.
    pub(crate) fn matrix(&self, block: usize) -> BlockCholesky {
        BlockCholesky::new(Arc::clone(&self.symbolic), block)
    }
}

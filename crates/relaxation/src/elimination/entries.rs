//! The springs of a core in the order of elimination, as the fronts gather them.

use super::compliance::Compliance;
use super::dissection::Order;
use super::graph::{Graph, Springs};

/// The lower triangle of the matrix, column by column: all that is needed of a core once its order is known.
#[derive(Debug, Clone)]
pub(super) struct Entries<C> {
    /// The entries of position `p` are those from `start[p]` to `start[p + 1]`.
    start: Vec<u32>,
    entries: Vec<Entry<C>>,
}

/// What one column holds in one row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry<C> {
    /// The position of the row: that of the column for its diagonal, or [`GROUND`].
    pub(super) row: u32,
    pub(super) stiffness: C,
}

/// The row of springs that end at an anchor.
pub(super) const GROUND: u32 = u32::MAX;

impl<C: Compliance> Entries<C> {
    /// With `WIDTH` 1 the diagonal is left out, for it follows from the rest; with 2 it comes first and anchors are in it.
    #[expect(clippy::cast_possible_truncation, reason = "a core has no more edges than the network has springs")]
    pub(super) fn new<const WIDTH: usize>(graph: &Graph<C>, order: &Order) -> Self {
        let mut start = Vec::with_capacity(order.node.len() + 1);
        let mut entries = Vec::with_capacity(graph.edges.len() + if WIDTH == 2 { order.node.len() } else { 0 });
        for (position, &node) in (0_u32..).zip(&order.node) {
            start.push(entries.len() as u32);
            let ends = graph.ends(node as usize);
            let stiffness = |spring: u32| graph.edges[spring as usize].compliance.stiffness();
            if WIDTH == 2 {
                let all = |row, column| ends.iter().map(|end| stiffness(end.spring).entry(row, column)).sum();
                entries.push(Entry { row: position, stiffness: C::from_entries(all) });
            }
            for end in ends {
                let row = order.position[end.node as usize];
                if row > position && (WIDTH == 1 || row != GROUND) {
                    entries.push(Entry { row, stiffness: stiffness(end.spring) });
                }
            }
        }
        start.push(entries.len() as u32);
        Self { start, entries }
    }

    /// The entries of one column.
    #[inline(always)]
    pub(super) fn of(&self, position: u32) -> &[Entry<C>] {
        &self.entries[self.start[position as usize] as usize..self.start[position as usize + 1] as usize]
    }
}

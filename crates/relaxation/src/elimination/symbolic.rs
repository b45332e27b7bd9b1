//! Where the factor has entries: the rows below each supernode.

use super::compliance::Compliance;
use super::dissection::{Order, Supernode};
use super::graph::{Graph, Springs};

/// The pattern of the factor, in units of nodes.
#[derive(Debug, Clone)]
pub(crate) struct Symbolic {
    /// Children before parents.
    pub(crate) supernodes: Vec<Supernode>,
    /// The rows below supernode `s` are `rows[row_start[s]..row_start[s + 1]]`: positions, ascending.
    row_start: Vec<u32>,
    rows: Vec<u32>,
}

impl Symbolic {
    /// Bottom up: what the children of a supernode leave behind, and its own springs, less its own columns.
    #[expect(clippy::cast_possible_truncation, reason = "the pattern is counted in 32 bits, as the nodes are")]
    pub(crate) fn new<C: Compliance>(graph: &Graph<C>, order: &Order) -> Self {
        let mut pattern = Self {
            supernodes: order.supernodes.clone(),
            row_start: vec![0],
            rows: Vec::with_capacity(4 * graph.nodes),
        };
        let mut open: Vec<u32> = Vec::new();
        let (mut merged, mut other) = (Vec::new(), Vec::new());
        for (id, supernode) in (0_u32..).zip(&order.supernodes) {
            merged.clear();
            while let Some(&child) = open.last().filter(|&&c| order.supernodes[c as usize].parent == id) {
                open.pop();
                merge(&merged, pattern.rows_from(child, supernode.end), &mut other);
                std::mem::swap(&mut merged, &mut other);
            }
            let inside = merged.len();
            for &node in &order.node[supernode.first as usize..supernode.end as usize] {
                let positions = graph.ends(node as usize).iter().map(|end| order.position[end.node as usize]);
                merged.extend(positions.filter(|&p| p >= supernode.end && p != u32::MAX));
            }
            if merged.len() > inside {
                merged.sort_unstable();
                merged.dedup();
            }
            pattern.rows.extend_from_slice(&merged);
            pattern.row_start.push(pattern.rows.len() as u32);
            open.push(id);
        }
        pattern
    }

    /// Where the columns of each supernode begin when they are stored one after the other, and at the end their length.
    pub(super) fn value_start<const WIDTH: usize>(&self) -> Vec<usize> {
        let mut start = Vec::with_capacity(self.supernodes.len() + 1);
        let mut total = 0;
        for (id, supernode) in self.supernodes.iter().enumerate() {
            start.push(total);
            let columns = (supernode.end - supernode.first) as usize * WIDTH;
            total += columns * (columns + self.rows(id).len() * WIDTH);
        }
        start.push(total);
        start
    }

    /// About how many multiplications the factorisation takes.
    #[expect(clippy::cast_precision_loss, reason = "an estimate")]
    pub(crate) fn work<const WIDTH: usize>(&self) -> f64 {
        let front = |(id, s): (usize, &Supernode)| {
            let (columns, rows) = ((s.end - s.first) as usize * WIDTH, self.rows(id).len() * WIDTH);
            let (columns, rows) = (columns as f64, rows as f64);
            columns * (columns * columns / 6.0 + columns * rows / 2.0 + rows * rows / 2.0)
        };
        self.supernodes.iter().enumerate().map(front).sum()
    }

    /// How many ancestors each supernode has.
    pub(super) fn depths(&self) -> Vec<u32> {
        let mut depth = vec![0; self.supernodes.len()];
        for (id, supernode) in self.supernodes.iter().enumerate().rev() {
            if supernode.parent != u32::MAX {
                depth[id] = depth[supernode.parent as usize] + 1;
            }
        }
        depth
    }

    /// The rows below the columns of a supernode.
    #[inline]
    pub(crate) fn rows(&self, supernode: usize) -> &[u32] {
        &self.rows[self.row_start[supernode] as usize..self.row_start[supernode + 1] as usize]
    }

    /// The rows of `child` that are not eliminated before `end`.
    fn rows_from(&self, child: u32, end: u32) -> &[u32] {
        let rows = self.rows(child as usize);
        &rows[rows.partition_point(|&row| row < end)..]
    }
}

/// Merges two ascending lists into a third.
fn merge(a: &[u32], b: &[u32], into: &mut Vec<u32>) {
    into.clear();
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        let (x, y) = (a[i], b[j]);
        into.push(x.min(y));
        i += usize::from(x <= y);
        j += usize::from(y <= x);
    }
    into.extend_from_slice(&a[i..]);
    into.extend_from_slice(&b[j..]);
}

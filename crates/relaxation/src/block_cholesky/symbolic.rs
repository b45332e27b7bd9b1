//! The pattern: fill-reducing order, elimination tree, supernodes, and where each block lies.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

const NONE: u32 = u32::MAX;

/// Columns that share one dense panel, and the rows below them.
#[derive(Debug, Clone)]
pub(super) struct Supernode {
    /// First column; the last is one before the next supernode's first.
    pub(super) first: usize,
    /// Number of columns.
    pub(super) columns: usize,
    /// Where its rows below the columns begin and end in [`Symbolic::rows`].
    pub(super) rows: std::ops::Range<usize>,
    /// Where its panel begins, in blocks.
    pub(super) panel: usize,
    /// The supernode its update goes to.
    pub(super) parent: Option<usize>,
}

impl Supernode {
    /// Rows of the panel, in blocks.
    pub(super) fn height(&self) -> usize {
        self.columns + self.rows.len()
    }
}

/// Where a block of the matrix lies in the panels, whatever the block size.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slot {
    /// Blocks before the block column in the panels.
    pub(super) column_start: usize,
    /// Block row in its panel.
    pub(super) row: u32,
    /// Block rows of its panel.
    pub(super) height: u32,
    /// The block belongs to the lower triangle as its transpose.
    pub(crate) transposed: bool,
}

/// An analysed block pattern.
#[derive(Debug, Clone)]
pub(crate) struct Symbolic {
    /// Place of each node in the order of elimination.
    pub(super) place: Vec<u32>,
    pub(super) supernodes: Vec<Supernode>,
    /// Row places of all supernodes, ascending within each.
    pub(super) rows: Vec<u32>,
    /// For each of these rows its block row in the front of the parent.
    pub(super) in_parent: Vec<u32>,
    super_of: Vec<u32>,
    /// Blocks in all panels.
    pub(super) blocks: usize,
}

impl Symbolic {
    /// Orders and analyses the graph of `nodes` nodes and `edges` (each without its reverse; repetitions and loops do no harm).
    pub(crate) fn new(nodes: usize, edges: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let neighbors = Neighbors::new(nodes, edges);
        let amd_place = minimum_degree(&neighbors);
        let (parent, counts) = elimination_tree(&neighbors, &amd_place);
        let post = postorder(&parent, &counts);
        let mut place = vec![0; nodes];
        for (node, amd) in amd_place.iter().enumerate() {
            place[node] = post[*amd as usize];
        }
        let mut tree = vec![NONE; nodes];
        let mut heights = vec![0; nodes];
        for old in 0..nodes {
            let new = post[old] as usize;
            heights[new] = counts[old];
            tree[new] = if parent[old] == NONE { NONE } else { post[parent[old] as usize] };
        }
        let starts = amalgamated(&tree, &heights);
        Self::with_supernodes(place, &starts, &neighbors)
    }

    fn with_supernodes(place: Vec<u32>, starts: &[usize], neighbors: &Neighbors) -> Self {
        let nodes = place.len();
        let node_at = inverse(&place);
        let mut super_of = vec![0u32; nodes];
        let mut this = Self {
            place,
            supernodes: Vec::with_capacity(starts.len()),
            rows: vec![],
            in_parent: vec![],
            super_of: vec![],
            blocks: 0,
        };
        let mut first_child = vec![NONE; starts.len()];
        let mut next_sibling = vec![NONE; starts.len()];
        let mut mark = vec![NONE; nodes];
        for (s, &first) in (0u32..).zip(starts) {
            let end = starts.get(s as usize + 1).copied().unwrap_or(nodes);
            super_of[first..end].fill(s);
            let begin = this.rows.len();
            let mut add = |rows: &mut Vec<u32>, row: u32| {
                if row as usize >= end && mark[row as usize] != s {
                    mark[row as usize] = s;
                    rows.push(row);
                }
            };
            for node in &node_at[first..end] {
                for other in neighbors.of(*node as usize) {
                    add(&mut this.rows, this.place[*other as usize]);
                }
            }
            let mut child = first_child[s as usize];
            while child != NONE {
                for at in this.supernodes[child as usize].rows.clone() {
                    let row = this.rows[at];
                    add(&mut this.rows, row);
                }
                child = next_sibling[child as usize];
            }
            this.rows[begin..].sort_unstable();
            let rows = begin..this.rows.len();
            let columns = end - first;
            // The supernode of the first row below takes the update; it comes later, so its number is found by its first column.
            let parent = this.rows.get(begin).map(|row| starts.partition_point(|start| *start <= *row as usize) - 1);
            if let Some(parent) = parent {
                next_sibling[s as usize] = first_child[parent];
                first_child[parent] = s;
            }
            let node = Supernode { first, columns, rows, panel: this.blocks, parent };
            this.blocks += columns * node.height();
            this.supernodes.push(node);
        }
        this.super_of = super_of;
        this.in_parent = this.places_in_parents();
        this
    }

    /// For each row below a supernode: which row of its parent, own columns first, it is.
    fn places_in_parents(&self) -> Vec<u32> {
        let mut places = vec![0; self.rows.len()];
        for node in &self.supernodes {
            let Some(parent) = node.parent.map(|parent| &self.supernodes[parent]) else { continue };
            let mut below = parent.rows.start;
            for at in node.rows.clone() {
                let row = self.rows[at] as usize;
                places[at] = if row < parent.first + parent.columns {
                    index(row - parent.first)
                } else {
                    // Both lists of rows ascend, so one pass finds all.
                    below += self.rows[below..].iter().take_while(|other| (**other as usize) < row).count();
                    index(parent.columns + below - parent.rows.start)
                };
            }
        }
        places
    }

    /// Where the diagonal block of `node` lies.
    pub(crate) fn diagonal(&self, node: usize) -> Slot {
        self.slot(node, node)
    }

    /// Where the block of row `i`, column `j` lies; the pair must have been among the edges.
    pub(crate) fn slot(&self, i: usize, j: usize) -> Slot {
        let (row, column) = (self.place[i] as usize, self.place[j] as usize);
        let (row, column, transposed) = if row < column { (column, row, true) } else { (row, column, false) };
        let node = &self.supernodes[self.super_of[column] as usize];
        let in_panel = if row < node.first + node.columns {
            row - node.first
        } else {
            let rows = &self.rows[node.rows.clone()];
            node.columns + rows.partition_point(|r| (*r as usize) < row)
        };
        Slot {
            column_start: node.panel + (column - node.first) * node.height(),
            row: index(in_panel),
            height: index(node.height()),
            transposed,
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the graph has fewer than 2^32 nodes, and so has every part of it")]
fn index(value: usize) -> u32 {
    value as u32
}

/// Adjacency lists without loops and repetitions.
struct Neighbors {
    starts: Vec<usize>,
    others: Vec<u32>,
}

impl Neighbors {
    fn new(nodes: usize, edges: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let edges = edges.filter(|(i, j)| i != j);
        let mut starts = vec![0usize; nodes + 1];
        for (i, j) in edges.clone() {
            starts[i as usize + 1] += 1;
            starts[j as usize + 1] += 1;
        }
        for node in 0..nodes {
            starts[node + 1] += starts[node];
        }
        let mut others = vec![0u32; starts[nodes]];
        let mut fill = starts.clone();
        for (i, j) in edges {
            for (a, b) in [(i, j), (j, i)] {
                others[fill[a as usize]] = b;
                fill[a as usize] += 1;
            }
        }
        // Sorted and compacted in place: a list never grows.
        let mut end = 0;
        for node in 0..nodes {
            let range = starts[node]..starts[node + 1];
            others[range.clone()].sort_unstable();
            starts[node] = end;
            let mut last = NONE;
            for at in range {
                if others[at] != last {
                    last = others[at];
                    others[end] = last;
                    end += 1;
                }
            }
        }
        starts[nodes] = end;
        others.truncate(end);
        Self { starts, others }
    }

    fn of(&self, node: usize) -> &[u32] {
        &self.others[self.starts[node]..self.starts[node + 1]]
    }
}

/// Approximate minimum degree (Amestoy, Davis & Duff 1996): the place of each node in the order of elimination.
fn minimum_degree(neighbors: &Neighbors) -> Vec<u32> {
    let nodes = neighbors.starts.len() - 1;
    let mut column_starts = vec![0u32; nodes + 1];
    let mut upper = Vec::with_capacity(neighbors.others.len() / 2);
    for node in 0..nodes {
        upper.extend(neighbors.of(node).iter().filter(|other| (**other as usize) < node));
        column_starts[node + 1] = index(upper.len());
    }
    let pattern = SymbolicSparseColMatRef::new_checked(nodes, nodes, &column_starts, None, &upper);
    let (mut order, mut place) = (vec![0u32; nodes], vec![0u32; nodes]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(nodes, upper.len()));
    let stack = MemStack::new(&mut memory);
    match amd::order(&mut order, &mut place, pattern, amd::Control::default(), stack) {
        Ok(_) => place,
        // Only when indices overflow 32 bits, which the callers exclude: any order is right, this one is just slow.
        Err(_) => (0..index(nodes)).collect(),
    }
}

/// The node at each place.
fn inverse(place: &[u32]) -> Vec<u32> {
    let mut node_at = vec![0; place.len()];
    for (node, place) in (0..).zip(place) {
        node_at[*place as usize] = node;
    }
    node_at
}

/// Parents in the elimination tree and the number of blocks below each diagonal block of the factor (Liu 1990).
fn elimination_tree(neighbors: &Neighbors, place: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let nodes = place.len();
    let node_at = inverse(place);
    let (mut parent, mut counts) = (vec![NONE; nodes], vec![0u32; nodes]);
    let mut mark = vec![NONE; nodes];
    for row in 0..index(nodes) {
        mark[row as usize] = row;
        for other in neighbors.of(node_at[row as usize] as usize) {
            let mut column = place[*other as usize];
            if column > row {
                continue;
            }
            while mark[column as usize] != row {
                if parent[column as usize] == NONE {
                    parent[column as usize] = row;
                }
                counts[column as usize] += 1;
                mark[column as usize] = row;
                column = parent[column as usize];
            }
        }
    }
    (parent, counts)
}

/// A postorder in which the child with the tallest column comes right before its parent; the new number of each node.
fn postorder(parent: &[u32], counts: &[u32]) -> Vec<u32> {
    let nodes = parent.len();
    let mut by_height: Vec<u32> = (0..index(nodes)).collect();
    by_height.sort_by_key(|node| counts[*node as usize]);
    // Pushed in ascending order, the tallest child ends at the head of its parent's list; walked head first onto a stack
    // that is emptied from its top, it comes last.
    let (mut head, mut next) = (vec![NONE; nodes], vec![NONE; nodes]);
    let mut roots = Vec::new();
    for node in by_height {
        let parent = parent[node as usize];
        if parent == NONE {
            roots.push(node);
        } else {
            next[node as usize] = head[parent as usize];
            head[parent as usize] = node;
        }
    }
    let mut post = vec![0; nodes];
    // Numbers are given from the end: a node before its children, the tallest child first.
    let mut number = nodes;
    let mut stack = roots;
    while let Some(node) = stack.pop() {
        number -= 1;
        post[node as usize] = index(number);
        let begin = stack.len();
        let mut child = head[node as usize];
        while child != NONE {
            stack.push(child);
            child = next[child as usize];
        }
        stack[begin..].reverse();
    }
    post
}

/// First columns of the supernodes: columns of one pattern together, and a supernode with the one after it where few zeros are stored for that.
fn amalgamated(tree: &[u32], heights: &[u32]) -> Vec<usize> {
    let nodes = tree.len();
    let follows = |column: usize| tree[column - 1] as usize == column;
    let mut starts: Vec<usize> =
        (0..nodes).filter(|&c| c == 0 || !follows(c) || heights[c - 1] != heights[c] + 1).collect();
    // From the last to the first, so that a merged supernode can take its own predecessor, too.
    let mut kept: Vec<(usize, usize, usize)> = Vec::with_capacity(starts.len()); // first column, columns, zeros
    for s in (0..starts.len()).rev() {
        let first = starts[s];
        let columns = starts.get(s + 1).copied().unwrap_or(nodes) - first;
        let merged = kept.last().and_then(|&(next, next_columns, next_zeros)| {
            if !follows(next) {
                return None;
            }
            let rows = heights[next] as usize + 1;
            let fresh = columns * (rows + columns - (heights[first] as usize + 1));
            let (all, zeros) = (columns + next_columns, next_zeros + fresh);
            let size = all * (all + 1) / 2 + all * (rows - next_columns.min(rows));
            worthwhile(all, zeros, size).then_some((first, all, zeros))
        });
        match merged {
            Some(merged) => *kept.last_mut().expect("there is one to merge with") = merged,
            None => kept.push((first, columns, 0)),
        }
    }
    starts.clear();
    starts.extend(kept.iter().rev().map(|k| k.0));
    starts
}

/// Whether fewer, larger fronts are worth the zeros they store; measured on graphs of rooms and streets with blocks of three.
fn worthwhile(columns: usize, zeros: usize, size: usize) -> bool {
    let share = zeros as f64 / size as f64;
    columns <= 3 || (columns <= 8 && share < 0.4) || (columns <= 24 && share < 0.12) || share < 0.05
}

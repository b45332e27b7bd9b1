//! Minimum degree inside a small set: what dissection leaves undivided.

/// A set of at most [`LARGEST`] nodes to be ordered, and the graph among them; everything about them fits into registers.
#[derive(Debug)]
pub(super) struct Block {
    /// Neighbours of each node, as bits: the nodes of the block below, those outside (eliminated later) above.
    pub(super) neighbours: [u128; LARGEST],
    pub(super) size: usize,
    degree: [u32; LARGEST],
    /// The degree of each node when it was eliminated.
    below: [u32; LARGEST],
}

/// The degree of a node that has been eliminated.
const GONE: u32 = u32::MAX;

/// The most nodes a block can hold. As many bits again number nodes outside; more of those need not be told apart.
pub(super) const LARGEST: usize = 64;

/// Zeros that may be stored in a supernode for the sake of fewer and wider ones.
const RELAXED: u32 = 6;

/// A supernode of a block: nodes to be eliminated together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group {
    /// How many nodes, the next ones in the order.
    pub(super) size: usize,
    /// The group that takes what this one leaves behind, or none inside the block.
    pub(super) parent: Option<usize>,
}

impl Default for Block {
    fn default() -> Self {
        Self { neighbours: [0; LARGEST], size: 0, degree: [GONE; LARGEST], below: [0; LARGEST] }
    }
}

/// The first place of the least number.
fn lowest(numbers: &[u32]) -> usize {
    let least = numbers.iter().copied().min().unwrap_or(0);
    numbers.iter().position(|&number| number == least).unwrap_or(0)
}

impl Block {
    /// Eliminates the nodes, always one with the fewest neighbours left, and returns them in postorder of the elimination
    /// tree, grouped into supernodes.
    pub(super) fn order(&mut self, order: &mut Vec<usize>, groups: &mut Vec<Group>) {
        let parent = self.eliminate();
        postorder(&parent[..self.size], order);
        self.group(order, &parent, groups);
    }

    /// Afterwards `neighbours[v]` holds those of `v` when it was eliminated; returns the first of them to follow.
    fn eliminate(&mut self) -> [Option<usize>; LARGEST] {
        let inside = (1_u128 << self.size) - 1;
        let mut left = inside;
        let mut rank = [0_usize; LARGEST];
        for v in 0..self.size {
            self.degree[v] = self.neighbours[v].count_ones();
        }
        for step in 0..self.size {
            let v = lowest(&self.degree[..self.size]);
            left &= !(1 << v);
            rank[v] = step;
            self.below[v] = self.degree[v];
            self.degree[v] = GONE;
            let clique = self.neighbours[v];
            for u in bits(clique & left) {
                self.neighbours[u] = (self.neighbours[u] | clique) & !(1 << u | 1 << v);
                self.degree[u] = self.neighbours[u].count_ones();
            }
        }
        let mut parent = [None; LARGEST];
        for (v, up) in parent[..self.size].iter_mut().enumerate() {
            *up = bits(self.neighbours[v] & inside).min_by_key(|&u| rank[u]);
        }
        parent
    }

    /// Joins each node with the one before it in postorder where that stores few zeros.
    fn group(&self, order: &[usize], parent: &[Option<usize>; LARGEST], groups: &mut Vec<Group>) {
        groups.clear();
        let mut group_of = [0; LARGEST];
        let mut zeros = 0;
        for (at, &v) in order.iter().enumerate() {
            let below = |v: usize| self.below[v];
            let joined = at.checked_sub(1).map(|before| order[before]).filter(|&before| parent[before] == Some(v));
            let cost = joined.zip(groups.last()).map(|(before, last)| {
                #[expect(clippy::cast_possible_truncation, reason = "at most 64")]
                let columns = last.size as u32;
                zeros + (below(v) + 1).saturating_sub(below(before)) * columns
            });
            match groups.last_mut() {
                Some(last) if cost.is_some_and(|cost| cost <= RELAXED) => {
                    last.size += 1;
                    zeros = cost.unwrap_or(0);
                }
                _ => {
                    groups.push(Group { size: 1, parent: None });
                    zeros = 0;
                }
            }
            group_of[v] = groups.len() - 1;
        }
        let mut last = 0;
        for group in groups.iter_mut() {
            last += group.size;
            group.parent = parent[order[last - 1]].map(|up| group_of[up]);
        }
    }
}

/// The numbers of the bits set, ascending.
fn bits(mut set: u128) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lowest = (set != 0).then(|| set.trailing_zeros() as usize);
        set &= set.wrapping_sub(1);
        lowest
    })
}

/// Children before parents, each subtree in one piece.
fn postorder(parent: &[Option<usize>], order: &mut Vec<usize>) {
    let mut child: [Option<usize>; LARGEST] = [None; LARGEST];
    let mut sibling: [Option<usize>; LARGEST] = [None; LARGEST];
    let mut root = None;
    for (v, up) in parent.iter().enumerate() {
        let first = up.map_or(&mut root, |up| &mut child[up]);
        sibling[v] = first.replace(v);
    }
    order.clear();
    let mut stack = Vec::with_capacity(LARGEST);
    let mut next = root;
    // Parents first, last child first; then the whole backwards.
    while let Some(v) = next {
        order.push(v);
        stack.extend(sibling[v]);
        next = child[v].or_else(|| stack.pop());
    }
    order.reverse();
}

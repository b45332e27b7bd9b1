//! Minimum degree inside a small set: what dissection leaves undivided.

/// Neighbours of a node of a block, as bits: nodes of the block, and nodes outside, which are eliminated later.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Neighbours {
    pub(super) inside: u64,
    /// Bit `n mod 64` stands for the `n`-th node outside: more of those need not be told apart.
    pub(super) outside: u64,
}

impl Neighbours {
    #[inline(always)]
    fn count(self) -> u32 {
        self.inside.count_ones() + self.outside.count_ones()
    }
}

/// A set of at most [`LARGEST`] nodes to be ordered, and the graph among them; everything about them fits into registers.
#[derive(Debug)]
pub(super) struct Block {
    /// Of each node; when it has been eliminated, those it had then.
    pub(super) neighbours: [Neighbours; LARGEST],
    pub(super) size: usize,
    degree: [u32; LARGEST],
    /// The nodes of each degree that have not been eliminated, as bits.
    of_degree: [u64; 2 * LARGEST + 1],
}

/// The most nodes a block can hold.
pub(super) const LARGEST: usize = 64;

/// Zeros that may be stored in a supernode for the sake of fewer and wider ones.
const RELAXED: u32 = 14;

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
        Self {
            neighbours: [Neighbours::default(); LARGEST],
            size: 0,
            degree: [0; LARGEST],
            of_degree: [0; 2 * LARGEST + 1],
        }
    }
}

/// The ordering as a task that is compiled for each set of instructions: it counts bits.
struct Ordering<'a> {
    block: &'a mut Block,
    order: &'a mut Vec<usize>,
    groups: &'a mut Vec<Group>,
}

impl pulp::WithSimd for Ordering<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let parent = self.block.eliminate();
        postorder(&parent[..self.block.size], self.order);
        self.block.group(self.order, &parent, self.groups);
    }
}

impl Block {
    /// Eliminates the nodes, always one with the fewest neighbours left, and returns them in postorder of the elimination
    /// tree, grouped into supernodes.
    pub(super) fn order(&mut self, order: &mut Vec<usize>, groups: &mut Vec<Group>) {
        pulp::Arch::new().dispatch(Ordering { block: self, order, groups });
    }

    /// Afterwards `neighbours[v]` holds those of `v` when it was eliminated, and `degree[v]` their number; returns the first of
    /// them to follow.
    #[inline(always)]
    fn eliminate(&mut self) -> [Option<usize>; LARGEST] {
        #[expect(clippy::cast_possible_truncation, reason = "at most 64")]
        let mut left = u64::MAX.checked_shr((LARGEST - self.size) as u32).unwrap_or(0);
        let mut rank = [0_usize; LARGEST];
        self.of_degree.fill(0);
        for v in 0..self.size {
            self.degree[v] = self.neighbours[v].count();
            self.of_degree[self.degree[v] as usize] |= 1 << v;
        }
        let mut least = 0;
        for step in 0..self.size {
            while self.of_degree[least] == 0 {
                least += 1;
            }
            let v = self.of_degree[least].trailing_zeros() as usize;
            self.of_degree[least] &= !(1 << v);
            // A neighbour may lose the node just eliminated and gain none for it.
            least = least.saturating_sub(1);
            left &= !(1 << v);
            rank[v] = step;
            let clique = self.neighbours[v];
            for u in bits(clique.inside & left) {
                let neighbours = &mut self.neighbours[u];
                neighbours.inside = (neighbours.inside | clique.inside) & !(1 << u | 1 << v);
                neighbours.outside |= clique.outside;
                let degree = neighbours.count();
                self.of_degree[self.degree[u] as usize] &= !(1 << u);
                self.of_degree[degree as usize] |= 1 << u;
                self.degree[u] = degree;
            }
        }
        let mut parent = [None; LARGEST];
        for (v, up) in parent[..self.size].iter_mut().enumerate() {
            *up = bits(self.neighbours[v].inside).min_by_key(|&u| rank[u]);
        }
        parent
    }

    /// Joins each node with the one before it in postorder where that stores few zeros.
    #[inline(always)]
    fn group(&self, order: &[usize], parent: &[Option<usize>; LARGEST], groups: &mut Vec<Group>) {
        groups.clear();
        let mut group_of = [0; LARGEST];
        let mut zeros = 0;
        for (at, &v) in order.iter().enumerate() {
            let below = |v: usize| self.degree[v];
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
#[inline(always)]
fn bits(mut set: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lowest = (set != 0).then(|| set.trailing_zeros() as usize);
        set &= set.wrapping_sub(1);
        lowest
    })
}

/// Children before parents, each subtree in one piece.
#[inline(always)]
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

//! Multifrontal Cholesky of the core: `A = L Lᵀ`, supernode by supernode, children before parents.
//!
//! Where x and y share one scalar matrix (`WIDTH` 1, two right-hand sides at once), the matrix is a grounded Laplacian: what
//! is on the diagonal is the sum of what is beside it and of the coupling to the ground. The factorisation keeps that sum
//! instead of the diagonal (as Grassmann, Taksar & Heyman 1985 did for Markov chains), so it only ever adds numbers of one
//! sign: each entry of `L` is right to its last digits however far apart the stiffnesses are, and no pivot can fail.
//! With 2×2 covariances (`WIDTH` 2) the diagonal is kept as usual.

use super::compliance::Compliance;
use super::dense::{downdate_rest, factor_columns};
use super::dissection::{Order, Supernode};
use super::graph::{Graph, Springs};
use super::symbolic::Symbolic;

/// A factorised core with `WIDTH` unknowns per node: 1 where x and y share the matrix, else 2.
#[derive(Debug, Clone)]
pub(crate) struct Factor<const WIDTH: usize> {
    pub(crate) order: Order,
    pub(crate) symbolic: Symbolic,
    /// Where the block of each supernode begins in `values`, and at the end their length.
    pub(crate) value_start: Vec<usize>,
    /// The blocks, column-major: the columns of each supernode from its first row down, the diagonal inverted.
    pub(crate) values: Vec<f64>,
}

impl<const WIDTH: usize> Factor<WIDTH> {
    /// Factors the matrix of `graph` in the given order.
    pub(crate) fn new<C: Compliance>(graph: &Graph<C>, order: Order) -> Self {
        let mut factor = Self::planned(graph, order);
        factor.compute(graph);
        factor
    }

    /// The pattern of the factor, without its numbers.
    pub(crate) fn planned<C: Compliance>(graph: &Graph<C>, order: Order) -> Self {
        let symbolic = Symbolic::new(graph, &order);
        let mut value_start = Vec::with_capacity(symbolic.supernodes.len() + 1);
        let mut total = 0;
        for (id, s) in symbolic.supernodes.iter().enumerate() {
            value_start.push(total);
            let columns = (s.end - s.first) as usize * WIDTH;
            total += columns * (columns + symbolic.rows(id).len() * WIDTH);
        }
        value_start.push(total);
        Self { order, symbolic, value_start, values: Vec::new() }
    }

    /// About how many multiplications [`compute`](Self::compute) takes.
    #[expect(clippy::cast_precision_loss, reason = "an estimate")]
    pub(crate) fn work(&self) -> f64 {
        let supernodes = self.symbolic.supernodes.iter().enumerate();
        let fronts = supernodes.map(|(id, s)| (s.end - s.first, self.symbolic.rows(id).len()));
        let sizes = fronts.map(|(columns, rows)| (columns as f64 * WIDTH as f64, rows as f64 * WIDTH as f64));
        sizes
            .map(|(columns, rows)| columns * (columns * columns / 6.0 + columns * rows / 2.0 + rows * rows / 2.0))
            .sum()
    }

    /// Computes the numbers of the factor, with the best vector instructions of the machine, found at run time: everything
    /// below is inlined into this call.
    pub(crate) fn compute<C: Compliance>(&mut self, graph: &Graph<C>) {
        let total = self.value_start[self.symbolic.supernodes.len()];
        self.values = vec![0.0; total];
        pulp::Arch::new().dispatch(Compute { factor: self, graph });
    }

    /// The number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        self.order.node.len() * WIDTH
    }

    #[inline(always)]
    fn eliminate<C: Compliance>(&mut self, graph: &Graph<C>) {
        // What children leave to their parents lies on two stacks, one for even depths of the tree and one for odd: a
        // parent's remainder is made while its children's, on top of the other stack, are used up.
        let mut stacks = [Vec::new(), Vec::new()];
        let mut open: Vec<u32> = Vec::new();
        let depth = depths(&self.symbolic.supernodes);
        let mut grounded = vec![0.0; self.order.node.len()];
        let mut values = std::mem::take(&mut self.values);
        let mut map = Vec::new();
        for id in 0..depth.len() {
            let supernode = self.symbolic.supernodes[id];
            let (first, count) = (supernode.first as usize, (supernode.end - supernode.first) as usize);
            let rows = self.symbolic.rows(id);
            let columns = count * WIDTH;
            let stride = columns + rows.len() * WIDTH;
            let block = &mut values[self.value_start[id]..][..columns * stride];
            self.assemble(graph, id, block, &mut grounded);

            let [even, odd] = &mut stacks;
            let (own, children) = if depth[id].is_multiple_of(2) { (even, odd) } else { (odd, even) };
            let base = own.len();
            own.resize(base + (stride - columns).pow(2), 0.0);
            let rest = &mut own[base..];
            while let Some(child) = open.pop_if(|child| self.symbolic.supernodes[*child as usize].parent as usize == id)
            {
                let child_rows = self.symbolic.rows(child as usize);
                local_rows::<WIDTH>(child_rows, supernode.end, first, count, rows, &mut map);
                let from = children.len() - map.len().pow(2);
                extend_add(&children[from..], &map, block, stride, rest);
                children.truncate(from);
            }
            open.push(u32::try_from(id).expect("supernodes are counted in 32 bits"));

            factor_columns(block, stride, |k, column| {
                if WIDTH == 2 {
                    return column[0];
                }
                // What is beside the diagonal, and the ground; the ground's share of the column goes to the rows below.
                let ground = grounded[first + k];
                let pivot = ground - column[1..].iter().sum::<f64>();
                if ground != 0.0 {
                    let (beside, below) = column[1..].split_at(count - 1 - k);
                    let share = ground / pivot;
                    for (g, a) in grounded[first + k + 1..first + count].iter_mut().zip(beside) {
                        *g -= a * share;
                    }
                    for (&row, a) in rows.iter().zip(below) {
                        grounded[row as usize] -= a * share;
                    }
                }
                pivot
            });
            downdate_rest(rest, block, stride, columns);
        }
        self.values = values;
    }

    /// Writes the springs at the nodes of a supernode into its block, and their coupling to anchors into `grounded`.
    fn assemble<C: Compliance>(&self, graph: &Graph<C>, id: usize, block: &mut [f64], grounded: &mut [f64]) {
        let supernode = self.symbolic.supernodes[id];
        let rows = self.symbolic.rows(id);
        let count = (supernode.end - supernode.first) as usize;
        let stride = (count + rows.len()) * WIDTH;
        for (column, position) in (supernode.first..supernode.end).enumerate() {
            for end in graph.ends(self.order.node[position as usize] as usize) {
                let stiffness = graph.edges[end.spring as usize].compliance.stiffness();
                let other = self.order.position[end.node as usize];
                if WIDTH == 2 {
                    add_entries::<WIDTH, C>(block, stride, (column, column), stiffness, 1.0);
                } else if other == u32::MAX {
                    grounded[position as usize] += stiffness.entry(0, 0);
                }
                if other <= position || other == u32::MAX {
                    continue;
                }
                let row = if other < supernode.end {
                    (other - supernode.first) as usize
                } else {
                    count + rows.partition_point(|&r| r < other)
                };
                add_entries::<WIDTH, C>(block, stride, (row, column), stiffness, -1.0);
            }
        }
    }

    /// Solves `L Lᵀ x = b` in place, `x` in the order of elimination.
    pub(crate) fn solve<const SIDES: usize>(&self, x: &mut [[f64; SIDES]]) {
        let mut below = Vec::new();
        for id in 0..self.symbolic.supernodes.len() {
            self.forward(id, x, &mut below);
        }
        for id in (0..self.symbolic.supernodes.len()).rev() {
            self.backward(id, x, &mut below);
        }
    }

    /// The part of `L y = b` that belongs to one supernode.
    #[inline]
    pub(crate) fn forward<const SIDES: usize>(&self, id: usize, x: &mut [[f64; SIDES]], below: &mut Vec<[f64; SIDES]>) {
        let supernode = self.symbolic.supernodes[id];
        let (first, end) = (supernode.first as usize * WIDTH, supernode.end as usize * WIDTH);
        let rows = self.symbolic.rows(id);
        let columns = end - first;
        let stride = columns + rows.len() * WIDTH;
        let block = &self.values[self.value_start[id]..][..columns * stride];
        below.clear();
        below.resize(rows.len() * WIDTH, [0.0; SIDES]);
        for (k, column) in block.chunks_exact(stride).enumerate() {
            let y = x[first + k].map(|v| v * column[k]);
            x[first + k] = y;
            for (t, l) in x[first + k + 1..end].iter_mut().zip(&column[k + 1..columns]) {
                subtract(t, *l, &y);
            }
            for (t, l) in below.iter_mut().zip(&column[columns..]) {
                subtract(t, *l, &y);
            }
        }
        for (&row, block) in rows.iter().zip(below.chunks_exact(WIDTH)) {
            for (c, value) in block.iter().enumerate() {
                let t = &mut x[row as usize * WIDTH + c];
                for side in 0..SIDES {
                    t[side] += value[side];
                }
            }
        }
    }

    /// The part of `Lᵀ x = y` that belongs to one supernode.
    #[inline]
    pub(crate) fn backward<const SIDES: usize>(
        &self,
        id: usize,
        x: &mut [[f64; SIDES]],
        below: &mut Vec<[f64; SIDES]>,
    ) {
        let supernode = self.symbolic.supernodes[id];
        let (first, end) = (supernode.first as usize * WIDTH, supernode.end as usize * WIDTH);
        let rows = self.symbolic.rows(id);
        let columns = end - first;
        let stride = columns + rows.len() * WIDTH;
        let block = &self.values[self.value_start[id]..][..columns * stride];
        below.clear();
        for &row in rows {
            below.extend_from_slice(&x[row as usize * WIDTH..][..WIDTH]);
        }
        for (k, column) in block.chunks_exact(stride).enumerate().rev() {
            let mut sum = x[first + k];
            for (v, l) in x[first + k + 1..end].iter().zip(&column[k + 1..columns]) {
                subtract(&mut sum, *l, v);
            }
            for (v, l) in below.iter().zip(&column[columns..]) {
                subtract(&mut sum, *l, v);
            }
            x[first + k] = sum.map(|v| v * column[k]);
        }
    }
}

impl<const WIDTH: usize> Factor<WIDTH> {
    /// The inverse over all rows of a supernode, from that over the rows of its parent (its number, and the block).
    pub(crate) fn inverse_block(&self, id: usize, parent: Option<(usize, &[f64])>) -> Vec<f64> {
        let supernode = self.symbolic.supernodes[id];
        let columns = (supernode.end - supernode.first) as usize * WIDTH;
        let rows = self.symbolic.rows(id);
        let stride = columns + rows.len() * WIDTH;
        let mut z = vec![0.0; stride * stride];
        if let Some((parent, above)) = parent {
            let up = self.symbolic.supernodes[parent];
            let (first, count) = (up.first as usize, (up.end - up.first) as usize);
            let mut map = Vec::new();
            local_rows::<WIDTH>(rows, up.end, first, count, self.symbolic.rows(parent), &mut map);
            let above_stride = (count + self.symbolic.rows(parent).len()) * WIDTH;
            for (j, &to) in map.iter().enumerate() {
                let source = &above[to as usize * above_stride..][..above_stride];
                let target = &mut z[(columns + j) * stride + columns..][..map.len()];
                for (t, &from) in target.iter_mut().zip(&map) {
                    *t = source[from as usize];
                }
            }
        }
        let block = &self.values[self.value_start[id]..][..columns * stride];
        let (mut l, mut column) = (Vec::new(), Vec::new());
        for k in (0..columns).rev() {
            let inverse = block[k * stride + k];
            l.clear();
            l.extend(block[k * stride + k + 1..(k + 1) * stride].iter().map(|v| v * inverse));
            column.clear();
            column.resize(l.len(), 0.0);
            for (&factor, known) in l.iter().zip(z.chunks_exact(stride).skip(k + 1)) {
                for (c, v) in column.iter_mut().zip(&known[k + 1..]) {
                    *c -= factor * v;
                }
            }
            let own: f64 = l.iter().zip(&column).map(|(l, z)| l * z).sum();
            z[k * stride + k] = inverse * inverse - own;
            for (offset, &value) in column.iter().enumerate() {
                z[k * stride + k + 1 + offset] = value;
                z[(k + 1 + offset) * stride + k] = value;
            }
        }
        z
    }
}

/// The factorisation as a task that is compiled for each set of vector instructions.
struct Compute<'a, C, const WIDTH: usize> {
    factor: &'a mut Factor<WIDTH>,
    graph: &'a Graph<C>,
}

impl<C: Compliance, const WIDTH: usize> pulp::WithSimd for Compute<'_, C, WIDTH> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.factor.eliminate(self.graph);
    }
}

/// `t −= l · v` for each right-hand side.
#[inline]
fn subtract<const SIDES: usize>(t: &mut [f64; SIDES], l: f64, v: &[f64; SIDES]) {
    for side in 0..SIDES {
        t[side] -= l * v[side];
    }
}

/// How many ancestors each supernode has.
fn depths(supernodes: &[Supernode]) -> Vec<u32> {
    let mut depth = vec![0; supernodes.len()];
    for (id, supernode) in supernodes.iter().enumerate().rev() {
        if supernode.parent != u32::MAX {
            depth[id] = depth[supernode.parent as usize] + 1;
        }
    }
    depth
}

/// Adds a child's remainder to its parent's columns and, beyond them, to the parent's own remainder.
#[inline(always)]
fn extend_add(child: &[f64], map: &[u32], block: &mut [f64], stride: usize, rest: &mut [f64]) {
    let size = map.len();
    let columns = block.len() / stride;
    let rest_size = stride - columns;
    for (j, column) in child.chunks_exact(size.max(1)).enumerate() {
        let to = map[j] as usize;
        if to < columns {
            let target = &mut block[to * stride..][..stride];
            for (&row, value) in map[j..].iter().zip(&column[j..]) {
                target[row as usize] += value;
            }
        } else {
            let target = &mut rest[(to - columns) * rest_size..][..rest_size];
            for (&row, value) in map[j..].iter().zip(&column[j..]) {
                target[row as usize - columns] += value;
            }
        }
    }
}

/// Adds a stiffness to the entries of a node's row and another's column.
#[inline]
fn add_entries<const WIDTH: usize, C: Compliance>(
    block: &mut [f64],
    stride: usize,
    (row, column): (usize, usize),
    stiffness: C,
    sign: f64,
) {
    for c in 0..WIDTH {
        for r in 0..WIDTH {
            block[(column * WIDTH + c) * stride + row * WIDTH + r] += sign * stiffness.entry(r, c);
        }
    }
}

/// Where the rows a child left are in its parent's block.
#[inline]
fn local_rows<const WIDTH: usize>(
    child: &[u32],
    end: u32,
    first: usize,
    count: usize,
    rows: &[u32],
    map: &mut Vec<u32>,
) {
    map.clear();
    let mut at = 0;
    for &row in child {
        let local = if row < end {
            row as usize - first
        } else {
            while rows[at] != row {
                at += 1;
            }
            count + at
        };
        #[expect(clippy::cast_possible_truncation, reason = "a block has fewer rows than the matrix")]
        map.extend((0..WIDTH).map(|c| (local * WIDTH + c) as u32));
    }
}

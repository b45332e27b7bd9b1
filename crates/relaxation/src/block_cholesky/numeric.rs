//! The numbers: panels, fronts, solutions.

use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use super::kernel;
use super::symbolic::{Slot, Symbolic};

/// The matrix cannot be a sum of squares with a unique minimum: this node's pivot is not positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NotPositiveDefinite {
    /// The node in whose block it was seen.
    pub(crate) node: usize,
}

/// A symmetric matrix of `block × block` blocks, and after [`factorize`](Self::factorize) its Cholesky factor, in the same memory.
#[derive(Debug, Clone)]
pub(crate) struct BlockCholesky {
    symbolic: Arc<Symbolic>,
    block: usize,
    panels: Vec<f64>,
    /// Updates of finished supernodes on their way to the parent.
    updates: Vec<Vec<f64>>,
    spare: Vec<Vec<f64>>,
    work: Vec<f64>,
    front: Vec<f64>,
}

impl BlockCholesky {
    /// The zero matrix of this pattern; `block` is 1, 2, 3 or 4.
    pub(crate) fn new(symbolic: Arc<Symbolic>, block: usize) -> Self {
        let panels = vec![0.0; symbolic.blocks * block * block];
        let supernodes = symbolic.supernodes.len();
        Self {
            symbolic,
            block,
            panels,
            updates: vec![Vec::new(); supernodes],
            spare: vec![],
            work: vec![],
            front: vec![],
        }
    }

    pub(super) fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    pub(super) fn block(&self) -> usize {
        self.block
    }

    /// The panel of a supernode: its height times its columns, in numbers.
    pub(super) fn panel(&self, s: usize) -> &[f64] {
        let (node, square) = (&self.symbolic.supernodes[s], self.block * self.block);
        &self.panels[node.panel * square..][..node.columns * node.height() * square]
    }

    /// Makes it the zero matrix again.
    pub(crate) fn clear(&mut self) {
        self.panels.fill(0.0);
    }

    /// Adds `entries[row][column]` to the block at `slot`.
    #[inline(always)]
    pub(crate) fn add<const B: usize>(&mut self, slot: Slot, entries: &[[f64; B]; B]) {
        debug_assert_eq!(B, self.block);
        let step = slot.height as usize * B;
        let start = slot.column_start * B * B + slot.row as usize * B;
        let transpose: [[f64; B]; B];
        let columns = if slot.transposed {
            entries
        } else {
            transpose = std::array::from_fn(|c| std::array::from_fn(|r| entries[r][c]));
            &transpose
        };
        for (column, entries) in columns.iter().enumerate() {
            let begin = start + column * step;
            for (target, entry) in self.panels[begin..begin + B].iter_mut().zip(entries) {
                *target += entry;
            }
        }
    }

    /// Copies the diagonal, in the order of the unknowns.
    pub(crate) fn diagonal(&self, out: &mut [f64]) {
        let block = self.block;
        for (node, out) in out.chunks_exact_mut(block).enumerate() {
            let slot = self.symbolic.diagonal(node);
            let start = slot.column_start * block * block + slot.row as usize * block;
            for (k, out) in out.iter_mut().enumerate() {
                *out = self.panels[start + k * slot.height as usize * block + k];
            }
        }
    }

    /// Replaces the matrix by its Cholesky factor.
    pub(crate) fn factorize(&mut self) -> Result<(), NotPositiveDefinite> {
        Arch::new().dispatch(Factorize(self))
    }

    /// Solves in place; `x` holds `block` numbers for each node.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        Arch::new().dispatch(SolveWith(self, x));
    }

    #[inline(always)]
    fn factorize_fronts<const FUSED: bool, const B: usize>(&mut self) -> Result<(), NotPositiveDefinite> {
        let symbolic = Arc::clone(&self.symbolic);
        for s in 0..symbolic.supernodes.len() {
            let node = &symbolic.supernodes[s];
            let (rows, columns) = (node.height() * B, node.columns * B);
            let panel = &mut self.panels[node.panel * B * B..][..rows * columns];
            // What the children sent has been added to the panel and to this supernode's own update.
            kernel::factor_panel::<FUSED>(panel, rows, columns).map_err(|column| {
                let place = node.first + column / B;
                let node = symbolic.place.iter().position(|p| *p as usize == place);
                NotPositiveDefinite { node: node.unwrap_or(0) }
            })?;
            let below = rows - columns;
            let Some(parent) = node.parent else { continue };
            let mut update = std::mem::take(&mut self.updates[s]);
            if update.is_empty() {
                update = self.spare.pop().unwrap_or_default();
                update.clear();
                update.resize(below * below, 0.0);
            }
            kernel::subtract_outer::<FUSED>(&mut update, below, (below, below), &panel[columns..], rows, columns);
            self.send::<B>(s, parent, &update, below);
            self.spare.push(update);
        }
        Ok(())
    }

    /// Adds the update of supernode `s` to the front of its parent.
    #[inline(always)]
    fn send<const B: usize>(&mut self, s: usize, parent: usize, update: &[f64], below: usize) {
        let symbolic = &self.symbolic;
        let target = &symbolic.supernodes[parent];
        let map = &symbolic.in_parent[symbolic.supernodes[s].rows.clone()];
        let (height, columns) = (target.height() * B, target.columns);
        let rest = height - columns * B;
        if rest > 0 && self.updates[parent].is_empty() {
            let mut fresh = self.spare.pop().unwrap_or_default();
            fresh.clear();
            fresh.resize(rest * rest, 0.0);
            self.updates[parent] = fresh;
        }
        let panel = &mut self.panels[target.panel * B * B..][..height * columns * B];
        let own = &mut self.updates[parent];
        for (j, &column) in map.iter().enumerate() {
            let column = column as usize;
            for k in 0..B {
                let source = &update[(j * B + k) * below..(j * B + k + 1) * below];
                let (destination, shift) = if column < columns {
                    (&mut panel[(column * B + k) * height..][..height], 0)
                } else {
                    (&mut own[((column - columns) * B + k) * rest..][..rest], columns)
                };
                for (block, &row) in source[j * B..].chunks_exact(B).zip(&map[j..]) {
                    let at = (row as usize - shift) * B;
                    let entries: &mut [f64; B] = (&mut destination[at..at + B]).try_into().expect("B entries");
                    for r in 0..B {
                        entries[r] += block[r];
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn solve_fronts<const FUSED: bool, const B: usize>(&mut self, x: &mut [f64]) {
        let symbolic = &self.symbolic;
        let work = &mut self.work;
        let front = &mut self.front;
        work.resize(x.len(), 0.0);
        for (from, &place) in x.chunks_exact(B).zip(&symbolic.place) {
            work[place as usize * B..][..B].copy_from_slice(from);
        }
        for node in &symbolic.supernodes {
            let (rows, columns, own) = (node.height() * B, node.columns * B, node.first * B);
            let panel = &self.panels[node.panel * B * B..][..rows * columns];
            front.clear();
            front.extend_from_slice(&work[own..own + columns]);
            front.resize(rows, 0.0);
            kernel::forward::<FUSED>(panel, rows, columns, front);
            work[own..own + columns].copy_from_slice(&front[..columns]);
            for (change, &row) in front[columns..].chunks_exact(B).zip(&symbolic.rows[node.rows.clone()]) {
                for (entry, change) in work[row as usize * B..][..B].iter_mut().zip(change) {
                    *entry += change;
                }
            }
        }
        for node in symbolic.supernodes.iter().rev() {
            let (rows, columns, own) = (node.height() * B, node.columns * B, node.first * B);
            let panel = &self.panels[node.panel * B * B..][..rows * columns];
            front.clear();
            front.extend_from_slice(&work[own..own + columns]);
            for &row in &symbolic.rows[node.rows.clone()] {
                front.extend_from_slice(&work[row as usize * B..][..B]);
            }
            kernel::backward::<FUSED>(panel, rows, columns, front);
            work[own..own + columns].copy_from_slice(&front[..columns]);
        }
        for (to, &place) in x.chunks_exact_mut(B).zip(&symbolic.place) {
            to.copy_from_slice(&work[place as usize * B..][..B]);
        }
    }
}

struct Factorize<'a>(&'a mut BlockCholesky);

impl WithSimd for Factorize<'_> {
    type Output = Result<(), NotPositiveDefinite>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        // Left over when an earlier factorisation broke off.
        for update in &mut self.0.updates {
            update.clear();
        }
        match (S::F64_LANES > 1, self.0.block) {
            (true, 1) => self.0.factorize_fronts::<true, 1>(),
            (true, 2) => self.0.factorize_fronts::<true, 2>(),
            (true, 3) => self.0.factorize_fronts::<true, 3>(),
            (true, _) => self.0.factorize_fronts::<true, 4>(),
            (false, 1) => self.0.factorize_fronts::<false, 1>(),
            (false, 2) => self.0.factorize_fronts::<false, 2>(),
            (false, 3) => self.0.factorize_fronts::<false, 3>(),
            (false, _) => self.0.factorize_fronts::<false, 4>(),
        }
    }
}

struct SolveWith<'a>(&'a mut BlockCholesky, &'a mut [f64]);

impl WithSimd for SolveWith<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(this, x) = self;
        match (S::F64_LANES > 1, this.block) {
            (true, 1) => this.solve_fronts::<true, 1>(x),
            (true, 2) => this.solve_fronts::<true, 2>(x),
            (true, 3) => this.solve_fronts::<true, 3>(x),
            (true, _) => this.solve_fronts::<true, 4>(x),
            (false, 1) => this.solve_fronts::<false, 1>(x),
            (false, 2) => this.solve_fronts::<false, 2>(x),
            (false, 3) => this.solve_fronts::<false, 3>(x),
            (false, _) => this.solve_fronts::<false, 4>(x),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    /// A random graph, its matrix as blocks and dense, compared with a dense solution.
    fn against_dense<const B: usize>(nodes: u32, edges: usize, seed: u128) {
        let mut random = Pcg64Mcg::new(seed);
        let pairs: Vec<(u32, u32)> =
            (0..edges).map(|_| (random.random_range(0..nodes), random.random_range(0..nodes))).collect();
        let nodes = nodes as usize;
        let symbolic = Arc::new(Symbolic::new(nodes, pairs.iter().copied()));
        let mut sparse = BlockCholesky::new(Arc::clone(&symbolic), B);
        let mut dense = DMatrix::zeros(nodes * B, nodes * B);
        for _ in 0..2 {
            sparse.clear();
            dense.fill(0.0);
            for node in 0..nodes {
                let mut entries = [[0.0; B]; B];
                for (k, row) in entries.iter_mut().enumerate() {
                    row[k] = 1.0 + 3.0 * edges as f64;
                    dense[(node * B + k, node * B + k)] += row[k];
                }
                sparse.add(symbolic.diagonal(node), &entries);
            }
            for (i, j) in pairs.iter().map(|(i, j)| (*i as usize, *j as usize)).filter(|(i, j)| i != j) {
                let entries: [[f64; B]; B] =
                    std::array::from_fn(|_| std::array::from_fn(|_| random.random::<f64>() - 0.5));
                sparse.add(symbolic.slot(i, j), &entries);
                for r in 0..B {
                    for c in 0..B {
                        dense[(i * B + r, j * B + c)] += entries[r][c];
                        dense[(j * B + c, i * B + r)] += entries[r][c];
                    }
                }
            }
            sparse.factorize().unwrap();
            let right = DVector::from_fn(nodes * B, |_, _| random.random::<f64>());
            let expected = dense.clone().cholesky().unwrap().solve(&right);
            let mut x = right.as_slice().to_vec();
            sparse.solve(&mut x);
            assert_relative_eq!(DVector::from_vec(x), expected, epsilon = 1e-12, max_relative = 1e-9);
            let inverse = dense.clone().try_inverse().unwrap();
            for (node, block) in sparse.inverse_blocks().chunks_exact(B * B).enumerate() {
                for (k, entry) in block.iter().enumerate() {
                    let (row, column) = (node * B + k / B, node * B + k % B);
                    assert_relative_eq!(*entry, inverse[(row, column)], epsilon = 1e-12, max_relative = 1e-9);
                }
            }
        }
    }

    #[test]
    fn solutions_equal_dense_ones() {
        for (seed, (nodes, edges)) in (1..).zip([(1, 0), (2, 1), (3, 0), (10, 12), (40, 60), (60, 200), (50, 1200)]) {
            against_dense::<1>(nodes, edges, seed);
            against_dense::<2>(nodes, edges, seed);
            against_dense::<3>(nodes, edges, seed);
            against_dense::<4>(nodes, edges, seed);
        }
    }

    #[test]
    fn no_nodes_are_no_problem() {
        let mut empty = BlockCholesky::new(Arc::new(Symbolic::new(0, std::iter::empty())), 3);
        empty.factorize().unwrap();
        empty.solve(&mut []);
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_refused_and_leaves_no_trace() {
        let symbolic = Arc::new(Symbolic::new(3, [(0, 1), (1, 2)].into_iter()));
        let mut matrix = BlockCholesky::new(Arc::clone(&symbolic), 1);
        for attempt in 0..2 {
            matrix.clear();
            for node in 0..3 {
                matrix.add(symbolic.diagonal(node), &[[if attempt == 0 && node == 1 { -1.0 } else { 4.0 }]]);
            }
            matrix.add(symbolic.slot(0, 1), &[[1.0]]);
            matrix.add(symbolic.slot(1, 2), &[[1.0]]);
            assert_eq!(matrix.factorize().is_ok(), attempt == 1);
        }
        let mut x = [5.0, 6.0, 5.0];
        matrix.solve(&mut x);
        assert_relative_eq!(x[..], [1.0, 1.0, 1.0], epsilon = 1e-14);
    }
}

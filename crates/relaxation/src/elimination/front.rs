//! One step of the multifrontal factorisation: the front of a supernode is gathered from springs and children, its columns
//! are eliminated, and what that leaves waits on a stack for the parent.

use super::compliance::Compliance;
use super::dense::{downdate_rest, factor_columns};
use super::entries::{Entries, GROUND};
use super::symbolic::Symbolic;

/// What is to be factored, and its pattern.
#[derive(Debug, Clone, Copy)]
pub(super) struct Matrix<'a, C> {
    pub(super) entries: &'a Entries<C>,
    pub(super) symbolic: &'a Symbolic,
}

/// Working memory of a factorisation with `WIDTH` unknowns per node.
#[derive(Debug)]
pub(super) struct Fronts<const WIDTH: usize> {
    /// What children leave to their parents lies on two stacks, one for even depths of the tree and one for odd: a parent's
    /// remainder is made while its children's, on top of the other stack, are used up.
    stacks: [Vec<f64>; 2],
    /// Supernodes whose remainders wait.
    open: Vec<u32>,
    depth: Vec<u32>,
    /// The coupling of each position to the ground (`WIDTH` 1).
    grounded: Vec<f64>,
    /// Where each position is in the front at hand; of no meaning for positions that are not in it.
    local: Vec<u32>,
    /// Where the rows of a child's remainder are in the front at hand.
    map: Vec<u32>,
}

impl<const WIDTH: usize> Fronts<WIDTH> {
    pub(super) fn new(symbolic: &Symbolic, nodes: usize) -> Self {
        Self {
            stacks: [Vec::new(), Vec::new()],
            open: Vec::new(),
            depth: symbolic.depths(),
            grounded: vec![0.0; if WIDTH == 1 { nodes } else { 0 }],
            local: vec![0; nodes],
            map: Vec::new(),
        }
    }

    /// Forgets what has been computed of the positions from `first` to `end`, so that they can be factored again.
    pub(super) fn reset(&mut self, first: u32, end: u32) {
        self.stacks.iter_mut().for_each(Vec::clear);
        self.open.clear();
        if WIDTH == 1 {
            self.grounded[first as usize..end as usize].fill(0.0);
        }
    }

    /// Computes the columns of supernode `id` into `block`, which is zero before, and leaves the remainder for the parent.
    ///
    /// The children must have been eliminated just before.
    #[inline(always)]
    pub(super) fn eliminate<C: Compliance>(&mut self, matrix: Matrix<'_, C>, id: usize, block: &mut [f64]) {
        let supernode = matrix.symbolic.supernodes[id];
        let (first, count) = (supernode.first as usize, (supernode.end - supernode.first) as usize);
        let rows = matrix.symbolic.rows(id);
        let columns = count * WIDTH;
        let stride = columns + rows.len() * WIDTH;
        for (at, position) in (0_u32..).zip(first..first + count) {
            self.local[position] = at;
        }
        for (at, &row) in (supernode.end - supernode.first..).zip(rows) {
            self.local[row as usize] = at;
        }
        self.assemble(matrix, id, block, stride);

        let [even, odd] = &mut self.stacks;
        let (own, children) = if self.depth[id].is_multiple_of(2) { (even, odd) } else { (odd, even) };
        let base = own.len();
        own.resize(base + (stride - columns).pow(2), 0.0);
        let rest = &mut own[base..];
        while let Some(child) =
            self.open.pop_if(|child| matrix.symbolic.supernodes[*child as usize].parent as usize == id)
        {
            local_rows::<WIDTH>(matrix.symbolic.rows(child as usize), &self.local, &mut self.map);
            let from = children.len() - self.map.len().pow(2);
            extend_add(&children[from..], &self.map, block, stride, rest);
            children.truncate(from);
        }
        self.open.push(u32::try_from(id).expect("supernodes are counted in 32 bits"));

        let grounded = &mut self.grounded;
        factor_columns(block, stride, |k, column| {
            if WIDTH == 2 { column[0] } else { ground_pivot(grounded, first, count, rows, k, column) }
        });
        downdate_rest(rest, block, stride, columns);
    }

    /// Writes the springs at the nodes of a supernode into its block, and their coupling to anchors into `grounded`.
    #[inline(always)]
    fn assemble<C: Compliance>(&mut self, matrix: Matrix<'_, C>, id: usize, block: &mut [f64], stride: usize) {
        let supernode = matrix.symbolic.supernodes[id];
        for (column, position) in (supernode.first..supernode.end).enumerate() {
            for entry in matrix.entries.of(position) {
                if entry.row == GROUND {
                    self.grounded[position as usize] += entry.stiffness.entry(0, 0);
                    continue;
                }
                let row = self.local[entry.row as usize] as usize;
                let sign = if entry.row == position { 1.0 } else { -1.0 };
                add_entries::<WIDTH, C>(block, stride, (row, column), entry.stiffness, sign);
            }
        }
    }
}

/// What is beside the diagonal of column `k`, and the ground: the pivot of a grounded Laplacian. The ground's share of the
/// column goes to the rows below.
#[inline(always)]
fn ground_pivot(grounded: &mut [f64], first: usize, count: usize, rows: &[u32], k: usize, column: &mut [f64]) -> f64 {
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
#[inline(always)]
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

/// Where the rows a child left are in its parent's front.
#[inline(always)]
fn local_rows<const WIDTH: usize>(child: &[u32], local: &[u32], map: &mut Vec<u32>) {
    map.clear();
    for &row in child {
        let row = local[row as usize] as usize;
        #[expect(clippy::cast_possible_truncation, reason = "a front has fewer rows than the matrix")]
        map.extend((0..WIDTH).map(|c| (row * WIDTH + c) as u32));
    }
}

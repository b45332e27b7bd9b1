//! Dense kernels on column-major blocks: plain loops where blocks are small, faer's matrix product where they are not.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, MatMut, MatRef, Par};

/// Multiplications from which on a call into faer is repaid.
const LARGE: usize = 4000;

/// Columns that are updated together in a wide supernode.
const PANEL: usize = 48;

/// `target[i] −= Σ_k columns[row, k] · columns[row + i, k]` over all columns (of length `stride` each).
#[inline(always)]
fn downdate(target: &mut [f64], columns: &[f64], stride: usize, row: usize) {
    let length = target.len();
    let mut quads = columns.chunks_exact(4 * stride);
    for quad in &mut quads {
        let (c0, rest) = quad.split_at(stride);
        let (c1, rest) = rest.split_at(stride);
        let (c2, c3) = rest.split_at(stride);
        let (c0, c1) = (&c0[row..row + length], &c1[row..row + length]);
        let (c2, c3) = (&c2[row..row + length], &c3[row..row + length]);
        let (f0, f1, f2, f3) = (c0[0], c1[0], c2[0], c3[0]);
        for i in 0..length {
            target[i] -= (f0 * c0[i] + f1 * c1[i]) + (f2 * c2[i] + f3 * c3[i]);
        }
    }
    for column in quads.remainder().chunks_exact(stride) {
        let column = &column[row..row + length];
        let factor = column[0];
        for (t, c) in target.iter_mut().zip(column) {
            *t -= factor * c;
        }
    }
}

/// Factors the columns of `l` (`stride` rows each) in place: `L Lᵀ` of what they hold, the diagonal inverted.
///
/// `pivot(k, below)` says what is left on the diagonal of column `k`; `below` is the column from its diagonal down.
#[inline(always)]
pub(super) fn factor_columns(l: &mut [f64], stride: usize, mut pivot: impl FnMut(usize, &mut [f64]) -> f64) {
    let count = l.len().checked_div(stride).unwrap_or(0);
    for first in (0..count).step_by(PANEL) {
        let last = (first + PANEL).min(count);
        let (done, rest) = l.split_at_mut(first * stride);
        let panel = &mut rest[..(last - first) * stride];
        let large = first * (stride - first) * (last - first) > LARGE;
        if large {
            downdate_panel(panel, done, stride, first);
        }
        for k in first..last {
            let (before, column) = panel.split_at_mut((k - first) * stride);
            let column = &mut column[k..stride];
            if !large {
                downdate(column, done, stride, k);
            }
            downdate(column, before, stride, k);
            let inverse = pivot(k, column).sqrt().recip();
            column[0] = inverse;
            for below in &mut column[1..] {
                *below *= inverse;
            }
        }
    }
}

/// Subtracts from all columns of `panel`, the first of which is column `first`, what the columns `done` contribute.
#[inline(never)]
fn downdate_panel(panel: &mut [f64], done: &[f64], stride: usize, first: usize) {
    let width = panel.len() / stride;
    let target = MatMut::from_column_major_slice_mut(panel, stride, width).get_mut(first.., ..);
    let done = MatRef::from_column_major_slice(done, stride, first);
    let (left, right) = (done.get(first.., ..), done.get(first..first + width, ..));
    matmul(target, Accum::Add, left, right.transpose(), -1.0, Par::Seq);
}

/// `u −= B Bᵀ` in the lower triangle, with `B` the rows of `l` from `from` on.
#[inline(always)]
pub(super) fn downdate_rest(u: &mut [f64], l: &[f64], stride: usize, from: usize) {
    let size = stride - from;
    if size == 0 {
        return; // The root of a tree leaves nothing.
    }
    let count = l.len() / stride;
    if size * size * count / 2 > LARGE && count > 8 {
        let target = MatMut::from_column_major_slice_mut(u, size, size);
        let below = MatRef::from_column_major_slice(l, stride, count).get(from.., ..);
        let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
        triangular::matmul(target, lower, Accum::Add, below, whole, below.transpose(), whole, -1.0, Par::Seq);
    } else {
        for (j, column) in u.chunks_exact_mut(size).enumerate() {
            downdate(&mut column[j..], l, stride, from + j);
        }
    }
}

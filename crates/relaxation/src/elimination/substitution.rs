//! The two triangular solutions, supernode by supernode: `L y = b` upwards, `Lᵀ x = y` downwards.

use super::dissection::Supernode;

/// The columns of one supernode, its diagonal inverted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Columns<'a> {
    pub(super) supernode: Supernode,
    /// The positions of the rows below the supernode.
    pub(super) rows: &'a [u32],
    /// Column-major, from the first row of the supernode down.
    pub(super) values: &'a [f64],
}

impl Columns<'_> {
    /// The part of `L y = b` that belongs to this supernode, in place.
    #[inline(always)]
    pub(super) fn forward<const WIDTH: usize, const SIDES: usize>(
        self,
        x: &mut [[f64; SIDES]],
        below: &mut Vec<[f64; SIDES]>,
    ) {
        let (first, end) = (self.supernode.first as usize * WIDTH, self.supernode.end as usize * WIDTH);
        let columns = end - first;
        below.clear();
        below.resize(self.rows.len() * WIDTH, [0.0; SIDES]);
        for (k, column) in self.values.chunks_exact(columns + below.len()).enumerate() {
            let y = x[first + k].map(|v| v * column[k]);
            x[first + k] = y;
            let (beside, beneath) = column.split_at(columns);
            for (t, l) in x[first + k + 1..end].iter_mut().zip(&beside[k + 1..]) {
                subtract(t, *l, &y);
            }
            for (t, l) in below.iter_mut().zip(beneath) {
                subtract(t, *l, &y);
            }
        }
        for (&row, block) in self.rows.iter().zip(below.chunks_exact(WIDTH)) {
            for (t, value) in x[row as usize * WIDTH..].iter_mut().zip(block) {
                for side in 0..SIDES {
                    t[side] += value[side];
                }
            }
        }
    }

    /// The part of `Lᵀ x = y` that belongs to this supernode, in place.
    #[inline(always)]
    pub(super) fn backward<const WIDTH: usize, const SIDES: usize>(
        self,
        x: &mut [[f64; SIDES]],
        below: &mut Vec<[f64; SIDES]>,
    ) {
        let (first, end) = (self.supernode.first as usize * WIDTH, self.supernode.end as usize * WIDTH);
        let columns = end - first;
        below.clear();
        for &row in self.rows {
            below.extend_from_slice(&x[row as usize * WIDTH..][..WIDTH]);
        }
        for (k, column) in self.values.chunks_exact(columns + below.len()).enumerate().rev() {
            let mut sum = x[first + k];
            let (beside, beneath) = column.split_at(columns);
            for (v, l) in x[first + k + 1..end].iter().zip(&beside[k + 1..]) {
                subtract(&mut sum, *l, v);
            }
            for (v, l) in below.iter().zip(beneath) {
                subtract(&mut sum, *l, v);
            }
            x[first + k] = sum.map(|v| v * column[k]);
        }
    }
}

/// `t −= l · v` for each right-hand side.
#[inline(always)]
fn subtract<const SIDES: usize>(t: &mut [f64; SIDES], l: f64, v: &[f64; SIDES]) {
    for side in 0..SIDES {
        t[side] -= l * v[side];
    }
}

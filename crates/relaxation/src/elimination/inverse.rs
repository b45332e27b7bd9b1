//! The inverse over the rows of one supernode: a step of Takahashi's recursion.

use super::factor::Factor;

impl<const WIDTH: usize> Factor<WIDTH> {
    /// The inverse over all rows of a supernode, from that over the rows of its parent (its number, and the block).
    pub(crate) fn inverse_block(&self, id: usize, parent: Option<(usize, &[f64])>) -> Vec<f64> {
        let own = self.columns(id);
        let columns = (own.supernode.end - own.supernode.first) as usize * WIDTH;
        let stride = columns + own.rows.len() * WIDTH;
        let mut z = vec![0.0; stride * stride];
        if let Some((parent, above)) = parent {
            let up = self.columns(parent);
            let count = (up.supernode.end - up.supernode.first) as usize;
            let above_stride = (count + up.rows.len()) * WIDTH;
            let map = self.rows_in_parent(own.rows, parent);
            for (j, &to) in map.iter().enumerate() {
                let source = &above[to * above_stride..][..above_stride];
                let target = &mut z[(columns + j) * stride + columns..][..map.len()];
                for (t, &from) in target.iter_mut().zip(&map) {
                    *t = source[from];
                }
            }
        }
        let (mut l, mut column) = (Vec::new(), Vec::new());
        for k in (0..columns).rev() {
            let inverse = own.values[k * stride + k];
            l.clear();
            l.extend(own.values[k * stride + k + 1..(k + 1) * stride].iter().map(|v| v * inverse));
            column.clear();
            column.resize(l.len(), 0.0);
            for (&factor, known) in l.iter().zip(z.chunks_exact(stride).skip(k + 1)) {
                for (c, v) in column.iter_mut().zip(&known[k + 1..]) {
                    *c -= factor * v;
                }
            }
            let below: f64 = l.iter().zip(&column).map(|(l, z)| l * z).sum();
            z[k * stride + k] = inverse * inverse - below;
            for (offset, &value) in column.iter().enumerate() {
                z[k * stride + k + 1 + offset] = value;
                z[(k + 1 + offset) * stride + k] = value;
            }
        }
        z
    }

    /// Where rows (ascending positions) are among all rows of the supernode `parent`, unknown by unknown.
    fn rows_in_parent(&self, rows: &[u32], parent: usize) -> Vec<usize> {
        let up = self.columns(parent);
        let count = (up.supernode.end - up.supernode.first) as usize;
        let mut at = 0;
        let mut map = Vec::with_capacity(rows.len() * WIDTH);
        for &row in rows {
            let local = if row < up.supernode.end {
                (row - up.supernode.first) as usize
            } else {
                while up.rows[at] != row {
                    at += 1;
                }
                count + at
            };
            map.extend((0..WIDTH).map(|c| local * WIDTH + c));
        }
        map
    }
}

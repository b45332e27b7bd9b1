//! The diagonal blocks of the inverse, without the rest of it (Takahashi, Fagan & Chin 1973), front by front from the last.
//!
//! With `J` the columns of a front and `R` the rows below, and `Z = (L Lᵀ)⁻¹`:
//!
//! ```text
//! X = L_RJ L_JJ⁻¹      Z_RJ = −Z_RR X      Z_JJ = L_JJ⁻ᵀ L_JJ⁻¹ − Xᵀ Z_RJ
//! ```
//!
//! and `Z_RR` lies in the front of the parent, which has been finished before.

use super::numeric::BlockCholesky;

impl BlockCholesky {
    /// The diagonal blocks of the inverse, one for each node, row by row; call after [`factorize`](Self::factorize).
    pub(crate) fn inverse_blocks(&self) -> Vec<f64> {
        let (symbolic, b) = (self.symbolic(), self.block());
        let count = symbolic.supernodes.len();
        let mut waiting = vec![0usize; count];
        for parent in symbolic.supernodes.iter().filter_map(|node| node.parent) {
            waiting[parent] += 1;
        }
        let mut fronts: Vec<Vec<f64>> = vec![Vec::new(); count];
        let mut by_place = vec![0.0; symbolic.place.len() * b * b];
        for s in (0..count).rev() {
            let node = &symbolic.supernodes[s];
            let (rows, columns) = (node.height() * b, node.columns * b);
            let mut z = vec![0.0; rows * rows];
            if let Some(parent) = node.parent {
                let map = &symbolic.in_parent[node.rows.clone()];
                let height = symbolic.supernodes[parent].height() * b;
                let at = |k: usize| map[k / b] as usize * b + k % b;
                for column in 0..rows - columns {
                    let from = &fronts[parent][at(column) * height..][..height];
                    let to = &mut z[(columns + column) * rows + columns..][..rows - columns];
                    to.iter_mut().enumerate().for_each(|(row, to)| *to = from[at(row)]);
                }
                waiting[parent] -= 1;
                if waiting[parent] == 0 {
                    fronts[parent] = Vec::new();
                }
            }
            finish_front(&mut z, self.panel(s), rows, columns);
            for own in 0..node.columns {
                for (k, entry) in by_place[(node.first + own) * b * b..][..b * b].iter_mut().enumerate() {
                    *entry = z[(own * b + k % b) * rows + own * b + k / b];
                }
            }
            if waiting[s] > 0 {
                fronts[s] = z;
            }
        }
        symbolic.place.iter().flat_map(|place| by_place[*place as usize * b * b..][..b * b].to_vec()).collect()
    }
}

/// Fills the columns of `z` (`rows × rows`, its lower right part known) from the front's panel.
fn finish_front(z: &mut [f64], panel: &[f64], rows: usize, columns: usize) {
    let below = rows - columns;
    // X, from its last column: X L_JJ = L_RJ.
    let mut x = vec![0.0; below * columns];
    for j in (0..columns).rev() {
        let (head, tail) = x.split_at_mut((j + 1) * below);
        let own = &mut head[j * below..];
        own.copy_from_slice(&panel[j * rows + columns..(j + 1) * rows]);
        for i in j + 1..columns {
            subtract(own, panel[j * rows + i], &tail[(i - j - 1) * below..][..below]);
        }
        let pivot = panel[j * rows + j];
        own.iter_mut().for_each(|entry| *entry /= pivot);
    }
    for j in 0..columns {
        let mut product = vec![0.0; below];
        for (i, factor) in x[j * below..][..below].iter().enumerate() {
            subtract(&mut product, *factor, &z[(columns + i) * rows + columns..][..below]);
        }
        for (i, entry) in product.iter().enumerate() {
            z[(columns + i) * rows + j] = *entry;
        }
        z[j * rows + columns..][..below].copy_from_slice(&product);
    }
    // The inverse of the triangle, column by column, then its product with its own transpose.
    let mut inverse = vec![0.0; columns * columns];
    for j in 0..columns {
        inverse[j * columns + j] = 1.0 / panel[j * rows + j];
        for i in j + 1..columns {
            let sum: f64 = (j..i).map(|k| panel[k * rows + i] * inverse[j * columns + k]).sum();
            inverse[j * columns + i] = -sum / panel[i * rows + i];
        }
    }
    for i in 0..columns {
        for j in 0..=i {
            let own: f64 = (i..columns).map(|k| inverse[i * columns + k] * inverse[j * columns + k]).sum();
            let tied: f64 =
                x[i * below..][..below].iter().zip(&z[j * rows + columns..][..below]).map(|(x, z)| x * z).sum();
            z[j * rows + i] = own - tied;
            z[i * rows + j] = own - tied;
        }
    }
}

fn subtract(target: &mut [f64], factor: f64, other: &[f64]) {
    target.iter_mut().zip(other).for_each(|(entry, other)| *entry -= factor * other);
}

//! Dense kernels on column-major matrices: what a front is made of.
//!
//! They are written so that the compiler keeps a tile of the result in registers. `FUSED` says that the processor
//! multiplies and adds in one instruction; without one, asking for it would call a library function.

#[inline(always)]
fn multiply_add<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// `C −= A Bᵀ` on the lower trapezoid of `C` (`rows × columns`, leading dimension `c_step`), where `A` is `rows × depth` with
/// leading dimension `a_step` and `B` its first `columns` rows. Entries above the diagonal may be overwritten; nobody reads them.
#[inline(always)]
pub(super) fn subtract_outer<const FUSED: bool>(
    c: &mut [f64],
    c_step: usize,
    (rows, columns): (usize, usize),
    a: &[f64],
    a_step: usize,
    depth: usize,
) {
    let mut j = 0;
    while j + 4 <= columns {
        let mut i = j;
        while i + 8 <= rows {
            tile::<FUSED, 8, 4>(c, c_step, i, j, a, a_step, depth);
            i += 8;
        }
        while i + 4 <= rows {
            tile::<FUSED, 4, 4>(c, c_step, i, j, a, a_step, depth);
            i += 4;
        }
        while i < rows {
            tile::<FUSED, 1, 4>(c, c_step, i, j, a, a_step, depth);
            i += 1;
        }
        j += 4;
    }
    while j < columns {
        let mut i = j;
        while i + 4 <= rows {
            tile::<FUSED, 4, 1>(c, c_step, i, j, a, a_step, depth);
            i += 4;
        }
        while i < rows {
            tile::<FUSED, 1, 1>(c, c_step, i, j, a, a_step, depth);
            i += 1;
        }
        j += 1;
    }
}

#[inline(always)]
fn tile<const FUSED: bool, const R: usize, const C: usize>(
    c: &mut [f64],
    c_step: usize,
    i: usize,
    j: usize,
    a: &[f64],
    a_step: usize,
    depth: usize,
) {
    let mut sum = [[0.0; R]; C];
    let mut start = 0;
    for _ in 0..depth {
        let column = &a[start..];
        let left: &[f64; R] = column[i..i + R].try_into().expect("R entries");
        let right: &[f64; C] = column[j..j + C].try_into().expect("C entries");
        for k in 0..C {
            for r in 0..R {
                sum[k][r] = multiply_add::<FUSED>(left[r], right[k], sum[k][r]);
            }
        }
        start += a_step;
    }
    for (k, sum) in sum.iter().enumerate() {
        let begin = (j + k) * c_step + i;
        for (entry, sum) in c[begin..begin + R].iter_mut().zip(sum) {
            *entry -= sum;
        }
    }
}

/// Columns that are factored one by one before the rest of the panel is updated.
const STRIP: usize = 12;

/// Factors the first `columns` columns of the front in `panel` (`rows × columns`): the diagonal part becomes its Cholesky factor,
/// what lies below is divided by its transpose. The column with a pivot that is not positive, if there is one.
#[inline(always)]
pub(super) fn factor_panel<const FUSED: bool>(panel: &mut [f64], rows: usize, columns: usize) -> Result<(), usize> {
    let mut begin = 0;
    while begin < columns {
        let end = (begin + STRIP).min(columns);
        for j in begin..end {
            let (done, rest) = panel.split_at_mut(j * rows);
            let column = &mut rest[j..rows];
            for k in begin..j {
                let earlier = &done[k * rows + j..(k + 1) * rows];
                let factor = -earlier[0];
                for (entry, other) in column.iter_mut().zip(earlier) {
                    *entry = multiply_add::<FUSED>(factor, *other, *entry);
                }
            }
            let pivot = column[0];
            // Also catches NaN.
            if !(pivot > 0.0 && pivot.is_finite()) {
                return Err(j);
            }
            let root = pivot.sqrt();
            column[0] = root;
            let inverse = 1.0 / root;
            for entry in &mut column[1..] {
                *entry *= inverse;
            }
        }
        if end < columns {
            let (done, rest) = panel.split_at_mut(end * rows);
            subtract_outer::<FUSED>(
                &mut rest[end..],
                rows,
                (rows - end, columns - end),
                &done[begin * rows + end..],
                rows,
                end - begin,
            );
        }
        begin = end;
    }
    Ok(())
}

/// Solves `L y = x` for the panel's columns and subtracts from the rows below: `x` holds all `rows` of the front.
#[inline(always)]
pub(super) fn forward<const FUSED: bool>(panel: &[f64], rows: usize, columns: usize, x: &mut [f64]) {
    for j in 0..columns {
        let column = &panel[j * rows + j..(j + 1) * rows];
        let value = x[j] / column[0];
        x[j] = value;
        for (entry, factor) in x[j + 1..rows].iter_mut().zip(&column[1..]) {
            *entry = multiply_add::<FUSED>(-value, *factor, *entry);
        }
    }
}

/// Solves `Lᵀ y = x` for the panel's columns, the rows below being known.
#[inline(always)]
pub(super) fn backward<const FUSED: bool>(panel: &[f64], rows: usize, columns: usize, x: &mut [f64]) {
    for j in (0..columns).rev() {
        let column = &panel[j * rows + j..(j + 1) * rows];
        // Four sums, so that the processor need not wait for each addition.
        let mut sums = [0.0; 4];
        let (entries, factors) = (&x[j + 1..rows], &column[1..]);
        let mut pairs = entries.chunks_exact(4).zip(factors.chunks_exact(4));
        for (entries, factors) in &mut pairs {
            for k in 0..4 {
                sums[k] = multiply_add::<FUSED>(entries[k], factors[k], sums[k]);
            }
        }
        let tail = entries.len() / 4 * 4;
        let mut sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
        for (entry, factor) in entries[tail..].iter().zip(&factors[tail..]) {
            sum = multiply_add::<FUSED>(*entry, *factor, sum);
        }
        x[j] = (x[j] - sum) / column[0];
    }
}

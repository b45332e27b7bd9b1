//! Exact Euclidean distance to the nearest cell that is not free, and which cell that is.

use crate::plane::Plane;

/// For every free cell the squared distance (in cells, between centres) to the nearest wall cell, and that cell's index.
///
/// Exact, in two passes and in time proportional to the number of cells (Felzenszwalb & Huttenlocher 2012). The second pass
/// looks only at runs of free cells: the wall cells at both ends of a run are nearer than anything beyond them.
#[derive(Debug, Clone)]
pub(crate) struct DistanceField {
    pub(crate) squared: Plane<u32>,
    pub(crate) nearest: Plane<u32>,
}

/// More than any distance along a column.
const FAR: i32 = i32::MAX;

impl DistanceField {
    /// Measures free space that has a rim of walls.
    pub(crate) fn new(free: &Plane<bool>) -> Self {
        let steps = column_steps(free);
        let mut field = Self { squared: Plane::like(free, 0), nearest: Plane::like(free, 0) };
        let mut envelope = Vec::new();
        for row in 0..free.rows {
            for run in runs(free.row(row)) {
                lower_envelope(&steps[row * free.columns..], run.start - 1..run.end + 1, &mut envelope);
                field.fill_run(row, run, &envelope);
            }
        }
        field
    }

    /// Writes the distances of a run of free cells below the parabolas of `envelope`.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_possible_wrap,
        reason = "grids have fewer than 2^32 cells, squares are positive"
    )]
    fn fill_run(&mut self, row: usize, run: std::ops::Range<usize>, envelope: &[Parabola]) {
        let columns = self.squared.columns;
        let mut k = 0;
        for column in run {
            while k + 1 < envelope.len() && envelope[k + 1].from <= column as f64 {
                k += 1;
            }
            let Parabola { column: foot, step, .. } = envelope[k];
            let across = column as i64 - foot as i64;
            let squared = across * across + i64::from(step) * i64::from(step);
            let index = row * columns + column;
            self.squared.cells[index] = squared.min(i64::from(u32::MAX)) as u32;
            self.nearest.cells[index] = ((row as i64 + i64::from(step)) * columns as i64 + foot as i64) as u32;
        }
    }
}

/// One wall cell seen from a row: where its parabola begins to be the lowest.
#[derive(Debug, Clone, Copy)]
struct Parabola {
    column: usize,
    step: i32,
    from: f64,
}

/// The signed step along its column from every cell to the nearest wall cell.
fn column_steps(free: &Plane<bool>) -> Vec<i32> {
    let columns = free.columns;
    let mut steps = vec![0_i32; free.cells.len()];
    for row in 0..free.rows {
        for column in 0..columns {
            let index = row * columns + column;
            steps[index] = match (free.cells[index], row) {
                (false, _) => 0,
                (true, 0) => FAR,
                (true, _) => match steps[index - columns] {
                    FAR => FAR,
                    above => above - 1,
                },
            };
        }
    }
    for row in (0..free.rows.saturating_sub(1)).rev() {
        for column in 0..columns {
            let index = row * columns + column;
            let below = steps[index + columns];
            if free.cells[index] && below != FAR && below >= 0 && below + 1 < steps[index].saturating_abs() {
                steps[index] = below + 1;
            }
        }
    }
    steps
}

/// The lower envelope of the parabolas of `columns` of a row.
#[expect(clippy::cast_precision_loss, reason = "columns and steps stay far below 2^26, their squares below 2^52")]
fn lower_envelope(steps: &[i32], columns: std::ops::Range<usize>, envelope: &mut Vec<Parabola>) {
    envelope.clear();
    for column in columns {
        let step = steps[column];
        if step == FAR {
            continue;
        }
        let height = (column as f64).powi(2) + f64::from(step).powi(2);
        let mut from = f64::NEG_INFINITY;
        while let Some(last) = envelope.last() {
            let last_height = (last.column as f64).powi(2) + f64::from(last.step).powi(2);
            from = (height - last_height) / (2.0 * (column - last.column) as f64);
            if from > last.from {
                break;
            }
            envelope.pop();
            from = f64::NEG_INFINITY;
        }
        envelope.push(Parabola { column, step, from });
    }
}

/// The runs of `true`.
pub(crate) fn runs(row: &[bool]) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + row[at..].iter().position(|&free| free)?;
        let end = row[start..].iter().position(|&free| !free).map_or(row.len(), |n| start + n);
        at = end;
        Some(start..end)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};

    #[test]
    fn distances_are_those_of_brute_force() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        for density in [0.02, 0.2, 0.6] {
            let (rows, columns) = (31, 44);
            let mut free = Plane::filled(rows, columns, false);
            for row in 1..rows - 1 {
                for column in 1..columns - 1 {
                    free.cells[row * columns + column] = !rng.random_bool(density);
                }
            }
            let field = DistanceField::new(&free);
            let walls: Vec<_> = (0..free.cells.len()).filter(|&i| !free.cells[i]).map(|i| free.position(i)).collect();
            for index in 0..free.cells.len() {
                let (r, c) = free.position(index);
                let squared = |&(wr, wc): &(i32, i32)| ((wr - r).pow(2) + (wc - c).pow(2)).unsigned_abs();
                let least = walls.iter().map(squared).min().unwrap();
                assert_eq!(field.squared.cells[index], least, "cell {r},{c}");
                if free.cells[index] {
                    let nearest = free.position(field.nearest.cells[index] as usize);
                    assert_eq!(squared(&nearest), least);
                }
            }
        }
    }
}

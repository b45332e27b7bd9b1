/// The distance of each cell from the nearest marked one, centre to centre in cells; infinite where none is marked.
///
/// Exact, in time linear in the cells: lower envelopes of parabolas, along columns, then along rows
/// (Felzenszwalb & Huttenlocher 2012).
pub(super) fn distances(marked: &[bool], rows: usize, columns: usize) -> Vec<f64> {
    let mut squares: Vec<f64> = marked.iter().map(|&marked| if marked { 0.0 } else { f64::INFINITY }).collect();
    let mut line = Vec::new();
    for column in 0..columns {
        line.clear();
        line.extend((0..rows).map(|row| squares[row * columns + column]));
        for (row, square) in envelope(&line).into_iter().enumerate() {
            squares[row * columns + column] = square;
        }
    }
    for row in squares.chunks_exact_mut(columns.max(1)) {
        let nearer = envelope(row);
        row.copy_from_slice(&nearer);
    }
    squares.iter().map(|square| square.sqrt()).collect()
}

/// `min over j of f(j) + (i − j)²` for every `i`.
#[expect(clippy::cast_precision_loss, reason = "places on a line of cells")]
fn envelope(f: &[f64]) -> Vec<f64> {
    // The parabolas of the envelope, each with the place from which it is the lowest.
    let mut hull: Vec<(usize, f64)> = Vec::new();
    for (j, &height) in f.iter().enumerate().filter(|(_, height)| height.is_finite()) {
        let meets = |&(k, _): &(usize, f64)| {
            let (a, b) = (j as f64, k as f64);
            ((height + a * a) - (f[k] + b * b)) / (2.0 * (a - b))
        };
        while hull.last().is_some_and(|last| meets(last) <= last.1) {
            hull.pop();
        }
        let from = hull.last().map_or(f64::NEG_INFINITY, meets);
        hull.push((j, from));
    }
    let mut lowest = hull.iter().peekable();
    let mut current = lowest.next();
    let at = |i: usize| {
        while lowest.peek().is_some_and(|next| next.1 <= i as f64) {
            current = lowest.next();
        }
        current.map_or(f64::INFINITY, |&(j, _)| f[j] + (i as f64 - j as f64).powi(2))
    };
    (0..f.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_a_full_search() {
        let (rows, columns) = (13, 17);
        for seed in 0..20usize {
            let marked: Vec<bool> =
                (0..rows * columns).map(|at| (at * 7919 + seed * 104_729) % 31 < seed / 4).collect();
            for (at, distance) in distances(&marked, rows, columns).into_iter().enumerate() {
                let to = |other: usize| {
                    let apart = |a: usize, b: usize| f64::from(u32::try_from(a.abs_diff(b)).unwrap());
                    apart(at / columns, other / columns).hypot(apart(at % columns, other % columns))
                };
                let nearest = (0..marked.len()).filter(|&other| marked[other]).map(to).fold(f64::INFINITY, f64::min);
                assert!((distance - nearest).abs() < 1e-9 || distance == nearest);
            }
        }
    }
}

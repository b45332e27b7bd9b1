//! How well regions agree with rooms cut by hand: best overlap both ways, and one-to-one IoU.

/// Agreement of one segmentation with the truth.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Score {
    /// Mean over true rooms of the share inside their best found region.
    pub(crate) recall: f64,
    /// Mean over found regions of the share inside their best true room.
    pub(crate) precision: f64,
    /// Sum of IoU over the best one-to-one assignment, divided by the larger number of regions.
    pub(crate) iou: f64,
    /// Regions found.
    pub(crate) found: usize,
    /// Rooms in truth.
    pub(crate) truth: usize,
}

impl Score {
    /// Means of the shares, sums of the counts.
    pub(crate) fn mean(all: &[Self]) -> Self {
        let mean = |share: fn(&Self) -> f64| all.iter().map(share).sum::<f64>() / all.len().max(1) as f64;
        Self {
            recall: mean(|score| score.recall),
            precision: mean(|score| score.precision),
            iou: mean(|score| score.iou),
            found: all.iter().map(|score| score.found).sum(),
            truth: all.iter().map(|score| score.truth).sum(),
        }
    }
}

/// Scores labels (0 = none) against labels; regions of fewer than `least` cells are ignored on both sides.
pub(crate) fn score(found: &[u32], truth: &[u32], least: usize) -> Score {
    let (found, found_sizes) = renumber(found, least);
    let (truth, truth_sizes) = renumber(truth, least);
    let (n, m) = (found_sizes.len(), truth_sizes.len());
    let mut overlap = vec![vec![0_usize; m]; n];
    for (&f, &t) in found.iter().zip(&truth) {
        if f > 0 && t > 0 {
            overlap[f as usize - 1][t as usize - 1] += 1;
        }
    }
    let best_of_found = |f: usize| (0..m).map(|t| overlap[f][t]).max().unwrap_or(0) as f64 / found_sizes[f] as f64;
    let best_of_truth = |t: usize| (0..n).map(|f| overlap[f][t]).max().unwrap_or(0) as f64 / truth_sizes[t] as f64;
    let larger = n.max(m);
    let mut gain = vec![vec![0.0; larger]; larger];
    for f in 0..n {
        for t in 0..m {
            gain[f][t] = overlap[f][t] as f64 / (found_sizes[f] + truth_sizes[t] - overlap[f][t]) as f64;
        }
    }
    let total: f64 = assign(&gain).iter().enumerate().map(|(f, &t)| gain[f][t]).sum();
    Score {
        recall: (0..m).map(best_of_truth).sum::<f64>() / m.max(1) as f64,
        precision: (0..n).map(best_of_found).sum::<f64>() / n.max(1) as f64,
        iou: total / larger.max(1) as f64,
        found: n,
        truth: m,
    }
}

/// Labels 1, 2, … of the regions with at least `least` cells, and their sizes.
fn renumber(labels: &[u32], least: usize) -> (Vec<u32>, Vec<usize>) {
    let mut sizes = vec![0_usize; labels.iter().max().map_or(0, |&l| l as usize) + 1];
    labels.iter().for_each(|&l| sizes[l as usize] += 1);
    let mut names = vec![0; sizes.len()];
    let mut kept = Vec::new();
    for label in 1..sizes.len() {
        if sizes[label] >= least.max(1) {
            kept.push(sizes[label]);
            names[label] = u32::try_from(kept.len()).unwrap_or(u32::MAX);
        }
    }
    (labels.iter().map(|&l| names[l as usize]).collect(), kept)
}

/// The assignment of rows to columns with the greatest sum (Kuhn 1955, Munkres 1957; shortest augmenting paths).
fn assign(gain: &[Vec<f64>]) -> Vec<usize> {
    let n = gain.len();
    let (mut u, mut v) = (vec![0.0; n + 1], vec![0.0; n + 1]);
    let (mut row_of, mut way) = (vec![0; n + 1], vec![0; n + 1]);
    for i in 1..=n {
        row_of[0] = i;
        let mut j0 = 0;
        let mut least = vec![f64::INFINITY; n + 1];
        let mut used = vec![false; n + 1];
        loop {
            used[j0] = true;
            let (i0, mut delta, mut j1) = (row_of[j0], f64::INFINITY, 0);
            for j in 1..=n {
                if !used[j] {
                    let reduced = -gain[i0 - 1][j - 1] - u[i0] - v[j];
                    if reduced < least[j] {
                        (least[j], way[j]) = (reduced, j0);
                    }
                    if least[j] < delta {
                        (delta, j1) = (least[j], j);
                    }
                }
            }
            for j in 0..=n {
                if used[j] {
                    u[row_of[j]] += delta;
                    v[j] -= delta;
                } else {
                    least[j] -= delta;
                }
            }
            j0 = j1;
            if row_of[j0] == 0 {
                break;
            }
        }
        while j0 != 0 {
            row_of[j0] = row_of[way[j0]];
            j0 = way[j0];
        }
    }
    let mut columns = vec![0; n];
    for j in 1..=n {
        columns[row_of[j] - 1] = j - 1;
    }
    columns
}

use nalgebra::Vector2;

use super::{CellClass, Signature, as_f64, whole};
use crate::GridFrame;

/// How many cells of one row or column are of which class.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Count {
    /// Cells that are occupied.
    pub occupied: u32,
    /// Cells that are empty.
    pub empty: u32,
    /// Cells of which nothing is known.
    pub unknown: u32,
}

/// The counts of all rows, or of all columns.
pub type AxisHistogram = Vec<Count>;

/// How well the histograms of two signatures agree when one is shifted against the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistogramMatch {
    /// The second place's centre in the frame of the first, in metres.
    pub offset: Vector2<f64>,
    /// Similarity of the columns at the best shift along `x`, in `[0, 1]`.
    pub similarity_x: f64,
    /// Similarity of the rows at the best shift along `y`, in `[0, 1]`.
    pub similarity_y: f64,
}

impl HistogramMatch {
    /// The likelihood of both axes, `(sim_x · sim_y)^sharpness`; 4 to 10 sharpen well.
    #[must_use]
    pub fn likelihood(&self, sharpness: f64) -> f64 {
        (self.similarity_x * self.similarity_y).powf(sharpness)
    }
}

impl Count {
    fn add(&mut self, class: CellClass) {
        self.occupied += u32::from(class == CellClass::Occupied);
        self.empty += u32::from(class == CellClass::Empty);
        self.unknown += u32::from(class == CellClass::Unknown);
    }
}

/// Counts of columns and rows.
pub(super) fn of(frame: &GridFrame, classes: &[CellClass]) -> (AxisHistogram, AxisHistogram) {
    let mut columns = vec![Count::default(); frame.columns()];
    let mut rows = vec![Count::default(); frame.rows()];
    for (classes, row) in classes.chunks_exact(frame.columns().max(1)).zip(&mut rows) {
        for (class, column) in classes.iter().zip(&mut columns) {
            column.add(*class);
            row.add(*class);
        }
    }
    (columns, rows)
}

pub(super) fn compare(a: &Signature, b: &Signature, reach: f64) -> HistogramMatch {
    let resolution = a.frame.resolution();
    if (resolution - b.frame.resolution()).abs() > 1e-9 * resolution {
        return HistogramMatch { offset: Vector2::zeros(), similarity_x: 0.0, similarity_y: 0.0 };
    }
    let most = i64::try_from(whole(reach / resolution)).unwrap_or(i64::MAX);
    // Both lattices have their own corner; a bin of `b` shifted by s bins lies at corner_b + offset.
    let corners = (a.frame.origin() - b.frame.origin()) / resolution;
    let (x, similarity_x) = best_shift(&a.columns, &b.columns, most, corners.x);
    let (y, similarity_y) = best_shift(&a.rows, &b.rows, most, corners.y);
    HistogramMatch { offset: Vector2::new(x, y) * resolution, similarity_x, similarity_y }
}

/// The offset in cells, and its similarity, of the shift that agrees best; of equals the shortest.
fn best_shift(a: &[Count], b: &[Count], reach: i64, corner: f64) -> (f64, f64) {
    let mut best = (0.0, 0.0);
    // `b`'s bin k lies over `a`'s bin k + shift when b is offset by shift + corner cells.
    #[expect(clippy::cast_possible_truncation, reason = "signatures of places lie less than a cell askew")]
    let centre = -(corner.round() as i64);
    let mut shifts: Vec<i64> = (-reach..=reach).collect();
    shifts.sort_by_key(|shift| shift.abs());
    for shift in shifts {
        let similarity = similarity(a, b, centre + shift);
        if similarity > best.1 {
            #[expect(clippy::cast_precision_loss, reason = "few bins")]
            let offset = (centre + shift) as f64 + corner;
            best = (offset, similarity);
        }
    }
    best
}

/// Common cells over all cells of the bins that overlap, unknown cells left out.
fn similarity(a: &[Count], b: &[Count], shift: i64) -> f64 {
    let skip = |n: i64| usize::try_from(n.max(0)).unwrap_or(usize::MAX);
    let (mut common, mut all) = (0u32, 0u32);
    for (a, b) in a.iter().skip(skip(shift)).zip(b.iter().skip(skip(-shift))) {
        common += a.occupied.min(b.occupied) + a.empty.min(b.empty);
        all += a.occupied.max(b.occupied) + a.empty.max(b.empty);
    }
    if all == 0 { 0.0 } else { as_f64(common as usize) / as_f64(all as usize) }
}

//! Fuzzy erosion, dilation and opening of memberships.

use local_grid::Grid;

/// A structuring element: a fuzzy set of steps from a cell to its neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Step along rows, step along columns, membership in `(0, 1]`.
    steps: Vec<(i32, i32, f32)>,
    flat: bool,
}

impl Element {
    /// All cells whose centres are within `radius` metres: membership 1.
    #[must_use]
    pub fn disc(radius: f64, resolution: f64) -> Self {
        Self::new(radius, resolution, |_| 1.0)
    }

    /// A disc that counts less towards its rim: `B(x) = 1 − |x| / (2 radius)`, from 1 in the middle to 1/2.
    #[must_use]
    pub fn cone(radius: f64, resolution: f64) -> Self {
        Self::new(radius, resolution, |share| 1.0 - 0.5 * share)
    }

    /// Nothing beyond 256 cells is looked at, nothing at all for a radius or a resolution that is no length.
    #[expect(clippy::cast_possible_truncation, reason = "at most 256, and memberships are f32")]
    fn new(radius: f64, resolution: f64, membership: impl Fn(f64) -> f64) -> Self {
        let cells = (radius / resolution).clamp(0.0, 256.0);
        let cells = if cells.is_nan() { 0.0 } else { cells };
        let reach = cells.floor() as i32;
        let mut steps = Vec::new();
        for row in -reach..=reach {
            for column in -reach..=reach {
                let distance = f64::from(row).hypot(f64::from(column));
                if distance <= cells {
                    steps.push((row, column, membership(distance / cells.max(1.0)) as f32));
                }
            }
        }
        let flat = steps.iter().all(|&(_, _, b)| b >= 1.0);
        Self { steps, flat }
    }
}

/// A conjunction `T` and the implication `I` that belongs to it: `T(b, m) ≤ x` exactly if `m ≤ I(b, x)`.
///
/// Only for such an adjoint pair is the opening what an opening should be: below its input, and itself when repeated.
/// `T = min` with `I(b, m) = max(1 − b, m)` is popular and is no such pair: around a hole in a row of ones, with
/// `B = [½, 1, ½]`, its "opening" fills the hole to ½.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Logic {
    /// `T(b, m) = max(0, b + m − 1)`, `I(b, m) = min(1, 1 − b + m)`.
    #[default]
    Lukasiewicz,
    /// `T(b, m) = min(b, m)`, `I(b, m) = 1` if `b ≤ m`, else `m`.
    Goedel,
}

impl Logic {
    fn and(self, b: f32, m: f32) -> f32 {
        match self {
            // Written without 1 − (1 − b) − (1 − m), so that both ways of rounding agree.
            Self::Lukasiewicz => (m - (1.0 - b)).max(0.0),
            Self::Goedel => b.min(m),
        }
    }

    fn implies(self, b: f32, m: f32) -> f32 {
        match self {
            Self::Lukasiewicz => (m + (1.0 - b)).min(1.0),
            Self::Goedel => {
                if b <= m {
                    1.0
                } else {
                    m
                }
            }
        }
    }
}

/// Fuzzy erosion `ε(x) = inf_y I(B(y − x), μ(y))`; beyond the grid `μ` is 0.
#[must_use]
pub fn erode(membership: &Grid<f32>, element: &Element, logic: Logic) -> Grid<f32> {
    fold(membership, element, 1.0, |least, b, m| least.min(logic.implies(b, m)), f32::min)
}

/// Fuzzy dilation `δ(x) = sup_y T(B(x − y), μ(y))`.
#[must_use]
pub fn dilate(membership: &Grid<f32>, element: &Element, logic: Logic) -> Grid<f32> {
    fold(membership, element, 0.0, |most, b, m| most.max(logic.and(b, m)), f32::max)
}

/// Fuzzy opening `δ(ε(μ))`: what is left of free space where the element does not fit is taken away.
///
/// ```
/// use region_map::{local_grid::{Grid, GridFrame}, nalgebra::Point2, opening, Element, Logic};
///
/// let frame = GridFrame::new(Point2::origin(), 0.1, 1, 5)?;
/// let slit = Grid::from_cells(frame, vec![1.0, 0.0, 1.0, 0.0, 1.0]).unwrap();
/// let opened = opening(&slit, &Element::disc(0.1, 0.1), Logic::default());
/// assert!(opened.cells().iter().all(|&m| m == 0.0)); // nothing is three cells wide
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn opening(membership: &Grid<f32>, element: &Element, logic: Logic) -> Grid<f32> {
    dilate(&erode(membership, element, logic), element, logic)
}

/// Folds the neighbourhood of every cell. A flat element is a plain minimum or maximum in both logics, and a disc is
/// symmetric, so the same steps serve erosion and dilation.
fn fold(
    membership: &Grid<f32>,
    element: &Element,
    start: f32,
    step: impl Fn(f32, f32, f32) -> f32,
    flat: impl Fn(f32, f32) -> f32,
) -> Grid<f32> {
    let frame = *membership.frame();
    let mut out = membership.map(|_| start);
    // Row by row and step by step, so that the inner loop runs along two rows.
    for row in 0..frame.rows() {
        for &(rows, columns, b) in &element.steps {
            let target = &mut out.cells_mut()[row * frame.columns()..(row + 1) * frame.columns()];
            let source = row.checked_add_signed(rows as isize).filter(|&r| r < frame.rows());
            let source = source.map(|r| &membership.cells()[r * frame.columns()..(r + 1) * frame.columns()]);
            let (skip, shift) = (columns.unsigned_abs() as usize, columns < 0);
            let inside = frame.columns().saturating_sub(skip);
            let (to, from, beyond) =
                if shift { (skip.min(frame.columns()), 0, 0..skip) } else { (0, skip, inside..frame.columns()) };
            for cell in &mut target[beyond.start.min(frame.columns())..beyond.end.min(frame.columns())] {
                *cell = step(*cell, b, 0.0);
            }
            let target = &mut target[to..to + inside];
            match source {
                None => target.iter_mut().for_each(|cell| *cell = step(*cell, b, 0.0)),
                Some(source) => {
                    let pairs = target.iter_mut().zip(&source[from.min(source.len())..]);
                    if element.flat {
                        pairs.for_each(|(cell, &m)| *cell = flat(*cell, m));
                    } else {
                        pairs.for_each(|(cell, &m)| *cell = step(*cell, b, m));
                    }
                }
            }
        }
    }
    out
}

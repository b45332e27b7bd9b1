mod descriptor;
mod histogram;

use nalgebra::{Point2, Vector2};

use crate::{Cell, Evidence, FrameError, Grid, GridFrame};

pub use descriptor::Descriptor;
pub use histogram::{AxisHistogram, Count, HistogramMatch};

/// How signatures are cut and how their cells are told apart.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct SignatureOptions {
    /// Edge of the square around the place, in metres.
    pub size: f64,
    /// A cell is occupied where it is more occupied than empty, and at least so much.
    pub occupied_above: f32,
    /// A cell is empty where it is more empty than occupied, and at least so much.
    pub empty_above: f32,
}

impl Default for SignatureOptions {
    fn default() -> Self {
        Self { size: 6.4, occupied_above: 0.1, empty_above: 0.1 }
    }
}

/// What a cell of a signature is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum CellClass {
    /// Nothing, or not enough, is known.
    #[default]
    Unknown,
    /// Free space.
    Empty,
    /// A wall, or anything else that echoes.
    Occupied,
}

/// What a place looks like: the local grid around it, oriented like the map, with its row and column histograms
/// (Duckett & Nehmzow 1998).
///
/// Its frame has the place at the origin. The lattice of cells may lie askew to the origin by less than a cell, because
/// signatures are cut out of working grids without resampling.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawSignature", into = "RawSignature"))]
pub struct Signature {
    frame: GridFrame,
    classes: Vec<CellClass>,
    columns: AxisHistogram,
    rows: AxisHistogram,
}

/// The signature as a file holds it: runs of equal cells; histograms are counted again when it is read.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct RawSignature {
    frame: GridFrame,
    runs: Vec<(u32, CellClass)>,
}

/// Why a stored signature cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SignatureError {
    /// Runs must fill the grid.
    #[error("a signature of {rows} rows and {columns} columns cannot hold {cells} cells")]
    Cells {
        /// Rows of the frame.
        rows: usize,
        /// Columns of the frame.
        columns: usize,
        /// Cells given.
        cells: usize,
    },
    /// The frame must be one.
    #[error("the frame of a signature is not one")]
    Frame(#[source] FrameError),
}

impl Signature {
    /// A signature of given cells in row-major order; `frame` has the place at its origin.
    ///
    /// # Errors
    ///
    /// The number of cells must be that of the frame.
    pub fn from_classes(frame: GridFrame, classes: Vec<CellClass>) -> Result<Self, SignatureError> {
        if classes.len() != frame.n_cells() {
            let (rows, columns, cells) = (frame.rows(), frame.columns(), classes.len());
            return Err(SignatureError::Cells { rows, columns, cells });
        }
        let (columns, rows) = histogram::of(&frame, &classes);
        Ok(Self { frame, classes, columns, rows })
    }

    /// Cuts the signature of the place at `grid_from_place` out of any grid; what lies outside of it is unknown.
    ///
    /// # Panics
    ///
    /// When `options.size` cells of the grid's resolution do not fit into memory.
    #[must_use]
    pub fn cut<C: Cell>(grid: &Grid<C>, grid_from_place: Point2<f64>, options: &SignatureOptions) -> Self {
        let resolution = grid.frame().resolution();
        let cells = whole(options.size / resolution).max(1);
        // The lattice corner of the square, in cells of the grid.
        let low = (grid_from_place - grid.frame().origin()) / resolution - Vector2::repeat(0.5 * as_f64(cells));
        let corner = low.map(f64::round);
        let origin = grid.frame().origin() + corner * resolution - grid_from_place;
        let frame = GridFrame::new(Point2::from(origin), resolution, cells, cells)
            .expect("a square of the grid's own resolution around a place in it");
        let of_grid = |first: f64, step: usize| {
            let at = first + as_f64(step);
            (at >= 0.0).then(|| whole(at)) // false for NaN
        };
        let columns: Vec<Option<usize>> = (0..cells).map(|column| of_grid(corner.x, column)).collect();
        let mut classes = Vec::with_capacity(cells * cells);
        for row in (0..cells).map(|row| of_grid(corner.y, row)) {
            let cell = |column: &Option<usize>| grid.get(row?, (*column)?);
            let class = |cell: Option<&C>| cell.map_or(CellClass::Unknown, |cell| options.class(cell.known()));
            classes.extend(columns.iter().map(|column| class(cell(column))));
        }
        Self::from_classes(frame, classes).expect("as many cells as the frame has")
    }

    /// Where the cells lie around the place, which is the origin.
    #[must_use]
    pub fn frame(&self) -> &GridFrame {
        &self.frame
    }

    /// All cells in row-major order, first row lowest.
    #[must_use]
    pub fn classes(&self) -> &[CellClass] {
        &self.classes
    }

    /// Counts of each column, along `+x`.
    #[must_use]
    pub fn columns(&self) -> &AxisHistogram {
        &self.columns
    }

    /// Counts of each row, along `+y`.
    #[must_use]
    pub fn rows(&self) -> &AxisHistogram {
        &self.rows
    }

    /// The centres of all occupied cells, in metres from the place.
    pub fn walls(&self) -> impl Iterator<Item = Point2<f64>> + '_ {
        let columns = self.frame.columns();
        let occupied = self.classes.iter().enumerate().filter(|(_, class)| **class == CellClass::Occupied);
        occupied.map(move |(index, _)| self.frame.center(index / columns, index % columns))
    }

    /// The share of cells of which something is known.
    #[must_use]
    pub fn known_share(&self) -> f64 {
        let known = self.classes.iter().filter(|class| **class != CellClass::Unknown).count();
        as_f64(known) / as_f64(self.classes.len().max(1))
    }

    /// The shift of `other` against this signature at which their histograms agree best, up to `reach` metres.
    ///
    /// Cheap, and only meaningful when both are oriented alike; see [`HistogramMatch`].
    #[must_use]
    pub fn histogram_match(&self, other: &Self, reach: f64) -> HistogramMatch {
        histogram::compare(self, other, reach)
    }
}

impl SignatureOptions {
    /// What a cell is of which so much is known.
    #[must_use]
    #[inline]
    pub fn class(&self, known: Evidence) -> CellClass {
        if known.occupied > known.empty && known.occupied >= self.occupied_above {
            CellClass::Occupied
        } else if known.empty > known.occupied && known.empty >= self.empty_above {
            CellClass::Empty
        } else {
            CellClass::Unknown
        }
    }
}

/// A non-negative float as a count, rounded.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates; grids bound it")]
fn whole(value: f64) -> usize {
    value.round() as usize
}

#[expect(clippy::cast_precision_loss, reason = "cells of a local grid are few")]
fn as_f64(count: usize) -> f64 {
    count as f64
}

#[cfg(feature = "serde")]
impl TryFrom<RawSignature> for Signature {
    type Error = SignatureError;

    fn try_from(raw: RawSignature) -> Result<Self, SignatureError> {
        let (rows, columns) = (raw.frame.rows(), raw.frame.columns());
        let claimed: usize = raw.runs.iter().map(|(run, _)| *run as usize).fold(0, usize::saturating_add);
        if claimed != raw.frame.n_cells() {
            return Err(SignatureError::Cells { rows, columns, cells: claimed });
        }
        let cells = raw.runs.iter().flat_map(|&(run, class)| std::iter::repeat_n(class, run as usize)).collect();
        Self::from_classes(raw.frame, cells)
    }
}

#[cfg(feature = "serde")]
impl From<Signature> for RawSignature {
    fn from(signature: Signature) -> Self {
        let mut runs: Vec<(u32, CellClass)> = Vec::new();
        for &class in &signature.classes {
            match runs.last_mut() {
                Some((run, last)) if *last == class && *run < u32::MAX => *run += 1,
                _ => runs.push((1, class)),
            }
        }
        Self { frame: signature.frame, runs }
    }
}

//! The map's degrees as 16-bit PNG images with a legend, so that nothing is lost in a threshold.

use std::io::{BufRead, Write};

use local_grid::{Fuzzy, FuzzyGrid, Grid, GridFrame};
use nalgebra::Point2;

use crate::Exposure;
use crate::derived::{Norm, derive};
use crate::map_server::ImageError;
use crate::picture::PictureError;

/// What a layer holds: one degree in `[0, 1]` per cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layer {
    /// `O`: membership in the occupied set.
    Occupied,
    /// `E`: membership in the empty set.
    Free,
    /// Readings contradict each other, as where furniture or doors were moved: see [`Exposure::contradiction`].
    Conflict,
    /// `(1 − E)(1 − O)`: hardly anything is known.
    Ignorance,
    /// `M`: what a planner should keep away from.
    Unsafe,
}

impl Layer {
    /// All layers.
    pub const ALL: [Self; 5] = [Self::Occupied, Self::Free, Self::Conflict, Self::Ignorance, Self::Unsafe];

    /// The layer's name, and its file's without `.png`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Occupied => "occupied",
            Self::Free => "free",
            Self::Conflict => "conflict",
            Self::Ignorance => "ignorance",
            Self::Unsafe => "unsafe",
        }
    }

    fn meaning(self) -> &'static str {
        match self {
            Self::Occupied => "degree to which the cell is occupied",
            Self::Free => "degree to which the cell is empty",
            Self::Conflict => "degree to which readings of the cell contradict each other",
            Self::Ignorance => "degree to which nothing is known of the cell",
            Self::Unsafe => "degree to which the cell is unsafe: occupied, contradictory or unexplored",
        }
    }

    /// The cell's degree; `exposure` is that of the map, and only the conflict asks for it.
    #[must_use]
    pub fn degree(self, cell: Fuzzy, exposure: Exposure) -> f32 {
        match self {
            Self::Occupied => cell.occupied,
            Self::Free => cell.empty,
            Self::Conflict => exposure.contradiction(cell),
            Self::Ignorance => derive(cell, Norm::Product).indeterminate,
            Self::Unsafe => derive(cell, Norm::Product).unsafety,
        }
    }
}

/// Writes one layer as a 16-bit PNG: 0 for a degree of 0, 65535 for 1, highest row first.
///
/// # Errors
///
/// Those of the writer, or a map too large for a PNG.
pub fn write_layer(grid: &FuzzyGrid, layer: Layer, out: impl Write) -> Result<(), PictureError> {
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    let size = |n: usize| u32::try_from(n).map_err(|_| PictureError::TooLarge);
    let mut encoder = png::Encoder::new(out, size(columns)?, size(rows)?);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    let exposure = Exposure::of(grid);
    let mut line = Vec::with_capacity(2 * columns);
    for row in grid.cells().chunks_exact(columns.max(1)).rev() {
        line.clear();
        for &cell in row {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 65535")]
            let level = (layer.degree(cell, exposure).clamp(0.0, 1.0) * 65_535.0).round() as u16;
            line.extend(level.to_be_bytes());
        }
        stream.write_all(&line).map_err(PictureError::Io)?;
    }
    stream.finish().map_err(PictureError::from)
}

/// Writes the legend of the layers as JSON: what each file holds, how to scale it, and where its pixels lie.
///
/// # Errors
///
/// Those of the writer.
pub fn write_legend(frame: &GridFrame, out: &mut impl Write) -> std::io::Result<()> {
    let layers = Layer::ALL.map(|layer| {
        serde_json::json!({
            "name": layer.name(), "file": format!("{}.png", layer.name()), "meaning": layer.meaning(),
            "unit": "degree", "value_of_0": 0.0, "value_of_65535": 1.0,
        })
    });
    let legend = serde_json::json!({
        "schema": "topogrid/layers/2",
        "resolution_m": frame.resolution(),
        "origin_m": [frame.origin().x, frame.origin().y],
        "origin_is": "the outer corner of the lowest, leftmost pixel; x east, y north",
        "rows": frame.rows(), "columns": frame.columns(), "first_row": "northernmost",
        "layers": layers,
    });
    serde_json::to_writer_pretty(&mut *out, &legend)?;
    writeln!(out)
}

/// Why layers cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LayerError {
    /// The legend is not one.
    #[error("the legend is not one of layers: {0}")]
    Legend(String),
    /// An image is broken.
    #[error("layer `{name}`: {error}")]
    Image {
        /// The layer.
        name: &'static str,
        /// What is wrong.
        error: ImageError,
    },
    /// An image is not of the size that the legend gives.
    #[error("layer `{name}` has {got} pixels, but the legend says {expected}")]
    Size {
        /// The layer.
        name: &'static str,
        /// As the legend says.
        expected: usize,
        /// As the image is.
        got: usize,
    },
}

/// The frame that a legend gives.
///
/// # Errors
///
/// Text that is no legend, or a frame that no grid can have.
pub fn read_legend(input: impl BufRead) -> Result<GridFrame, LayerError> {
    let wrong = |what: String| LayerError::Legend(what);
    let legend: serde_json::Value = serde_json::from_reader(input).map_err(|error| wrong(error.to_string()))?;
    if legend["schema"] != "topogrid/layers/2" {
        return Err(wrong(format!("`schema` must be \"topogrid/layers/2\", got {}", legend["schema"])));
    }
    let number = |value: &serde_json::Value, key: &str| {
        value.as_f64().ok_or_else(|| LayerError::Legend(format!("`{key}` must be a number, got {value}")))
    };
    let count = |key: &str| {
        let value = legend[key].as_u64().and_then(|count| usize::try_from(count).ok());
        value.ok_or_else(|| LayerError::Legend(format!("`{key}` must be a whole number, got {}", legend[key])))
    };
    let origin = Point2::new(number(&legend["origin_m"][0], "origin_m")?, number(&legend["origin_m"][1], "origin_m")?);
    let resolution = number(&legend["resolution_m"], "resolution_m")?;
    GridFrame::new(origin, resolution, count("rows")?, count("columns")?).map_err(|error| wrong(error.to_string()))
}

/// Reads the two layers that the others derive from.
///
/// # Errors
///
/// An image that is broken or not of the legend's size.
pub fn read_layers(frame: GridFrame, empty: impl BufRead, occupied: impl BufRead) -> Result<FuzzyGrid, LayerError> {
    let empty = degrees(&frame, Layer::Free, empty)?;
    let occupied = degrees(&frame, Layer::Occupied, occupied)?;
    let cells = empty.into_iter().zip(occupied).map(|(empty, occupied)| Fuzzy { empty, occupied }).collect();
    Ok(Grid::from_cells(frame, cells).unwrap_or_else(|_| Grid::new(frame)))
}

/// The degrees of a layer, lowest row first.
fn degrees(frame: &GridFrame, layer: Layer, input: impl BufRead) -> Result<Vec<f32>, LayerError> {
    let name = layer.name();
    let shades = crate::map_server::read_shades(input).map_err(|error| LayerError::Image { name, error })?;
    if (shades.height, shades.width) != (frame.rows(), frame.columns()) {
        return Err(LayerError::Size { name, expected: frame.n_cells(), got: shades.width * shades.height });
    }
    #[expect(clippy::cast_possible_truncation, reason = "degrees in [0, 1]")]
    let shade = |pixel| shades.shade(pixel) as f32;
    Ok((0..shades.height).rev().flat_map(|row| row * shades.width..(row + 1) * shades.width).map(shade).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> FuzzyGrid {
        let frame = GridFrame::new(Point2::new(-3.25, 1.5), 0.05, 3, 5).unwrap();
        let mut grid = FuzzyGrid::new(frame);
        for (at, cell) in (0u16..).zip(grid.cells_mut()) {
            *cell = Fuzzy { empty: f32::from(at) / 14.0, occupied: f32::from(at * at % 13) / 13.0 };
        }
        grid
    }

    fn written() -> [Vec<u8>; 3] {
        let (mut legend, mut empty, mut occupied) = (Vec::new(), Vec::new(), Vec::new());
        write_legend(grid().frame(), &mut legend).unwrap();
        write_layer(&grid(), Layer::Free, &mut empty).unwrap();
        write_layer(&grid(), Layer::Occupied, &mut occupied).unwrap();
        [legend, empty, occupied]
    }

    #[test]
    fn layers_read_back_to_sixteen_bits() {
        let [legend, empty, occupied] = written();
        let frame = read_legend(legend.as_slice()).unwrap();
        assert_eq!(frame, *grid().frame());
        let read = read_layers(frame, empty.as_slice(), occupied.as_slice()).unwrap();
        for (read, cell) in read.cells().iter().zip(grid().cells()) {
            approx::assert_abs_diff_eq!(read.empty, cell.empty, epsilon = 1e-5);
            approx::assert_abs_diff_eq!(read.occupied, cell.occupied, epsilon = 1e-5);
        }
    }

    #[test]
    fn layers_that_do_not_fit_are_refused() {
        let [legend, empty, occupied] = written();
        let text = String::from_utf8(legend).unwrap();
        let other = read_legend(text.replace("\"rows\": 3", "\"rows\": 4").as_bytes()).unwrap();
        let error = read_layers(other, empty.as_slice(), occupied.as_slice()).unwrap_err();
        assert_eq!(error.to_string(), "layer `free` has 15 pixels, but the legend says 20");
        let cut = read_layers(*grid().frame(), &empty[..empty.len() / 2], occupied.as_slice());
        assert!(matches!(cut, Err(LayerError::Image { name: "free", .. })));
        for wrong in ["", "{}", "[1, 2]", &text.replace("0.05", "0"), &text.replace("layers/2", "layers/9")] {
            assert!(matches!(read_legend(wrong.as_bytes()), Err(LayerError::Legend(_))));
        }
    }
}

//! The map as a picture for people: empty, occupied, contradictory and unexplored told apart by colour.

mod font;

use std::io::Write;

use local_grid::{Fuzzy, FuzzyGrid};

use font::{GLYPH_HEIGHT, write_text};

/// A colour: red, green, blue.
pub(crate) type Rgb = [u8; 3];

const EMPTY: Rgb = [255, 255, 255];
const OCCUPIED: Rgb = [16, 24, 32];
const CONTRADICTORY: Rgb = [230, 90, 20];
const UNEXPLORED: Rgb = [158, 172, 188];
const INK: Rgb = [40, 44, 52];
const PAPER: Rgb = [244, 244, 240];

/// Pixels that the longer side of the map should at least have.
const LEAST_SIDE: usize = 900;
/// Pixels between the map and the rim.
const MARGIN: usize = 16;
/// Pixels of the strip below the map.
const STRIP: usize = 64;
/// Least width that the legend needs.
const LEGEND_WIDTH: usize = 660;

/// An image in memory.
pub(crate) struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Canvas {
    pub(crate) fn new(width: usize, height: usize, paper: Rgb) -> Self {
        Self { width, height, pixels: paper.repeat(width * height) }
    }

    pub(crate) fn set(&mut self, x: usize, y: usize, color: Rgb) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.pixels[at..at + 3].copy_from_slice(&color);
        }
    }

    pub(crate) fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, color: Rgb) {
        for y in y..y + height {
            for x in x..x + width {
                self.set(x, y, color);
            }
        }
    }

    pub(crate) fn encode(&self, out: impl Write) -> Result<(), png::EncodingError> {
        let size = |n: usize| u32::try_from(n).map_err(|_| png::EncodingError::LimitsExceeded);
        let mut encoder = png::Encoder::new(out, size(self.width)?, size(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.write_header()?.write_image_data(&self.pixels)
    }
}

/// The colour of a cell: the four corners of the unit square of (empty, occupied), mixed by the product norm.
fn color_of(cell: Fuzzy) -> Rgb {
    let (e, o) = (cell.empty.clamp(0.0, 1.0), cell.occupied.clamp(0.0, 1.0));
    let weights = [(1.0 - e) * (1.0 - o), e * (1.0 - o), o * (1.0 - e), e * o];
    let corners = [UNEXPLORED, EMPTY, OCCUPIED, CONTRADICTORY];
    [0, 1, 2].map(|channel| {
        let mixed: f32 = weights.iter().zip(&corners).map(|(weight, color)| weight * f32::from(color[channel])).sum();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a mean of bytes is a byte")]
        let byte = mixed.round() as u8;
        byte
    })
}

/// Draws the map as a PNG with a scale bar, an arrow to the north and a legend.
///
/// White is empty, black occupied, orange contradictory, grey-blue unexplored; colours in between are degrees in between.
///
/// # Errors
///
/// Those of the writer, or a map too large for a PNG.
pub fn write_picture(grid: &FuzzyGrid, out: impl Write) -> Result<(), PictureError> {
    paint(grid).encode(out).map_err(PictureError::from)
}

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The writer failed.
    #[error("the image could not be written")]
    Io(#[source] std::io::Error),
    /// The image is larger than the format allows.
    #[error("the image is larger than PNG allows")]
    TooLarge,
}

impl From<png::EncodingError> for PictureError {
    fn from(error: png::EncodingError) -> Self {
        match error {
            png::EncodingError::IoError(error) => Self::Io(error),
            _ => Self::TooLarge,
        }
    }
}

fn paint(grid: &FuzzyGrid) -> Canvas {
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    let zoom = LEAST_SIDE.div_ceil(rows.max(columns).max(1)).max(1);
    let width = (columns * zoom + 2 * MARGIN).max(LEGEND_WIDTH);
    let mut canvas = Canvas::new(width, rows * zoom + 2 * MARGIN + STRIP, PAPER);
    for (index, &cell) in grid.cells().iter().enumerate() {
        let (row, column) = (rows - 1 - index / columns, index % columns);
        canvas.fill(MARGIN + column * zoom, MARGIN + row * zoom, zoom, zoom, color_of(cell));
    }
    #[expect(clippy::cast_precision_loss, reason = "a zoom is a small number")]
    let pixels_per_metre = zoom as f64 / grid.frame().resolution();
    paint_strip(&mut canvas, rows * zoom + 2 * MARGIN, pixels_per_metre);
    canvas
}

/// Scale bar, north arrow and legend, below the map.
fn paint_strip(canvas: &mut Canvas, top: usize, pixels_per_metre: f64) {
    let (length, pixels) = scale_bar(pixels_per_metre);
    canvas.fill(MARGIN, top + 22, pixels, 4, INK);
    for end in [MARGIN, MARGIN + pixels - 2] {
        canvas.fill(end, top + 17, 2, 14, INK);
    }
    write_text(canvas, MARGIN, top, 2, INK, &format!("{length} m"));
    let arrow = MARGIN + 300;
    for step in 0..12 {
        canvas.fill(arrow - step / 2, top + step, step | 1, 1, INK);
    }
    canvas.fill(arrow - 1, top + 12, 3, 22, INK);
    write_text(canvas, arrow + 12, top + 10, 2, INK, "N");
    let entries =
        [(EMPTY, "empty"), (OCCUPIED, "occupied"), (CONTRADICTORY, "contradictory"), (UNEXPLORED, "unexplored")];
    for (place, (color, name)) in entries.into_iter().enumerate() {
        let (x, y) = (MARGIN + 350 + 120 * (place % 2), top + 26 * (place / 2));
        canvas.fill(x, y, 18, 18, INK);
        canvas.fill(x + 1, y + 1, 16, 16, color);
        write_text(canvas, x + 24, y + 9 - GLYPH_HEIGHT / 2, 1, INK, name);
    }
}

/// A round length of at most 240 pixels, in metres, and its pixels.
fn scale_bar(pixels_per_metre: f64) -> (f64, usize) {
    let longest = 240.0 / pixels_per_metre;
    let decade = 10f64.powf(longest.log10().floor());
    let length = [5.0, 2.0, 1.0].into_iter().map(|step| step * decade).find(|&length| length <= longest);
    let length = length.unwrap_or(decade);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 240")]
    let pixels = (length * pixels_per_metre).round() as usize;
    (length, pixels.max(2))
}

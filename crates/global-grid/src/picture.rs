//! The map as a picture for people: empty, occupied, contradictory and unexplored told apart by colour.

mod indexed;
mod text;
mod tone;

use std::io::Write;

use local_grid::{FuzzyGrid, GridFrame};
use nalgebra::{Point2, Vector2};

use crate::Exposure;
pub use indexed::write_indexed;
pub(crate) use indexed::write_pixels;
use text::{LINE, width_of, write_text};
use tone::{CONTRADICTORY, EMPTY, OCCUPIED, UNEXPLORED, color_of};

/// A colour: red, green, blue.
pub(crate) type Rgb = [u8; 3];

const INK: Rgb = [40, 44, 52];
const PAPER: Rgb = [244, 244, 240];
const PATH: Rgb = [20, 110, 220];

/// Pixels that the longer side of the map should at least have.
const LEAST_SIDE: usize = 900;
/// Pixels between the map and the rim.
const MARGIN: usize = 16;
/// Pixels of the strip below the map.
const STRIP: usize = 52;
/// Pixels of the line of names above maps side by side.
const TITLE: usize = LINE + 4;
/// Least width that the strip needs.
const STRIP_WIDTH: usize = 900;
/// Edge of a square of colour in the legend.
const SWATCH: usize = 16;

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

    /// Covers a pixel in part: 0 not at all, 255 wholly.
    fn blend(&mut self, x: usize, y: usize, color: Rgb, coverage: u8) {
        if coverage > 0 && x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            let below = [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]];
            self.set(x, y, tone::mix(below, color, f32::from(coverage) / 255.0));
        }
    }

    pub(crate) fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, color: Rgb) {
        for y in y..y + height {
            for x in x..x + width {
                self.set(x, y, color);
            }
        }
    }

    /// A filled disc; what lies beyond the picture is left out.
    fn dot(&mut self, at: Vector2<f64>, radius: usize, color: Rgb) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating, then clipped")]
        let (x, y) = (at.x.round() as usize, at.y.round() as usize);
        for (dy, dx) in (0..=2 * radius).flat_map(|dy| (0..=2 * radius).map(move |dx| (dy, dx))) {
            if dy.abs_diff(radius).pow(2) + dx.abs_diff(radius).pow(2) <= radius.pow(2) {
                self.set((x + dx).wrapping_sub(radius), (y + dy).wrapping_sub(radius), color);
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

/// Draws the map as a PNG with a scale bar, an arrow to the north and a legend.
///
/// White is empty, black occupied, orange contradictory (as much evidence for as against), grey-blue unexplored; colours in
/// between are degrees in between. Maps of few or timid readings are exposed longer, and the legend says by how much: see
/// [`Exposure`].
///
/// # Errors
///
/// Those of the writer, or a map too large for a PNG.
pub fn write_picture(grid: &FuzzyGrid, out: impl Write) -> Result<(), PictureError> {
    paint(grid).encode(out).map_err(PictureError::from)
}

/// As [`write_picture`], with a path drawn over the map: points in metres in the frame of the grid.
///
/// # Errors
///
/// As [`write_picture`].
pub fn write_path(grid: &FuzzyGrid, path: &[Point2<f64>], out: impl Write) -> Result<(), PictureError> {
    let mut canvas = paint(grid);
    let zoom = zoom_of(grid.frame());
    for pair in path.windows(2) {
        let (from, to) = (pixel(grid.frame(), zoom, pair[0]), pixel(grid.frame(), zoom, pair[1]));
        let steps = (to - from).amax().ceil().max(1.0);
        let mut step = 0.0;
        while step <= steps {
            canvas.dot(from + (to - from) * (step / steps), 1, PATH);
            step += 1.0;
        }
    }
    for end in [path.first(), path.last()].into_iter().flatten() {
        canvas.dot(pixel(grid.frame(), zoom, *end), 4, PATH);
    }
    canvas.encode(out).map_err(PictureError::from)
}

/// Draws maps of the same place side by side under their names, with one legend.
///
/// # Errors
///
/// As [`write_picture`].
pub fn write_side_by_side(maps: &[(&str, &FuzzyGrid)], out: impl Write) -> Result<(), PictureError> {
    let zoom = maps.iter().map(|(_, grid)| zoom_of(grid.frame())).min().unwrap_or(1).div_ceil(2);
    let size = |grid: &FuzzyGrid| (grid.frame().columns() * zoom, grid.frame().rows() * zoom);
    let width: usize = maps.iter().map(|(_, grid)| size(grid).0 + MARGIN).sum();
    let height = maps.iter().map(|(_, grid)| size(grid).1).max().unwrap_or(0);
    let mut canvas = Canvas::new((width + MARGIN).max(STRIP_WIDTH), TITLE + height + 2 * MARGIN + STRIP, PAPER);
    let exposure = Exposure::of_all(maps.iter().map(|(_, grid)| *grid));
    let mut left = MARGIN;
    for (name, grid) in maps {
        write_text(&mut canvas, left, MARGIN / 2, INK, name);
        paint_cells(&mut canvas, grid, (left, TITLE + MARGIN), (zoom, exposure));
        left += size(grid).0 + MARGIN;
    }
    if let Some((_, grid)) = maps.first() {
        paint_strip(&mut canvas, TITLE + height + 2 * MARGIN, pixels_per_metre(grid.frame(), zoom), exposure);
    }
    canvas.encode(out).map_err(PictureError::from)
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
    let (frame, zoom) = (grid.frame(), zoom_of(grid.frame()));
    let width = (frame.columns() * zoom + 2 * MARGIN).max(STRIP_WIDTH);
    let mut canvas = Canvas::new(width, frame.rows() * zoom + 2 * MARGIN + STRIP, PAPER);
    let exposure = Exposure::of(grid);
    paint_cells(&mut canvas, grid, (MARGIN, MARGIN), (zoom, exposure));
    paint_strip(&mut canvas, frame.rows() * zoom + 2 * MARGIN, pixels_per_metre(frame, zoom), exposure);
    canvas
}

fn paint_cells(
    canvas: &mut Canvas,
    grid: &FuzzyGrid,
    (left, top): (usize, usize),
    (zoom, exposure): (usize, Exposure),
) {
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    for (index, &cell) in grid.cells().iter().enumerate() {
        let (row, column) = (rows - 1 - index / columns, index % columns);
        canvas.fill(left + column * zoom, top + row * zoom, zoom, zoom, color_of(exposure, cell));
    }
}

/// Pixels per cell.
fn zoom_of(frame: &GridFrame) -> usize {
    LEAST_SIDE.div_ceil(frame.rows().max(frame.columns()).max(1)).max(1)
}

#[expect(clippy::cast_precision_loss, reason = "a zoom is a small number")]
fn pixels_per_metre(frame: &GridFrame, zoom: usize) -> f64 {
    zoom as f64 / frame.resolution()
}

/// Where on the picture a point lies.
#[expect(clippy::cast_precision_loss, reason = "sizes of pictures")]
fn pixel(frame: &GridFrame, zoom: usize, point: Point2<f64>) -> Vector2<f64> {
    let from_corner = (point - frame.origin()) * pixels_per_metre(frame, zoom);
    Vector2::new(from_corner.x, (frame.rows() * zoom) as f64 - from_corner.y).add_scalar(MARGIN as f64)
}

/// Scale bar, north arrow and legend, below the map.
fn paint_strip(canvas: &mut Canvas, top: usize, pixels_per_metre: f64, exposure: Exposure) {
    let (length, pixels) = scale_bar(pixels_per_metre);
    let middle = top + STRIP / 2 - MARGIN / 2;
    canvas.fill(MARGIN, middle + 8, pixels, 3, INK);
    for end in [MARGIN, MARGIN + pixels - 2] {
        canvas.fill(end, middle + 3, 2, 13, INK);
    }
    let label = format!("{length} m");
    write_text(canvas, MARGIN + (pixels.max(width_of(&label)) - width_of(&label)) / 2, middle - LINE, INK, &label);
    let arrow = MARGIN + 270;
    for step in 0..12 {
        canvas.fill(arrow - step / 2, middle - 13 + step, step | 1, 1, INK);
    }
    canvas.fill(arrow - 1, middle - 1, 3, 17, INK);
    write_text(canvas, arrow + 10, middle - LINE / 2, INK, "N");
    let entries =
        [(EMPTY, "empty"), (OCCUPIED, "occupied"), (CONTRADICTORY, "contradictory"), (UNEXPLORED, "unexplored")];
    let mut left = arrow + 50;
    for (color, name) in entries {
        canvas.fill(left, middle - SWATCH / 2, SWATCH, SWATCH, INK);
        canvas.fill(left + 1, middle + 1 - SWATCH / 2, SWATCH - 2, SWATCH - 2, color);
        write_text(canvas, left + SWATCH + 6, middle - LINE / 2, INK, name);
        left += SWATCH + 6 + width_of(name) + 18;
    }
    if exposure.factor() > 1.0 {
        write_text(canvas, left, middle - LINE / 2, INK, &format!("evidence x{:.1}", exposure.factor()));
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

#[cfg(test)]
mod tests {
    use super::*;
    use local_grid::Fuzzy;

    fn grid() -> FuzzyGrid {
        let mut grid = FuzzyGrid::new(GridFrame::new(Point2::origin(), 0.1, 20, 30).unwrap());
        *grid.get_mut(0, 0).unwrap() = Fuzzy { empty: 1.0, occupied: 0.0 };
        *grid.get_mut(19, 29).unwrap() = Fuzzy { empty: 1.0, occupied: 1.0 };
        grid
    }

    fn pixel_at(canvas: &Canvas, x: usize, y: usize) -> &[u8] {
        &canvas.pixels[3 * (y * canvas.width + x)..][..3]
    }

    #[test]
    fn north_is_up() {
        let canvas = paint(&grid());
        let last = MARGIN + 20 * zoom_of(grid().frame()) - 1;
        assert_eq!(pixel_at(&canvas, MARGIN, last), EMPTY);
        assert_eq!(pixel_at(&canvas, MARGIN + 30 * zoom_of(grid().frame()) - 1, MARGIN), CONTRADICTORY);
    }

    #[test]
    fn scale_bars_are_round_and_fit() {
        for (pixels_per_metre, length) in [(20.0, 10.0), (100.0, 2.0), (0.7, 200.0), (250.0, 0.5)] {
            let bar = scale_bar(pixels_per_metre);
            approx::assert_relative_eq!(bar.0, length, epsilon = 1e-9);
            assert!(bar.1 <= 240);
        }
    }

    #[test]
    fn pictures_are_pngs() {
        let path = [Point2::new(0.05, 0.05), Point2::new(2.9, 1.9), Point2::new(99.0, -99.0)]; // also beyond the map
        let mut bytes = [Vec::new(), Vec::new()];
        write_path(&grid(), &path, &mut bytes[0]).unwrap();
        write_side_by_side(&[("fuzzy", &grid()), ("bayes", &grid())], &mut bytes[1]).unwrap();
        for bytes in bytes {
            let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
        }
    }
}

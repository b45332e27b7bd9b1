//! The map as a picture for people: empty, occupied, contradictory and unexplored told apart by colour.

mod font;
mod indexed;

use std::io::Write;

use local_grid::{Fuzzy, FuzzyGrid, GridFrame};
use nalgebra::{Point2, Vector2};

use font::{GLYPH_HEIGHT, write_text};
pub use indexed::write_indexed;
pub(crate) use indexed::write_pixels;

/// A colour: red, green, blue.
pub(crate) type Rgb = [u8; 3];

const EMPTY: Rgb = [255, 255, 255];
const OCCUPIED: Rgb = [16, 24, 32];
const CONTRADICTORY: Rgb = [230, 90, 20];
const UNEXPLORED: Rgb = [158, 172, 188];
const INK: Rgb = [40, 44, 52];
const PAPER: Rgb = [244, 244, 240];
const PATH: Rgb = [20, 110, 220];

/// Pixels that the longer side of the map should at least have.
const LEAST_SIDE: usize = 900;
/// Pixels between the map and the rim.
const MARGIN: usize = 16;
/// Pixels of the strip below the map.
const STRIP: usize = 64;
/// Pixels of the line of names above maps side by side.
const TITLE: usize = 16;
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

/// Draws maps of the same place side by side under their names (small letters, digits, `-`, `.`), with one legend.
///
/// # Errors
///
/// As [`write_picture`].
pub fn write_side_by_side(maps: &[(&str, &FuzzyGrid)], out: impl Write) -> Result<(), PictureError> {
    let zoom = maps.iter().map(|(_, grid)| zoom_of(grid.frame())).min().unwrap_or(1).div_ceil(2);
    let size = |grid: &FuzzyGrid| (grid.frame().columns() * zoom, grid.frame().rows() * zoom);
    let width: usize = maps.iter().map(|(_, grid)| size(grid).0 + MARGIN).sum();
    let height = maps.iter().map(|(_, grid)| size(grid).1).max().unwrap_or(0);
    let mut canvas = Canvas::new((width + MARGIN).max(LEGEND_WIDTH), TITLE + height + 2 * MARGIN + STRIP, PAPER);
    let mut left = MARGIN;
    for (name, grid) in maps {
        write_text(&mut canvas, left, MARGIN / 2, 2, INK, name);
        paint_cells(&mut canvas, grid, (left, TITLE + MARGIN), zoom);
        left += size(grid).0 + MARGIN;
    }
    if let Some((_, grid)) = maps.first() {
        paint_strip(&mut canvas, TITLE + height + 2 * MARGIN, pixels_per_metre(grid.frame(), zoom));
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
    let width = (frame.columns() * zoom + 2 * MARGIN).max(LEGEND_WIDTH);
    let mut canvas = Canvas::new(width, frame.rows() * zoom + 2 * MARGIN + STRIP, PAPER);
    paint_cells(&mut canvas, grid, (MARGIN, MARGIN), zoom);
    paint_strip(&mut canvas, frame.rows() * zoom + 2 * MARGIN, pixels_per_metre(frame, zoom));
    canvas
}

fn paint_cells(canvas: &mut Canvas, grid: &FuzzyGrid, (left, top): (usize, usize), zoom: usize) {
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    for (index, &cell) in grid.cells().iter().enumerate() {
        let (row, column) = (rows - 1 - index / columns, index % columns);
        canvas.fill(left + column * zoom, top + row * zoom, zoom, zoom, color_of(cell));
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

#[cfg(test)]
mod tests {
    use super::*;

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
    fn the_four_kinds_of_cells_differ() {
        let color = |empty, occupied| color_of(Fuzzy { empty, occupied });
        let kinds = [color(0.0, 0.0), color(1.0, 0.0), color(0.0, 1.0), color(1.0, 1.0)];
        assert_eq!(kinds, [UNEXPLORED, EMPTY, OCCUPIED, CONTRADICTORY]);
        assert_eq!(color(f32::NAN, 0.0), [0, 0, 0]); // nonsense is drawn, not fatal
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

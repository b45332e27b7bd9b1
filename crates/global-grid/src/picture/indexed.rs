use std::io::Write;

use local_grid::{Fuzzy, FuzzyGrid, GridFrame};

use super::{PictureError, Rgb, color_of};
use crate::Exposure;

/// Steps of a degree in an indexed picture: half a byte holds one.
const STEPS: u8 = 16;

/// Draws the map as a PNG of one pixel per cell, with a palette of 256 colours and nothing around it.
///
/// The index of a pixel tells its degrees in fifteenths, `16·empty + occupied`, and its colour is that of
/// [`write_picture`](super::write_picture): to look at as it is, and to be coloured again without a second image.
///
/// # Errors
///
/// As [`write_picture`](super::write_picture).
pub fn write_indexed(grid: &FuzzyGrid, out: impl Write) -> Result<(), PictureError> {
    write_pixels(grid.frame(), &palette(Exposure::of(grid)), grid.cells().iter().map(|&cell| index(cell)), out)
}

/// One pixel per cell, highest row first; `indices` into the palette are given in the order of the cells.
pub(crate) fn write_pixels(
    frame: &GridFrame,
    palette: &[Rgb],
    indices: impl Iterator<Item = u8>,
    out: impl Write,
) -> Result<(), PictureError> {
    let size = |n: usize| u32::try_from(n).map_err(|_| PictureError::TooLarge);
    let mut encoder = png::Encoder::new(out, size(frame.columns())?, size(frame.rows())?);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette.concat());
    encoder.set_filter(png::Filter::NoFilter); // indices are names, not shades: their differences say nothing
    encoder.set_compression(png::Compression::Balanced);
    let lowest_first: Vec<u8> = indices.collect();
    let pixels: Vec<u8> = lowest_first.chunks_exact(frame.columns().max(1)).rev().flatten().copied().collect();
    encoder.write_header()?.write_image_data(&pixels).map_err(PictureError::from)
}

fn index(cell: Fuzzy) -> u8 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 15")]
    let step = |degree: f32| (degree.clamp(0.0, 1.0) * f32::from(STEPS - 1)).round() as u8;
    STEPS * step(cell.empty) + step(cell.occupied)
}

fn palette(exposure: Exposure) -> Vec<Rgb> {
    let degree = |step: u8| f32::from(step) / f32::from(STEPS - 1);
    let color = |index: u8| -> Rgb {
        color_of(exposure, Fuzzy { empty: degree(index / STEPS), occupied: degree(index % STEPS) })
    };
    (0..=u8::MAX).map(color).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    #[test]
    fn pixels_name_degrees_and_the_first_row_is_the_highest() {
        let mut grid = FuzzyGrid::new(GridFrame::new(Point2::origin(), 0.1, 2, 3).unwrap());
        *grid.get_mut(0, 0).unwrap() = Fuzzy { empty: 1.0, occupied: 0.0 };
        *grid.get_mut(1, 2).unwrap() = Fuzzy { empty: 0.2, occupied: 0.6 };
        let mut bytes = Vec::new();
        write_indexed(&grid, &mut bytes).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, [0, 0, 3 * 16 + 9, 15 * 16, 0, 0]);
        let palette = reader.info().palette.clone().unwrap();
        assert_eq!(palette[3 * 240..3 * 241], [255, 255, 255], "what is empty is white");
    }

    #[test]
    fn nonsense_has_an_index_as_well() {
        assert_eq!(index(Fuzzy { empty: f32::NAN, occupied: 7.0 }), 15);
    }
}

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, RasterizedChar, get_raster, get_raster_width};

use super::{Canvas, Rgb};

/// Height of a line in pixels.
pub(super) const LINE: usize = RasterHeight::Size16.val();

/// Width of a text in pixels.
pub(super) fn width_of(text: &str) -> usize {
    text.chars().count() * get_raster_width(FontWeight::Regular, RasterHeight::Size16)
}

/// Writes a text with its upper left corner at `(x, y)`; characters beyond ASCII leave a gap.
pub(super) fn write_text(canvas: &mut Canvas, x: usize, y: usize, ink: Rgb, text: &str) {
    for (place, letter) in text.chars().enumerate() {
        let raster = get_raster(letter, FontWeight::Regular, RasterHeight::Size16);
        let left = x + place * get_raster_width(FontWeight::Regular, RasterHeight::Size16);
        for (row, line) in raster.iter().flat_map(RasterizedChar::rows).enumerate() {
            for (column, &coverage) in line.iter().enumerate() {
                canvas.blend(left + column, y + row, ink, coverage);
            }
        }
    }
}

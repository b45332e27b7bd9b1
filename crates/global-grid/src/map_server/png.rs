use std::io::BufRead;

use super::shades::{Gray, ImageError, Shades};

/// Bytes that a PNG may take when decoded.
const MOST_BYTES: usize = 8 << 30;

/// Reads a PNG of any kind as shades: the mean of its colours.
pub(super) fn read_png(mut input: impl BufRead) -> Result<Shades, ImageError> {
    let broken = |error: ::png::DecodingError| match error {
        ::png::DecodingError::IoError(error) if error.kind() != std::io::ErrorKind::UnexpectedEof => {
            ImageError::Io(error)
        }
        error => ImageError::Png(error.to_string()),
    };
    // The decoder wants to seek; an image is read whole anyway.
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).map_err(ImageError::Io)?;
    let mut decoder = ::png::Decoder::new_with_limits(std::io::Cursor::new(bytes), ::png::Limits { bytes: MOST_BYTES });
    decoder.set_transformations(::png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(broken)?;
    let size = reader.output_buffer_size().filter(|&size| size <= MOST_BYTES);
    let mut pixels = vec![0; size.ok_or_else(|| ImageError::Png("it is too large".to_owned()))?];
    let info = reader.next_frame(&mut pixels).map_err(broken)?;
    pixels.truncate(info.buffer_size());
    let channels = info.color_type.samples();
    let alpha = matches!(info.color_type, ::png::ColorType::GrayscaleAlpha | ::png::ColorType::Rgba);
    let deep = info.bit_depth == ::png::BitDepth::Sixteen;
    let (width, height) = (info.width as usize, info.height as usize);
    if channels == 1 && !deep {
        return Ok(Shades { width, height, gray: Gray::Bytes(pixels, u8::MAX), transparent: Vec::new() });
    }
    let sample = |pixel: &[u8], channel: usize| match deep {
        true => f32::from(u16::from_be_bytes([pixel[2 * channel], pixel[2 * channel + 1]])) / 65_535.0,
        false => f32::from(pixel[channel]) / 255.0,
    };
    let colors = channels - usize::from(alpha);
    #[expect(clippy::cast_precision_loss, reason = "one or three")]
    let mean = |pixel: &[u8]| (0..colors).map(|channel| sample(pixel, channel)).sum::<f32>() / colors as f32;
    let each = || pixels.chunks_exact(channels * if deep { 2 } else { 1 });
    let transparent = if alpha { each().map(|pixel| sample(pixel, colors) < 1.0).collect() } else { Vec::new() };
    Ok(Shades { width, height, gray: Gray::Shares(each().map(mean).collect()), transparent })
}

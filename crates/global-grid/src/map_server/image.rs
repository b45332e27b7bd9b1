use std::io::BufRead;

use super::pgm::read_pgm;
use super::png::read_png;
use super::shades::{ImageError, Shades};

/// Reads a PGM or a PNG, whichever it is.
pub(crate) fn read_shades(mut input: impl BufRead) -> Result<Shades, ImageError> {
    let start = input.fill_buf().map_err(ImageError::Io)?;
    match start {
        [b'P', b'5' | b'2', ..] => read_pgm(input),
        [0x89, b'P', b'N', b'G', ..] => read_png(input),
        _ => Err(ImageError::Format(String::from_utf8_lossy(&start[..start.len().min(8)]).into_owned())),
    }
}

use std::io::{BufRead, Read};

use super::shades::{Gray, ImageError, Shades};

/// The most pixels that an image may have, as a grid may have cells.
const MOST_PIXELS: usize = local_grid::GridFrame::MAX_CELLS;

/// Reads a PGM, plain or raw.
pub(super) fn read_pgm(mut input: impl BufRead) -> Result<Shades, ImageError> {
    let plain = word(&mut input)? == "P2";
    let size = |text: String, expected| match text.parse::<usize>() {
        Ok(size) if size > 0 => Ok(size),
        _ => Err(ImageError::Header { expected, got: text }),
    };
    let width = size(word(&mut input)?, "a width of at least 1")?;
    let height = size(word(&mut input)?, "a height of at least 1")?;
    let maximum = size(word(&mut input)?, "a maximum between 1 and 65535")?;
    let pixels = width.checked_mul(height).filter(|&pixels| pixels <= MOST_PIXELS);
    let got = || ImageError::Header { expected: "at most 2³² pixels", got: format!("{width} × {height}") };
    let pixels = pixels.ok_or_else(got)?;
    let Ok(maximum @ 1..=65_535) = u32::try_from(maximum) else {
        return Err(ImageError::Header { expected: "a maximum between 1 and 65535", got: maximum.to_string() });
    };
    let gray = match (plain, u8::try_from(maximum)) {
        (false, Ok(maximum)) => bytes(input, pixels, maximum)?,
        (false, Err(_)) => pairs(input, pixels, maximum)?,
        (true, _) => numbers(input, pixels, maximum)?,
    };
    Ok(Shades { width, height, gray, transparent: Vec::new() })
}

/// The next word of the header; comments run from `#` to the end of the line.
fn word(input: &mut impl BufRead) -> Result<String, ImageError> {
    let mut word = String::new();
    let mut comment = false;
    for byte in input.bytes() {
        let byte = byte.map_err(ImageError::Io)?;
        comment = (comment || (byte == b'#' && word.is_empty())) && byte != b'\n';
        if comment || byte.is_ascii_whitespace() {
            if !word.is_empty() {
                return Ok(word); // exactly one space parts the header from the pixels
            }
        } else if word.len() < 20 {
            word.push(char::from(byte));
        } else {
            return Err(ImageError::Header { expected: "short numbers", got: word });
        }
    }
    Ok(word)
}

/// Reads one byte per pixel. Memory grows with what is there, not with what the header claims.
fn bytes(mut input: impl BufRead, pixels: usize, maximum: u8) -> Result<Gray, ImageError> {
    let mut bytes = Vec::new();
    let limit = u64::try_from(pixels).unwrap_or(u64::MAX);
    (&mut input).take(limit).read_to_end(&mut bytes).map_err(ImageError::Io)?;
    if bytes.len() < pixels {
        return Err(ImageError::Truncated { expected: pixels, got: bytes.len() });
    }
    ends(input, pixels)?;
    if let Some(pixel) = bytes.iter().position(|&byte| byte > maximum) {
        return Err(ImageError::Pixel { pixel, value: bytes[pixel].into(), maximum: maximum.into() });
    }
    Ok(Gray::Bytes(bytes, maximum))
}

/// Reads two bytes per pixel, the larger first.
fn pairs(mut input: impl BufRead, pixels: usize, maximum: u32) -> Result<Gray, ImageError> {
    let mut bytes = Vec::new();
    let limit = u64::try_from(pixels).unwrap_or(u64::MAX).saturating_mul(2);
    (&mut input).take(limit).read_to_end(&mut bytes).map_err(ImageError::Io)?;
    if bytes.len() < 2 * pixels {
        return Err(ImageError::Truncated { expected: pixels, got: bytes.len() / 2 });
    }
    ends(input, pixels)?;
    let values = bytes.chunks_exact(2).map(|pair| u32::from(u16::from_be_bytes([pair[0], pair[1]])));
    values.enumerate().map(|(pixel, value)| share(pixel, value, maximum)).collect::<Result<_, _>>().map(Gray::Shares)
}

/// Reads numbers with spaces between.
fn numbers(mut input: impl BufRead, pixels: usize, maximum: u32) -> Result<Gray, ImageError> {
    let mut shares = Vec::new();
    while shares.len() < pixels {
        let text = word(&mut input)?;
        if text.is_empty() {
            return Err(ImageError::Truncated { expected: pixels, got: shares.len() });
        }
        let Ok(value) = text.parse::<u32>() else {
            return Err(ImageError::Header { expected: "a whole number for every pixel", got: text });
        };
        shares.push(share(shares.len(), value, maximum)?);
    }
    ends(input, pixels)?;
    Ok(Gray::Shares(shares))
}

#[expect(clippy::cast_precision_loss, reason = "below 2^16")]
fn share(pixel: usize, value: u32, maximum: u32) -> Result<f32, ImageError> {
    if value > maximum {
        return Err(ImageError::Pixel { pixel, value, maximum });
    }
    Ok(value as f32 / maximum as f32)
}

/// Sees to it that nothing but white space follows.
fn ends(input: impl BufRead, pixels: usize) -> Result<(), ImageError> {
    for byte in input.bytes() {
        if !byte.map_err(ImageError::Io)?.is_ascii_whitespace() {
            return Err(ImageError::TooLong(pixels));
        }
    }
    Ok(())
}

use std::io::{self, BufRead, Read};

/// Why a map's image cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The reader failed.
    #[error("the image could not be read")]
    Io(#[source] io::Error),
    /// Neither a PGM nor a PNG.
    #[error("expected a PGM (`P2` or `P5`) or PNG image, got a file that begins with {0:?}")]
    Format(String),
    /// The header is wrong.
    #[error("the header of the image must give {expected}, got `{got}`")]
    Header {
        /// What was expected.
        expected: &'static str,
        /// What was there.
        got: String,
    },
    /// The image ends too early.
    #[error("the image should have {expected} pixels, but ends after {got}")]
    Truncated {
        /// Pixels announced.
        expected: usize,
        /// Pixels found.
        got: usize,
    },
    /// The image goes on after its last pixel.
    #[error("the image goes on after its {0} pixels")]
    TooLong(usize),
    /// A pixel is brighter than the header allows.
    #[error("pixel {pixel} is {value}, more than the maximum of {maximum}")]
    Pixel {
        /// Which, from 0, row by row.
        pixel: usize,
        /// Its value.
        value: u32,
        /// The largest allowed.
        maximum: u32,
    },
    /// The PNG is broken, or of a kind that cannot be used.
    #[error("the PNG image cannot be used: {0}")]
    Png(String),
}

/// The pixels of an image, highest row first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shades {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) gray: Gray,
    /// Whether a pixel is not quite opaque; empty when all are.
    pub(crate) transparent: Vec<bool>,
}

/// Brightness of pixels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Gray {
    /// Whole numbers up to a maximum.
    Bytes(Vec<u8>, u8),
    /// From 0, black, to 1, white.
    Shares(Vec<f32>),
}

impl Shades {
    /// The brightness of a pixel, from 0, black, to 1, white.
    pub(crate) fn shade(&self, pixel: usize) -> f64 {
        match &self.gray {
            Gray::Bytes(bytes, maximum) => f64::from(bytes[pixel]) / f64::from(*maximum),
            Gray::Shares(shares) => f64::from(shares[pixel]),
        }
    }

    /// Reads a PGM or a PNG, whichever it is.
    pub(crate) fn read(mut input: impl BufRead) -> Result<Self, ImageError> {
        let start = input.fill_buf().map_err(ImageError::Io)?;
        match start {
            [b'P', b'5' | b'2', ..] => read_pgm(input),
            [0x89, b'P', b'N', b'G', ..] => super::png::read_png(input),
            _ => Err(ImageError::Format(String::from_utf8_lossy(&start[..start.len().min(8)]).into_owned())),
        }
    }
}

/// The most pixels that an image may have, as a grid may have cells.
const MOST_PIXELS: usize = local_grid::GridFrame::MAX_CELLS;

fn read_pgm(mut input: impl BufRead) -> Result<Shades, ImageError> {
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

use std::io::{Cursor, Read};

/// A grey picture, top row first.
#[derive(Debug, Clone, PartialEq)]
pub struct MapImage {
    width: usize,
    height: usize,
    grey: Vec<u8>,
}

/// Why an image cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// Neither PGM nor PNG, plain or in gzip.
    #[error("expected a PGM (P2 or P5) or PNG image, plain or compressed with gzip")]
    Format,
    /// The compressed data is damaged, or larger than any map.
    #[error("the compressed data cannot be unpacked: {0}")]
    Gzip(String),
    /// The PNG is damaged or of a kind that is not read.
    #[error("the PNG cannot be read: {0}")]
    Png(String),
    /// The header of the PGM is damaged.
    #[error("the PGM's header must give {expected}, got `{found}`")]
    Header {
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// The image has no pixel or too many.
    #[error("an image must have between 1 and {} pixels, got {width} × {height}", MapImage::MOST_PIXELS)]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The image ends early.
    #[error("expected {expected} pixels, got {found}")]
    Truncated {
        /// Pixels that the header promises.
        expected: usize,
        /// Pixels that are there.
        found: usize,
    },
}

impl MapImage {
    /// The most pixels that are read: 10 × 10 km at a metre, 500 × 500 m at 0.05 m.
    pub const MOST_PIXELS: usize = 100_000_000;

    /// Reads a PGM (`P5` or `P2`) or PNG image, plain or compressed with gzip; transparent pixels are painted on white.
    ///
    /// # Errors
    ///
    /// Another format, or a damaged, empty or huge image.
    pub fn read(bytes: &[u8]) -> Result<Self, ImageError> {
        match bytes {
            [0x1f, 0x8b, ..] => {
                let mut plain = Vec::new();
                let limit = 4 * Self::MOST_PIXELS as u64; // no more is unpacked, whatever the file claims
                let unpacked = flate2::read::GzDecoder::new(bytes).take(limit).read_to_end(&mut plain);
                unpacked.map_err(|error| ImageError::Gzip(error.to_string()))?;
                if plain.starts_with(&[0x1f, 0x8b]) { Err(ImageError::Format) } else { Self::read(&plain) }
            }
            [b'P', b'5' | b'2', ..] => read_pgm(bytes),
            [0x89, b'P', b'N', b'G', ..] => read_png(bytes),
            _ => Err(ImageError::Format),
        }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The grey of a pixel, rows counted from above.
    ///
    /// # Panics
    ///
    /// If there is no such pixel.
    #[must_use]
    pub fn grey(&self, column: usize, row: usize) -> u8 {
        self.grey[row * self.width + column]
    }

    fn new(width: usize, height: usize, grey: Vec<u8>) -> Result<Self, ImageError> {
        let expected = checked_size(width, height)?;
        if grey.len() < expected {
            return Err(ImageError::Truncated { expected, found: grey.len() });
        }
        Ok(Self { width, height, grey })
    }
}

fn checked_size(width: usize, height: usize) -> Result<usize, ImageError> {
    let size = width.checked_mul(height).filter(|size| (1..=MapImage::MOST_PIXELS).contains(size));
    size.ok_or(ImageError::Size { width, height })
}

fn read_pgm(bytes: &[u8]) -> Result<MapImage, ImageError> {
    let mut words = Words { bytes, at: 2 };
    let width = words.number("a width")?;
    let height = words.number("a height")?;
    let most = words.number("a largest grey from 1 to 255")?;
    if !(1..=255).contains(&most) {
        return Err(ImageError::Header { expected: "a largest grey from 1 to 255", found: most.to_string() });
    }
    let expected = checked_size(width, height)?;
    let grey = if bytes[1] == b'5' {
        let data = bytes.get(words.at + 1..).unwrap_or_default(); // one white space ends the header
        data[..data.len().min(expected)].to_vec()
    } else {
        let mut grey = Vec::new();
        while grey.len() < expected
            && let Ok(value) = words.number("a grey")
        {
            grey.push(u8::try_from(value.min(255)).unwrap_or(u8::MAX));
        }
        grey
    };
    let scaled = |grey: u8| u8::try_from((usize::from(grey) * 255 / most).min(255)).unwrap_or(u8::MAX);
    MapImage::new(width, height, if most == 255 { grey } else { grey.into_iter().map(scaled).collect() })
}

/// The words of a PGM's header.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Words<'_> {
    fn number(&mut self, expected: &'static str) -> Result<usize, ImageError> {
        let mut rest = &self.bytes[self.at.min(self.bytes.len())..];
        loop {
            rest = rest.trim_ascii_start();
            if rest.first() != Some(&b'#') {
                break;
            }
            rest = &rest[rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len())..];
        }
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at = self.bytes.len() - rest.len() + length;
        let word = String::from_utf8_lossy(&rest[..length.min(20)]).into_owned();
        word.parse().map_err(|_| ImageError::Header { expected, found: word })
    }
}

fn read_png(bytes: &[u8]) -> Result<MapImage, ImageError> {
    let damaged = |error: png::DecodingError| ImageError::Png(error.to_string());
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(damaged)?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    checked_size(width, height)?;
    let size = reader.output_buffer_size().ok_or(ImageError::Size { width, height })?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(damaged)?;
    let grey = data[..frame.buffer_size()].chunks_exact(frame.color_type.samples()).map(on_white).collect();
    MapImage::new(width, height, grey)
}

/// The grey of a pixel with one to four samples, painted on white.
fn on_white(samples: &[u8]) -> u8 {
    let (grey, alpha) = match *samples {
        [grey] => (u32::from(grey), 255),
        [grey, alpha] => (u32::from(grey), u32::from(alpha)),
        [red, green, blue] => ((u32::from(red) + u32::from(green) + u32::from(blue)) / 3, 255),
        [red, green, blue, alpha] => ((u32::from(red) + u32::from(green) + u32::from(blue)) / 3, u32::from(alpha)),
        _ => (255, 255),
    };
    u8::try_from((grey * alpha + 255 * (255 - alpha)) / 255).unwrap_or(u8::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_of_pgm_are_read() {
        let plain = MapImage::read(b"P2\n# a comment\n2 1\n100\n0 100\n").unwrap();
        assert_eq!((plain.grey(0, 0), plain.grey(1, 0)), (0, 255)); // scaled to 255
        let binary = MapImage::read(b"P5 2 1 255\n\x07\x0a").unwrap();
        assert_eq!((binary.grey(0, 0), binary.grey(1, 0)), (7, 10));
    }

    #[test]
    fn transparent_pixels_are_painted_on_white() {
        assert_eq!([on_white(&[0, 0]), on_white(&[0, 255]), on_white(&[10, 20, 30, 255])], [255, 0, 20]);
    }

    #[test]
    fn damaged_images_are_refused() {
        let error = |bytes: &[u8]| MapImage::read(bytes).unwrap_err();
        assert_eq!(error(b"GIF89a"), ImageError::Format);
        assert_eq!(error(b"P5 3 1 255\n\x01"), ImageError::Truncated { expected: 3, found: 1 });
        assert_eq!(error(b"P5 0 1 255\n"), ImageError::Size { width: 0, height: 1 });
        assert!(matches!(error(b"P5 9999999999 9999999999 255\n"), ImageError::Size { .. }));
        assert!(matches!(error(b"P5 x 1 255\n"), ImageError::Header { expected: "a width", .. }));
        assert!(matches!(error(b"P5 1 1 65535\n\x00\x00"), ImageError::Header { .. }));
        assert!(matches!(error(b"\x1f\x8b\x08\x00garbage"), ImageError::Gzip(_)));
        assert!(matches!(error(b"\x89PNG\r\n\x1a\nshort"), ImageError::Png(_)));
        assert_eq!(error(b""), ImageError::Format);
    }
}

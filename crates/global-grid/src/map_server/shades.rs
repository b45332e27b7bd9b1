use std::io;

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
}

use hierarchy::Mapper;
use local_grid::{CellClass, Signature};
use serde::Serialize;

use super::mm;
use crate::failure::Failure;
use crate::report::base64::base64;
use crate::report::failed;

/// What each place looks like: its local grid, as a tile of a sheet.
#[derive(Debug, Default, Serialize)]
pub(super) struct SignatureData {
    /// Cells of a tile's edge.
    size: usize,
    /// Tiles of a sheet's edge.
    across: usize,
    /// Metres per cell.
    cell: f64,
    /// The lower left corner of each tile as seen from its place, in millimetres.
    left: Vec<i64>,
    bottom: Vec<i64>,
    /// The tile of each place, −1 for a place without a signature.
    tile: Vec<i64>,
    /// Sheets as PNG with a palette: 0 unknown, 1 empty, 2 occupied; highest row first.
    sheets: Vec<String>,
}

/// Tiles of a sheet's edge: a browser takes only the sheet of the place that is looked at out of its packing.
const ACROSS: usize = 8;
/// The colours of unknown, empty and occupied cells; the page has its own for light and dark.
const PALETTE: [u8; 9] = [158, 172, 188, 255, 255, 255, 16, 24, 32];

impl SignatureData {
    pub(super) fn new(mapper: &Mapper) -> Result<Self, Failure> {
        let places = mapper.topology().places();
        let signatures: Vec<&Signature> =
            places.iter().filter_map(|place| place.signature().map(|signature| &**signature)).collect();
        let edge = |signature: &&Signature| signature.frame().rows().max(signature.frame().columns());
        let size = signatures.iter().map(edge).max().unwrap_or(1).max(1);
        let mut next = 0;
        let mut number = |visited: bool| {
            next += i64::from(visited);
            if visited { next - 1 } else { -1 }
        };
        let sheets: Result<_, _> = signatures.chunks(ACROSS * ACROSS).map(|some| sheet(some, size)).collect();
        Ok(Self {
            size,
            across: ACROSS,
            cell: signatures.first().map_or(0.1, |signature| signature.frame().resolution()),
            left: signatures.iter().map(|signature| mm(signature.frame().origin().x)).collect(),
            bottom: signatures.iter().map(|signature| mm(signature.frame().origin().y)).collect(),
            tile: places.iter().map(|place| number(place.signature().is_some())).collect(),
            sheets: sheets.map_err(|error| failed(&error))?,
        })
    }
}

/// Some signatures side by side, two bits for each cell.
fn sheet(signatures: &[&Signature], size: usize) -> Result<String, png::EncodingError> {
    let edge = size * ACROSS;
    let bytes_per_row = edge.div_ceil(4);
    let mut pixels = vec![0u8; bytes_per_row * edge];
    for (tile, signature) in signatures.iter().enumerate() {
        let (left, bottom) = (tile % ACROSS * size, tile / ACROSS * size + size - 1);
        let columns = signature.frame().columns();
        for (index, class) in signature.classes().iter().enumerate() {
            let (x, y) = (left + index % columns, bottom - index / columns);
            let color = match class {
                CellClass::Unknown => 0,
                CellClass::Empty => 1,
                CellClass::Occupied => 2,
            };
            pixels[y * bytes_per_row + x / 4] |= color << (6 - 2 * (x % 4));
        }
    }
    let mut out = Vec::new();
    let side = u32::try_from(edge).map_err(|_| png::EncodingError::LimitsExceeded)?;
    let mut encoder = png::Encoder::new(&mut out, side, side);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Two);
    encoder.set_palette(&PALETTE[..]);
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_compression(png::Compression::Balanced);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(base64(&out))
}

use std::io::{self, Write};

use local_grid::Grid;

use super::{MapMetadata, Mode};
use crate::Occupancy;
use crate::picture::PictureError;

/// Writes the image of a crisp map: 8-bit PGM, highest row first.
///
/// # Errors
///
/// Those of the writer.
pub fn write_pgm(grid: &Grid<Occupancy>, out: &mut impl Write) -> io::Result<()> {
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    write!(out, "P5\n{columns} {rows}\n255\n")?;
    let mut line = vec![0; columns];
    for row in grid.cells().chunks_exact(columns.max(1)).rev() {
        for (shade, cell) in line.iter_mut().zip(row) {
            *shade = shade_of(*cell);
        }
        out.write_all(&line)?;
    }
    Ok(())
}

fn shade_of(cell: Occupancy) -> u8 {
    match cell {
        Occupancy::Unknown => MapMetadata::UNKNOWN,
        Occupancy::Free => MapMetadata::FREE,
        Occupancy::Occupied => MapMetadata::OCCUPIED,
    }
}

/// Writes a map of probabilities as a PNG for [`Mode::Scale`]: white is surely free, black surely occupied, and a cell of
/// which nothing is known is clear.
///
/// What the map server makes of it between the thresholds of the description is whole percents from one to the other.
///
/// # Errors
///
/// Those of the writer, or a map too large for a PNG.
pub fn write_scale(grid: &Grid<Option<f32>>, out: impl Write) -> Result<(), PictureError> {
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    let size = |n: usize| u32::try_from(n).map_err(|_| PictureError::TooLarge);
    let mut encoder = ::png::Encoder::new(out, size(columns)?, size(rows)?);
    encoder.set_color(::png::ColorType::GrayscaleAlpha);
    encoder.set_depth(::png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    for row in grid.cells().chunks_exact(columns.max(1)).rev() {
        let pixel = |cell: &Option<f32>| cell.map_or([MapMetadata::UNKNOWN, 0], |p| [share(1.0 - p, 255.0), 255]);
        let line: Vec<u8> = row.iter().flat_map(pixel).collect();
        stream.write_all(&line).map_err(PictureError::Io)?;
    }
    stream.finish().map_err(PictureError::from)
}

/// Writes a map of probabilities as a PGM for [`Mode::Raw`]: whole percents, and 255 for a cell of which nothing is known.
///
/// # Errors
///
/// Those of the writer.
pub fn write_raw(grid: &Grid<Option<f32>>, out: &mut impl Write) -> io::Result<()> {
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    write!(out, "P5\n{columns} {rows}\n255\n")?;
    for row in grid.cells().chunks_exact(columns.max(1)).rev() {
        let line: Vec<u8> = row.iter().map(|cell| cell.map_or(255, |p| share(p, 100.0))).collect();
        out.write_all(&line)?;
    }
    Ok(())
}

/// A share of `whole`, rounded; what is no share is drawn to the nearest that is one.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255, and NaN to 0")]
fn share(p: f32, whole: f32) -> u8 {
    (p.clamp(0.0, 1.0) * whole).round() as u8
}

/// Writes the description of the image, in YAML.
///
/// # Errors
///
/// Those of the writer.
pub fn write_yaml(metadata: &MapMetadata, out: &mut impl Write) -> io::Result<()> {
    let mode = match metadata.mode {
        Mode::Trinary => "trinary",
        Mode::Scale => "scale",
        Mode::Raw => "raw",
    };
    let [x, y, yaw] = metadata.origin.map(|value| value + 0.0); // -0.0 reads oddly
    writeln!(out, "image: {}", quoted(&metadata.image))?;
    writeln!(out, "mode: {mode}")?;
    writeln!(out, "resolution: {:?}", metadata.resolution)?;
    writeln!(out, "origin: [{x:?}, {y:?}, {yaw:?}]")?;
    writeln!(out, "negate: {}", u8::from(metadata.negate))?;
    writeln!(out, "occupied_thresh: {:?}", metadata.occupied_thresh)?;
    writeln!(out, "free_thresh: {:?}", metadata.free_thresh)
}

/// A file name as YAML takes it: plain where it can be, quoted otherwise.
fn quoted(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    if name.chars().all(plain) && name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return name.to_owned();
    }
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}

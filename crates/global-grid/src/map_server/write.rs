use std::io::{self, Write};

use local_grid::Grid;

use super::{MapMetadata, Mode};
use crate::Occupancy;

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

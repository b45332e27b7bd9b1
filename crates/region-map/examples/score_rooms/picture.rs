//! Pictures of a result over its truth.

use std::{fs::File, io::BufWriter, path::Path};

/// Writes found regions as pastel areas, cells of the truth's door lines in red, found borders in black.
pub(crate) fn write(path: &Path, columns: usize, found: &[u32], truth: &[u32], free: &[bool]) -> Result<(), String> {
    let mut rgb = Vec::with_capacity(found.len() * 3);
    for i in 0..found.len() {
        let differs = |j: usize| found.get(j).is_some_and(|&l| l != found[i] && l != 0);
        let border = found[i] != 0 && (differs(i + 1) || differs(i + columns));
        rgb.extend(match (free[i], border, truth[i], found[i]) {
            (_, true, ..) => [0, 0, 0],
            (true, _, 0, _) => [255, 0, 0],
            (_, _, _, 0) => {
                if free[i] {
                    [255, 255, 255]
                } else {
                    [90, 90, 90]
                }
            }
            (f, _, _, label) => {
                let hash = label.wrapping_mul(2_654_435_761);
                let c = |shift: u32| 130 + ((hash >> shift) & 0x7f) as u8 - if f { 0 } else { 60 };
                [c(8), c(16), c(24)]
            }
        });
    }
    let side = |cells: usize| u32::try_from(cells).map_err(|e| e.to_string());
    let file = File::create(path).map_err(|e| e.to_string())?;
    let mut encoder = png::Encoder::new(BufWriter::new(file), side(columns)?, side(found.len() / columns)?);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(|e| e.to_string())?;
    writer.write_image_data(&rgb).map_err(|e| e.to_string())
}

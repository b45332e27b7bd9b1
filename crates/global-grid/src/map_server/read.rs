use std::io::BufRead;

use local_grid::{FrameError, Grid, GridFrame};
use nalgebra::{Isometry2, Point2, Vector2};

use super::image::read_shades;
use super::shades::Shades;
use super::{ImageError, MapMetadata, Mode};
use crate::Occupancy;

/// A map as the map server gives it out.
#[derive(Debug, Clone, PartialEq)]
pub struct MapImage {
    /// −1 unknown, else from 0, free, to 100, occupied.
    pub cells: Grid<i8>,
    /// Where the grid lies in the map: the identity, unless the description turns the image.
    pub map_from_grid: Isometry2<f64>,
}

impl MapImage {
    /// What planners take the cells for: occupied from 65 on, free up to 19, unknown between.
    #[must_use]
    pub fn occupancy(&self) -> Grid<Occupancy> {
        self.cells.map(|&cell| match cell {
            0..=19 => Occupancy::Free,
            65.. => Occupancy::Occupied,
            _ => Occupancy::Unknown,
        })
    }
}

/// Reads the image of a map, PGM or PNG, as its description says.
///
/// With `occupancy = 1 − shade` (or `shade`, where `negate` is set):
///
/// * trinary: 100 above `occupied_thresh`, 0 below `free_thresh`, −1 between;
/// * scale: the same, but between them `100 (occupancy − free) / (occupied − free)`, and −1 for what is transparent;
/// * raw: the shade as a number of 0 … 255, where above 100 is −1.
///
/// # Errors
///
/// An image that is broken, cut off, or larger than a grid can be.
pub fn read_image(metadata: &MapMetadata, input: impl BufRead) -> Result<MapImage, ReadError> {
    let shades = read_shades(input)?;
    let [x, y, yaw] = metadata.origin;
    let (origin, map_from_grid) = if yaw == 0.0 {
        (Point2::new(x, y), Isometry2::identity())
    } else {
        (Point2::origin(), Isometry2::new(Vector2::new(x, y), yaw))
    };
    let frame = GridFrame::new(origin, metadata.resolution, shades.height, shades.width)?;
    let mut cells = Vec::with_capacity(frame.n_cells());
    for row in (0..shades.height).rev() {
        let pixels = row * shades.width..(row + 1) * shades.width;
        cells.extend(pixels.map(|pixel| cell(metadata, &shades, pixel)));
    }
    let cells = Grid::from_cells(frame, cells).unwrap_or_else(|_| Grid::new(frame));
    Ok(MapImage { cells, map_from_grid })
}

/// Why a map's image cannot become a grid.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The image is broken.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The image is too large.
    #[error("the image makes no grid")]
    Frame(#[from] FrameError),
}

/// What a pixel says.
fn cell(metadata: &MapMetadata, shades: &Shades, pixel: usize) -> i8 {
    let shade = shades.shade(pixel);
    let occupancy = if metadata.negate { shade } else { 1.0 - shade };
    let (free, occupied) = (metadata.free_thresh, metadata.occupied_thresh);
    match metadata.mode {
        Mode::Raw => whole(shade * 255.0),
        Mode::Scale if shades.transparent.get(pixel).is_some_and(|&clear| clear) => -1,
        Mode::Trinary | Mode::Scale if occupancy > occupied => 100,
        Mode::Trinary | Mode::Scale if occupancy < free => 0,
        Mode::Trinary => -1,
        Mode::Scale => whole((occupancy - free) / (occupied - free) * 100.0),
    }
}

/// A number of 0 … 100 rounded, anything else −1.
#[expect(clippy::cast_possible_truncation, reason = "0 to 100")]
fn whole(value: f64) -> i8 {
    let value = value.round();
    if (0.0..=100.0).contains(&value) { value as i8 } else { -1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map_server::{write_pgm, write_raw, write_scale, write_yaml};

    /// A map that looks different from every side.
    fn asymmetric() -> Grid<Occupancy> {
        let frame = GridFrame::new(Point2::new(-1.25, 3.5), 0.05, 3, 4).unwrap();
        let mut grid = Grid::new(frame);
        for (row, column, cell) in
            [(0, 0, Occupancy::Occupied), (0, 1, Occupancy::Free), (2, 3, Occupancy::Free), (1, 0, Occupancy::Occupied)]
        {
            *grid.get_mut(row, column).unwrap() = cell;
        }
        grid
    }

    fn written() -> (Vec<u8>, MapMetadata) {
        let (mut pgm, mut yaml) = (Vec::new(), Vec::new());
        write_pgm(&asymmetric(), &mut pgm).unwrap();
        write_yaml(&MapMetadata::new("map.pgm", asymmetric().frame()), &mut yaml).unwrap();
        (pgm, MapMetadata::read(yaml.as_slice()).unwrap())
    }

    #[test]
    fn what_was_written_reads_back() {
        let (pgm, metadata) = written();
        let map = read_image(&metadata, pgm.as_slice()).unwrap();
        assert_eq!(map.occupancy(), asymmetric());
        assert_eq!(map.map_from_grid, Isometry2::identity());
        assert_eq!(&pgm[pgm.len() - 4..], [0, 254, 205, 205]); // the lowest row comes last
    }

    #[test]
    fn modes_and_turns_are_understood() {
        let image = b"P2\n# shades\n5 1\n255\n0 100 128 205 254\n";
        let read = |change: fn(&mut MapMetadata)| {
            let mut metadata = written().1;
            change(&mut metadata);
            read_image(&metadata, &image[..]).unwrap()
        };
        assert_eq!(read(|_| ()).cells.cells(), [100, -1, -1, -1, 0]);
        assert_eq!(read(|map| map.negate = true).cells.cells(), [0, -1, -1, 100, 100]);
        assert_eq!(read(|map| map.mode = Mode::Raw).cells.cells(), [0, 100, -1, -1, -1]);
        // 155/255 and 127/255 between 0.196 and 0.65.
        assert_eq!(read(|map| map.mode = Mode::Scale).cells.cells(), [100, 91, 67, 0, 0]);
        let turned = read(|map| map.origin = [1.0, 2.0, std::f64::consts::FRAC_PI_2]);
        let corner = turned.map_from_grid * turned.cells.frame().center(0, 4);
        approx::assert_relative_eq!(corner, Point2::new(0.975, 2.225), epsilon = 1e-12);
    }

    #[test]
    fn degrees_survive_the_modes_that_keep_them() {
        let frame = GridFrame::new(Point2::new(-1.25, 3.5), 0.05, 11, 10).unwrap();
        let mut grid = Grid::new(frame);
        for (percent, cell) in (0u8..=100).zip(grid.cells_mut()) {
            *cell = Some(f32::from(percent) / 100.0);
        }
        let metadata = |mode| MapMetadata { mode, ..MapMetadata::new("map", &frame) };
        let (mut raw, mut scale) = (Vec::new(), Vec::new());
        write_raw(&grid, &mut raw).unwrap();
        let read = read_image(&metadata(Mode::Raw), raw.as_slice()).unwrap();
        write_scale(&grid, &mut scale).unwrap();
        let scaled = read_image(&metadata(Mode::Scale), scale.as_slice()).unwrap();
        for percent in 0..=100i8 {
            let at = usize::try_from(percent).unwrap();
            assert_eq!(read.cells.cells()[at], percent);
            let between = ((f64::from(percent) / 100.0 - 0.196) / (0.65 - 0.196) * 100.0).clamp(0.0, 100.0);
            assert!((f64::from(scaled.cells.cells()[at]) - between).abs() <= 1.0, "{percent}");
        }
        assert!(read.cells.cells()[101..].iter().chain(&scaled.cells.cells()[101..]).all(|&cell| cell == -1));
    }

    #[test]
    fn broken_images_are_refused() {
        let (pgm, metadata) = written();
        let fails = |bytes: &[u8]| read_image(&metadata, bytes).unwrap_err().to_string();
        assert!(fails(&pgm[..pgm.len() - 5]).contains("should have 12 pixels, but ends after 7"));
        assert!(fails(b"").contains("expected a PGM"));
        assert!(fails(b"GIF89a").contains("begins with \"GIF89a\""));
        assert!(fails(b"P5\n4 -3\n255\n").contains("a height of at least 1"));
        assert!(fails(b"P5\n0 3\n255\n").contains("a width of at least 1"));
        assert!(fails(b"P5\n1 1\n70000\n").contains("a maximum between 1 and 65535"));
        assert!(fails(b"P5\n99999999 99999999\n255\n").contains("at most"));
        assert!(fails(b"P5\n4000000 1000\n255\nabc").contains("ends after 3")); // and takes no 4 GB to say so
        assert!(fails(&[&pgm[..], b"x"].concat()).contains("goes on"));
        assert!(fails(b"P5\n1 1\n15\n\x20").contains("pixel 0 is 32, more than the maximum of 15"));
        assert!(fails(b"\x89PNG\r\n\x1a\nrubbish").contains("PNG"));
        assert!(fails(b"P2\n2 1\n255\n3 x\n").contains("a whole number"));
    }
}

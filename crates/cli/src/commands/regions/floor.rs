use std::path::{Path, PathBuf};

use global_grid::map_server::{MapMetadata, read_image};
use region_map::local_grid::{Grid, GridFrame};
use region_map::nalgebra::{Isometry2, Point2};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

/// Pixels from this shade on are free in a picture without a description.
const WHITE: u8 = 250;

/// Where the floor is free, and where nobody knows.
#[derive(Debug)]
pub(super) struct Floor {
    pub(super) free: Grid<f32>,
    pub(super) unknown: Option<Grid<bool>>,
    pub(super) map_from_grid: Isometry2<f64>,
}

impl Floor {
    /// Reads a map, a picture, or the map of a run.
    pub(super) fn open(path: &Path, resolution: Option<f64>) -> Result<Self, Failure> {
        let path = if path.is_dir() { path.join("map.yaml") } else { path.to_owned() };
        let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_lowercase);
        match (extension.as_deref(), resolution) {
            (Some("yaml" | "yml"), None) => Self::of_map_server(&path),
            (Some("png"), Some(resolution)) => Self::of_picture(&path, resolution),
            (Some("yaml" | "yml"), Some(_)) => {
                Err(usage("the map's description says its resolution itself").help("leave --resolution out"))
            }
            (Some("png"), None) => Err(usage("a picture does not say how large its pixels are")
                .help("add --resolution with metres per pixel, such as --resolution 0.05")),
            _ => Err(usage(&format!("{} is no map", path.display()))
                .help("name a map.yaml, a picture (.png), or the folder of a run")),
        }
    }

    fn of_map_server(path: &Path) -> Result<Self, Failure> {
        let rejected = |error: &dyn std::error::Error| Failure::rejected(path, "regions.map", error);
        let metadata = MapMetadata::read(files::open(path)?).map_err(|error| rejected(&error))?;
        let image: PathBuf = path.parent().unwrap_or(Path::new(".")).join(&metadata.image);
        let read = read_image(&metadata, files::open(&image)?);
        let read = read.map_err(|error| Failure::rejected(&image, "regions.map", &error))?;
        Ok(Self {
            // Degrees of a map with scaled occupancy become degrees of membership.
            free: read.cells.map(|&cell| if cell < 0 { 0.0 } else { 1.0 - f32::from(cell) / 100.0 }),
            unknown: Some(read.cells.map(|&cell| cell < 0)),
            map_from_grid: read.map_from_grid,
        })
    }

    fn of_picture(path: &Path, resolution: f64) -> Result<Self, Failure> {
        let rejected = |error: &dyn std::error::Error| Failure::rejected(path, "regions.picture", error);
        let mut decoder = png::Decoder::new(files::open(path)?);
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
        let mut reader = decoder.read_info().map_err(|error| rejected(&error))?;
        let (columns, rows) = (reader.info().width as usize, reader.info().height as usize);
        let frame = GridFrame::new(Point2::origin(), resolution, rows, columns).map_err(|error| rejected(&error))?;
        let size = reader.output_buffer_size().filter(|&size| size <= 1 << 30);
        let size = size.ok_or_else(|| rejected(&png::DecodingError::LimitsExceeded))?;
        let mut bytes = vec![0; size];
        let info = reader.next_frame(&mut bytes).map_err(|error| rejected(&error))?;
        let samples = info.color_type.samples();
        // Alpha says nothing of walls; a color is free where all of it is bright.
        let colors = if samples > 2 { 3 } else { 1 };
        let white = |pixel: &[u8]| pixel[..colors].iter().all(|&shade| shade >= WHITE);
        let lines = bytes[..info.buffer_size()].chunks_exact(columns * samples).rev();
        let cells = lines.flat_map(|line| line.chunks_exact(samples)).map(|pixel| f32::from(u8::from(white(pixel))));
        let free = Grid::from_cells(frame, cells.collect()).unwrap_or_else(|_| Grid::new(frame));
        Ok(Self { free, unknown: None, map_from_grid: Isometry2::identity() })
    }
}

fn usage(message: &str) -> Failure {
    Failure::new(Exit::Usage, "regions.arguments", message)
}

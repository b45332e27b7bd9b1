use std::io;
use std::path::Path;

use global_grid::layers::{Layer, read_layers, read_legend, write_layer, write_legend};
use global_grid::map_server::{MapMetadata, Mode, read_image, write_pgm, write_raw, write_scale, write_yaml};
use global_grid::{CrispOptions, Occupancy, occupancy};
use local_grid::{Fuzzy, FuzzyGrid};
use nalgebra::Isometry2;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

/// Writes the gridmap into a folder: for a map server, for people, and as layers without loss. Checks what the map server
/// will read.
pub(crate) fn write(folder: &Path, grid: &FuzzyGrid, force: bool) -> Result<(), Failure> {
    let layers = folder.join("layers");
    std::fs::create_dir_all(&layers).map_err(|error| Failure::writing(&layers, &error))?;
    let put = |path: &Path, content: &dyn Fn(&mut dyn io::Write) -> io::Result<()>| {
        files::write(path, force, content).map_err(|error| Failure::writing(path, &error))
    };
    let crisp = occupancy(grid, &CrispOptions::for_map(grid));
    put(&folder.join("map.pgm"), &|mut out| write_pgm(&crisp, &mut out))?;
    let metadata = MapMetadata::new("map.pgm", crisp.frame());
    put(&folder.join("map.yaml"), &|mut out| write_yaml(&metadata, &mut out))?;
    put(&folder.join("map.png"), &|out| global_grid::write_picture(grid, out).map_err(io::Error::other))?;
    for layer in Layer::ALL {
        let path = layers.join(format!("{}.png", layer.name()));
        put(&path, &|out| write_layer(grid, layer, out).map_err(io::Error::other))?;
    }
    put(&layers.join("legend.json"), &|mut out| write_legend(grid.frame(), &mut out))?;
    let read = read_map(&folder.join("map.yaml"))?.grid;
    let cells = |grid: &FuzzyGrid| grid.map(|&cell| CrispOptions::default().occupancy(cell)).cells().to_vec();
    if cells(&read) != crisp.cells() {
        let message =
            format!("{} does not read back to the cells that were written", folder.join("map.yaml").display());
        return Err(Failure::new(Exit::Failed, "grid.check", message));
    }
    Ok(())
}

/// Writes the gridmap once more, for map servers that are to see degrees: `map_scale.png` or `map_raw.pgm`, with its
/// description.
pub(crate) fn write_degrees(folder: &Path, grid: &FuzzyGrid, mode: Mode, force: bool) -> Result<(), Failure> {
    let put = |name: &str, content: &dyn Fn(&mut dyn io::Write) -> io::Result<()>| {
        let path = folder.join(name);
        files::write(&path, force, content).map_err(|error| Failure::writing(&path, &error))
    };
    let probability = grid.map(|cell| {
        let known = cell.empty > 0.0 || cell.occupied > 0.0;
        known.then_some(0.5 * (1.0 + cell.occupied - cell.empty))
    });
    let (image, description) = match mode {
        Mode::Raw => ("map_raw.pgm", "map_raw.yaml"),
        Mode::Trinary | Mode::Scale => ("map_scale.png", "map_scale.yaml"),
    };
    put(image, &|mut out| match mode {
        Mode::Raw => write_raw(&probability, &mut out),
        Mode::Trinary | Mode::Scale => write_scale(&probability, out).map_err(io::Error::other),
    })?;
    let metadata = MapMetadata { mode, ..MapMetadata::new(image, grid.frame()) };
    put(description, &|mut out| write_yaml(&metadata, &mut out))
}

/// A gridmap that was read.
pub(crate) struct Known {
    /// Whether degrees were found, not only free and occupied.
    pub(crate) has_degrees: bool,
    pub(crate) grid: FuzzyGrid,
    /// Where the grid lies in the map: the identity, unless a description turns it.
    pub(crate) map_from_grid: Isometry2<f64>,
}

/// The gridmap of a run folder, of the layers beside a map, or of a map server's `map.yaml` itself.
pub(crate) fn read(path: &Path) -> Result<Known, Failure> {
    let (yaml, layers) = if path.is_dir() {
        (path.join("map.yaml"), path.join("layers"))
    } else {
        (path.to_owned(), path.with_file_name("layers"))
    };
    let legend = layers.join("legend.json");
    if !legend.exists() || yaml.file_name().is_some_and(|name| name != "map.yaml") {
        return read_map(&yaml);
    }
    let rejected = |error| Failure::rejected(&layers, "layers", &error);
    let frame = read_legend(files::open(&legend)?).map_err(rejected)?;
    let open = |layer: Layer| files::open(&layers.join(format!("{}.png", layer.name())));
    let grid = read_layers(frame, open(Layer::Free)?, open(Layer::Occupied)?).map_err(rejected)?;
    Ok(Known { has_degrees: true, grid, map_from_grid: Isometry2::identity() })
}

/// A map server's map: free cells are wholly empty, occupied ones wholly occupied, the others unexplored.
fn read_map(yaml: &Path) -> Result<Known, Failure> {
    let metadata =
        MapMetadata::read(files::open(yaml)?).map_err(|error| Failure::rejected(yaml, "map.yaml", &error))?;
    let image = yaml.with_file_name(&metadata.image);
    let map =
        read_image(&metadata, files::open(&image)?).map_err(|error| Failure::rejected(&image, "map.image", &error))?;
    let grid = map.occupancy().map(|cell| match cell {
        Occupancy::Unknown => Fuzzy::default(),
        Occupancy::Free => Fuzzy { empty: 1.0, occupied: 0.0 },
        Occupancy::Occupied => Fuzzy { empty: 0.0, occupied: 1.0 },
    });
    Ok(Known { has_degrees: false, grid, map_from_grid: map.map_from_grid })
}

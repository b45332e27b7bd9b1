use std::io;
use std::path::Path;

use global_grid::layers::{Layer, read_layers, read_legend, write_layer, write_legend};
use global_grid::map_server::{MapMetadata, read_image, write_pgm, write_yaml};
use global_grid::{CrispOptions, Occupancy, occupancy};
use local_grid::{Fuzzy, FuzzyGrid};

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
    let crisp = occupancy(grid, &CrispOptions::default());
    put(&folder.join("map.pgm"), &|mut out| write_pgm(&crisp, &mut out))?;
    let metadata = MapMetadata::new("map.pgm", crisp.frame());
    put(&folder.join("map.yaml"), &|mut out| write_yaml(&metadata, &mut out))?;
    put(&folder.join("map.png"), &|out| global_grid::write_picture(grid, out).map_err(io::Error::other))?;
    for layer in Layer::ALL {
        let path = layers.join(format!("{}.png", layer.name()));
        put(&path, &|out| write_layer(grid, layer, out).map_err(io::Error::other))?;
    }
    put(&layers.join("legend.json"), &|mut out| write_legend(grid.frame(), &mut out))?;
    let (_, read) = read_map(&folder.join("map.yaml"))?;
    let cells = |grid: &FuzzyGrid| grid.map(|&cell| CrispOptions::default().occupancy(cell)).cells().to_vec();
    if cells(&read) != crisp.cells() {
        let message =
            format!("{} does not read back to the cells that were written", folder.join("map.yaml").display());
        return Err(Failure::new(Exit::Failed, "grid.check", message));
    }
    Ok(())
}

/// The gridmap of a run folder, of the layers beside a map, or of a map server's `map.yaml` itself; and whether degrees
/// were found, not only free and occupied.
pub(crate) fn read(path: &Path) -> Result<(bool, FuzzyGrid), Failure> {
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
    let grid = read_layers(frame, open(Layer::Empty)?, open(Layer::Occupied)?).map_err(rejected)?;
    Ok((true, grid))
}

/// A map server's map: free cells are wholly empty, occupied ones wholly occupied, the others unexplored.
fn read_map(yaml: &Path) -> Result<(bool, FuzzyGrid), Failure> {
    let metadata =
        MapMetadata::read(files::open(yaml)?).map_err(|error| Failure::rejected(yaml, "map.yaml", &error))?;
    let image = yaml.with_file_name(&metadata.image);
    let map =
        read_image(&metadata, files::open(&image)?).map_err(|error| Failure::rejected(&image, "map.image", &error))?;
    if metadata.origin[2] != 0.0 {
        let message =
            format!("could not use {}: its origin turns the map by {} rad", yaml.display(), metadata.origin[2]);
        return Err(
            Failure::new(Exit::Rejected, "map.turned", message).help("turn the map itself, and give a yaw of 0")
        );
    }
    let cells = map.occupancy().map(|cell| match cell {
        Occupancy::Unknown => Fuzzy::default(),
        Occupancy::Free => Fuzzy { empty: 1.0, occupied: 0.0 },
        Occupancy::Occupied => Fuzzy { empty: 0.0, occupied: 1.0 },
    });
    Ok((false, cells))
}

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use region_map::nalgebra::Isometry2;
use region_map::{Gateway, Options, Region, RegionMap, export};
use serde::Serialize;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

mod floor;
mod names;
mod of_run;

use floor::Floor;

/// Rooms, corridors and gateways of a map
///
/// Example: topogrid regions runs/office --name 3=kitchen
///
/// Example: topogrid regions runs/tuesday --names-of runs/monday
#[derive(Debug, Args)]
#[command(
    after_help = "With --out: regions.geojson (polygons and gateways with their attributes, metres), regions.png (to \
                        look at: gateways are white, shut ones red; small maps are enlarged), labels.png (16 bit, as large as the map, 0 = no region).\nOf a run, names and closed \
                        gateways are kept in its session: they move with the map and outlive it."
)]
pub(crate) struct RegionsArgs {
    /// A map_server map (.yaml), a picture (.png, white = free), or the folder of a run
    #[arg(value_name = "MAP")]
    map: PathBuf,
    /// The folder for the results; without it only the table is printed, and of a run its own files are renewed where
    /// names or gateways change
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Metres per pixel of a picture
    #[arg(long, value_name = "M", value_parser = crate::input::positive)]
    resolution: Option<f64>,
    /// Free-standing obstacles up to this many metres across are furniture [default: 1.1; of a run always that]
    #[arg(long, value_name = "M")]
    furniture: Option<f64>,
    /// Give a region a name; may be repeated
    #[arg(long = "name", value_name = "LABEL=NAME", value_parser = names::parse)]
    names: Vec<(u16, String)>,
    /// Of a run: the names that regions have in another run through the same building; the two may begin anywhere
    #[arg(long, value_name = "RUN")]
    names_of: Option<PathBuf>,
    /// Of a run: nobody can pass this gateway, so no plan leads through it; may be repeated
    #[arg(long = "close", value_name = "GATEWAY")]
    closed: Vec<usize>,
    /// Of a run: the gateway can be passed again; may be repeated
    #[arg(long = "open", value_name = "GATEWAY")]
    opened: Vec<usize>,
    /// Replace files where they exist; names given there before stay with their regions
    #[arg(long)]
    force: bool,
}

/// The files of the command.
const FILES: [&str; 3] = ["regions.geojson", "regions.png", "labels.png"];

/// What was found, for programs.
#[derive(Debug, Serialize)]
struct Found<'a> {
    schema: &'static str,
    map: String,
    resolution_m: f64,
    regions: &'a [Region],
    gateways: &'a [Gateway],
    /// Of a run: the places in each region, in the order of the regions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    places: Vec<Vec<u32>>,
    files: Vec<String>,
}

/// Finds the regions.
pub(crate) fn run(args: &RegionsArgs, context: &Context) -> Result<(), Failure> {
    let session = args.map.join("session.hmap");
    if session.exists() {
        return of_run::run(args, &session, context);
    }
    if !(args.closed.is_empty() && args.opened.is_empty()) {
        let message = format!("{} is no run that could remember closed gateways", args.map.display());
        return Err(Failure::new(Exit::Usage, "regions.arguments", message).help("name the folder of a run"));
    }
    if args.names_of.is_some() {
        let message = format!("{} is no run that could take the names of another", args.map.display());
        return Err(Failure::new(Exit::Usage, "regions.arguments", message).help("name the folder of a run"));
    }
    let floor = Floor::open(&args.map, args.resolution)?;
    let furniture = args.furniture.unwrap_or(Options::default().furniture);
    let options = Options { furniture, ..Options::default() };
    let mut map = match &floor.unknown {
        Some(unknown) => region_map::segment_explored(&floor.free, unknown, &options),
        None => region_map::segment(&floor.free, &options),
    }
    .map_err(|error| Failure::rejected(&args.map, "regions.map", &error))?;
    warn_of_none(&map, args, context);
    if let Some(out) = &args.out {
        for lost in names::recall(&out.join(FILES[0]), &mut map, &floor.map_from_grid)? {
            context.warn(&format!("the name `{lost}` found no region of its own any more"));
        }
    }
    for (label, name) in &args.names {
        map.name(*label, name).map_err(|error| names::refused(&error))?;
    }
    let written = args.out.as_deref().map_or(Ok(Vec::new()), |out| write(out, args.force, &map, &floor))?;
    show(args, context, map, &floor, Vec::new(), written)
}

fn warn_of_none(map: &RegionMap, args: &RegionsArgs, context: &Context) {
    if map.regions.is_empty() {
        context.warn(&format!("{} has no free space of the size of a room", args.map.display()));
    }
}

/// Writes all files, or none where one exists already.
fn write(out: &Path, force: bool, map: &RegionMap, floor: &Floor) -> Result<Vec<String>, Failure> {
    let paths = FILES.map(|name| out.join(name));
    if let Some(path) = paths.iter().find(|path| !force && path.exists()) {
        let message = format!("could not write {}: the file exists", path.display());
        return Err(Failure::new(Exit::Usage, "output.exists", message).help("choose another --out, or --force"));
    }
    std::fs::create_dir_all(out).map_err(|error| Failure::writing(out, &error))?;
    let save = |path: &Path, content: &dyn Fn(&mut dyn Write) -> io::Result<()>| {
        files::write(path, true, |out| content(out)).map_err(|error| Failure::writing(path, &error))
    };
    save(&paths[0], &|mut out| export::write_geojson(&mut out, map, &floor.map_from_grid))?;
    save(&paths[1], &|mut out| export::write_picture(&mut out, map, &floor.free))?;
    save(&paths[2], &|mut out| export::write_labels(&mut out, &map.labels))?;
    Ok(paths.iter().map(|path| path.display().to_string()).collect())
}

/// Prints the table, or the document.
fn show(
    args: &RegionsArgs,
    context: &Context,
    mut map: RegionMap,
    floor: &Floor,
    places: Vec<Vec<u32>>,
    files: Vec<String>,
) -> Result<(), Failure> {
    in_map_frame(&mut map, &floor.map_from_grid);
    if context.json {
        return context.print_json(&Found {
            schema: "topogrid/regions/1",
            map: args.map.display().to_string(),
            resolution_m: floor.free.frame().resolution(),
            regions: &map.regions,
            gateways: &map.gateways,
            places,
            files,
        });
    }
    let mut table = Vec::new();
    export::write_table(&mut table, &map).map_err(Failure::stdout)?;
    context.print(&String::from_utf8_lossy(&table))?;
    files.iter().try_for_each(|file| context.print(&format!("wrote {file}\n")))
}

/// Regions and gateways as the map has them, where the image lies turned in it.
fn in_map_frame(map: &mut RegionMap, map_from_grid: &Isometry2<f64>) {
    map.regions.iter_mut().for_each(|region| *region = region.moved(map_from_grid));
    map.gateways.iter_mut().for_each(|gateway| *gateway = gateway.moved(map_from_grid));
}

use std::io::Read;
use std::path::Path;

use simulator::{MapDescription, MapImage, OfficeStyle, World, random_office};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

/// The worlds that come along.
const BUNDLED: [(&str, &str); 4] = [
    ("office-46x12", include_str!("../../../../../fixtures/worlds/office-46x12.toml")),
    ("office-loop", include_str!("../../../../../fixtures/worlds/office-loop.toml")),
    ("laboratory", include_str!("../../../../../fixtures/worlds/laboratory.toml")),
    ("flat", include_str!("../../../../../fixtures/worlds/flat.toml")),
];

/// No plan and no description is longer: a bound against files that are something else.
const LONGEST_TEXT: u64 = 16 << 20;

/// The world that an argument names: a file, a world that comes along, or a random office.
///
/// `resolution` is the scale of a drawn floor plan, in metres per pixel; other worlds have their own.
pub(crate) fn load(name: &str, resolution: Option<f64>) -> Result<World, Failure> {
    if let Some((_, plan)) = BUNDLED.iter().find(|(bundled, _)| *bundled == name) {
        return World::from_plan(plan).map_err(|error| Failure::new(Exit::Failed, "internal.world", error.to_string()));
    }
    if let Some(seed) = name.strip_prefix("random:") {
        let seed = seed.parse().map_err(|_| {
            Failure::new(
                Exit::Usage,
                "simulate.world",
                format!("expected a whole number after `random:`, got `{seed}`"),
            )
        })?;
        return Ok(random_office(seed, &OfficeStyle::default()));
    }
    let path = Path::new(name);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => {
            World::from_plan(&read_text(path)?).map_err(|error| Failure::rejected(path, "world.plan", &error))
        }
        Some("yaml" | "yml") => map(path),
        Some("map") => {
            let text = String::from_utf8_lossy(&read(path, LONGEST_TEXT)?).into_owned(); // labels may be in any encoding
            World::from_line_map(&stem(path), &text).map_err(|error| Failure::rejected(path, "world.map", &error))
        }
        Some("png" | "pgm" | "gz") => {
            let resolution = resolution.ok_or_else(|| {
                let message = format!("{} is an image, which has no scale of its own", path.display());
                Failure::new(Exit::Usage, "simulate.resolution", message)
                    .help("give it with --resolution M (metres per pixel), or name the map's .yaml")
            })?;
            drawing(path, path, &MapDescription::drawing(&stem(path), resolution))
        }
        _ => {
            let names: Vec<&str> = BUNDLED.iter().map(|(name, _)| *name).collect();
            let message = format!("`{name}` is no world");
            Err(Failure::new(Exit::Usage, "simulate.world", message).help(format!(
                "name a plan (.toml), a map (.yaml, .map, or an image with --resolution), random:SEED, or one that comes along: {}",
                names.join(", ")
            )))
        }
    }
}

/// The world of a map_server map; its image may be packed with gzip.
fn map(path: &Path) -> Result<World, Failure> {
    let description = MapDescription::parse(&read_text(path)?);
    let description = description.map_err(|error| Failure::rejected(path, "world.map", &error))?;
    let image = path.with_file_name(&description.image);
    let packed = path.with_file_name(format!("{}.gz", description.image));
    drawing(path, if !image.exists() && packed.exists() { &packed } else { &image }, &description)
}

/// The world that an image shows; `path` is the file that the user named.
fn drawing(path: &Path, image: &Path, description: &MapDescription) -> Result<World, Failure> {
    let bytes = read(image, 4 * MapImage::MOST_PIXELS as u64)?;
    let pixels = MapImage::read(&bytes).map_err(|error| Failure::rejected(image, "world.image", &error))?;
    World::from_map(&stem(path), description, &pixels).map_err(|error| Failure::rejected(path, "world.map", &error))
}

/// The name of a file without its folder and ending.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// A text file as a whole.
pub(crate) fn read_text(path: &Path) -> Result<String, Failure> {
    String::from_utf8(read(path, LONGEST_TEXT)?).map_err(|error| {
        let message = format!("could not use {}: it is no text ({error})", path.display());
        Failure::new(Exit::Rejected, "input.text", message)
    })
}

/// A file as a whole; one longer than `most` bytes is refused.
fn read(path: &Path, most: u64) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let length = files::open(path)?.take(most + 1).read_to_end(&mut bytes);
    if length.map_err(|error| Failure::reading(path, &error))? as u64 > most {
        let message = format!("could not use {}: it is longer than {most} bytes", path.display());
        return Err(Failure::new(Exit::Rejected, "input.length", message));
    }
    Ok(bytes)
}

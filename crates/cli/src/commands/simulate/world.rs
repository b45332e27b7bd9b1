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
pub(crate) fn load(name: &str) -> Result<World, Failure> {
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
        _ => {
            let names: Vec<&str> = BUNDLED.iter().map(|(name, _)| *name).collect();
            let message = format!("`{name}` is no world");
            Err(Failure::new(Exit::Usage, "simulate.world", message).help(format!(
                "name a plan (.toml), a map (.yaml), random:SEED, or one that comes along: {}",
                names.join(", ")
            )))
        }
    }
}

/// The world of a map_server map; its image may be packed with gzip.
fn map(path: &Path) -> Result<World, Failure> {
    let rejected = |error: &dyn std::error::Error| Failure::rejected(path, "world.map", error);
    let description = MapDescription::parse(&read_text(path)?).map_err(|error| rejected(&error))?;
    let image = path.with_file_name(&description.image);
    let packed = path.with_file_name(format!("{}.gz", description.image));
    let image = if !image.exists() && packed.exists() { packed } else { image };
    let mut bytes = Vec::new();
    let limit = 4 * MapImage::MOST_PIXELS as u64;
    files::open(&image)?.take(limit).read_to_end(&mut bytes).map_err(|error| Failure::reading(&image, &error))?;
    let pixels = MapImage::read(&bytes).map_err(|error| Failure::rejected(&image, "world.image", &error))?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    World::from_map(&name, &description, &pixels).map_err(|error| rejected(&error))
}

/// A text file as a whole.
pub(crate) fn read_text(path: &Path) -> Result<String, Failure> {
    let mut bytes = Vec::new();
    files::open(path)?.take(LONGEST_TEXT).read_to_end(&mut bytes).map_err(|error| Failure::reading(path, &error))?;
    String::from_utf8(bytes).map_err(|error| {
        let message = format!("could not use {}: it is no text ({error})", path.display());
        Failure::new(Exit::Rejected, "input.text", message)
    })
}

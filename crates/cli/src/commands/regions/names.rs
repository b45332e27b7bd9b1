use std::path::Path;

use region_map::nalgebra::{Isometry2, Point2};
use region_map::{NoSuchRegion, RegionMap};
use serde::Deserialize;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

/// Reads `LABEL=NAME`.
pub(super) fn parse(text: &str) -> Result<(u16, String), String> {
    let (label, name) = text.split_once('=').ok_or("expected LABEL=NAME, such as 3=kitchen")?;
    let label: u16 = label.trim().parse().map_err(|_| format!("expected the number of a region, got `{label}`"))?;
    let name = name.trim();
    if name.is_empty() || name.chars().any(char::is_control) {
        return Err("expected a name of at least one character, and no control characters".to_owned());
    }
    Ok((label, name.to_owned()))
}

/// A label that no region has.
pub(super) fn refused(error: &NoSuchRegion) -> Failure {
    Failure::new(Exit::Usage, "regions.name", format!("could not name a region: {error}"))
}

/// What is needed of an earlier result.
#[derive(Debug, Deserialize)]
struct Collection {
    features: Vec<Feature>,
}

#[derive(Debug, Deserialize)]
struct Feature {
    properties: Properties,
}

#[derive(Debug, Deserialize)]
struct Properties {
    name: Option<String>,
    inside: Option<[f64; 2]>,
}

/// Gives the regions the names that an earlier result in the same place holds; gives back the names that found no region
/// of their own. A region keeps its name where it still holds the point that was farthest from its walls.
pub(super) fn recall(path: &Path, map: &mut RegionMap, map_from_grid: &Isometry2<f64>) -> Result<Vec<String>, Failure> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let earlier: Collection = serde_json::from_reader(files::open(path)?).map_err(|error| {
        let message = format!("could not read names from {}: {error}", path.display());
        Failure::new(Exit::Rejected, "regions.earlier", message).help("remove the file, or choose another --out")
    })?;
    let mut lost = Vec::new();
    for Properties { name, inside } in earlier.features.into_iter().map(|feature| feature.properties) {
        let (Some(name), Some([x, y])) = (name, inside) else { continue };
        let place = map_from_grid.inverse() * Point2::new(x, y);
        match map.region_at(place).filter(|region| region.name.is_none()).map(|region| region.label) {
            Some(label) => {
                // The label was read from the map just now, so the region exists.
                let _ = map.name(label, name);
            }
            None => lost.push(name),
        }
    }
    Ok(lost)
}

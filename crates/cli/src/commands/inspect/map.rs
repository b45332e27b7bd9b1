use std::path::Path;

use global_grid::Occupancy;
use global_grid::map_server::{MapMetadata, read_image};
use hierarchy::evaluate::sharpness;
use serde_json::json;

use crate::context::Context;
use crate::failure::Failure;
use crate::files;

/// Whether the name says that the file describes a map.
pub(super) fn is_map(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "yaml" || extension == "yml")
}

/// Prints what the map holds; whether it is healthy.
pub(super) fn inspect(path: &Path, context: &Context) -> Result<bool, Failure> {
    let metadata =
        MapMetadata::read(files::open(path)?).map_err(|error| Failure::rejected(path, "map.description", &error))?;
    let image = path.parent().unwrap_or(Path::new(".")).join(&metadata.image);
    let read =
        read_image(&metadata, files::open(&image)?).map_err(|error| Failure::rejected(&image, "map.image", &error))?;
    let map = read.occupancy();
    let (frame, sharp) = (map.frame(), sharpness(&map));
    let count = |kind: Occupancy| map.cells().iter().filter(|cell| **cell == kind).count();
    let (occupied, free) = (count(Occupancy::Occupied), count(Occupancy::Free));
    let mut findings = Vec::new();
    if metadata.free_thresh > 50.0 / 255.0 && !metadata.negate {
        let threshold = metadata.free_thresh;
        findings.push(format!("free_thresh {threshold} makes the usual shade of the unknown, 205, free: write 0.196"));
    }
    for (missing, what) in [(free == 0, "nothing is free"), (occupied == 0, "nothing is occupied")] {
        findings.extend(missing.then(|| what.to_owned()));
    }
    if context.json {
        context.print_json(&json!({
            "schema": "topogrid/inspect/1", "file": path.display().to_string(), "holds": "map",
            "map": { "rows": frame.rows(), "columns": frame.columns(), "resolution_m": frame.resolution(), "origin": metadata.origin,
                     "occupied": occupied, "free": free, "unknown": frame.n_cells() - occupied - free, "sharpness": sharp },
            "healthy": findings.is_empty(), "findings": findings,
        }))?;
    } else {
        let (rows, columns, resolution) = (frame.rows(), frame.columns(), frame.resolution());
        let mut text = format!("{}: a map of {columns} × {rows} cells at {resolution} m\n", path.display());
        let thickness = sharp.wall_thickness_m.map_or(String::new(), |metres| format!(", walls {metres:.3} m thick"));
        text += &format!("  {:.1} m² free, {:.1} m² occupied{thickness}\n", sharp.free_m2, sharp.occupied_m2);
        findings.iter().for_each(|finding| text += &format!("  ! {finding}\n"));
        text += if findings.is_empty() { "healthy\n" } else { "not healthy\n" };
        context.print(&text)?;
    }
    Ok(findings.is_empty())
}

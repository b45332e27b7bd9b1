use std::io;
use std::path::Path;

use hierarchy::{Config, Mapper, Metrics, RouteOptions};
use nalgebra::Isometry2;

use crate::exit::Exit;
use crate::export::{self, Format, Source};
use crate::failure::Failure;
use crate::finished::Finished;
use crate::finished::loops_csv;
use crate::finished::map_folder;
use crate::report::Page;
use crate::run_folder::RunFolder;

/// What a run folder holds for other programs without being asked.
const EXPORTS: [(&str, Format); 6] = [
    ("topology.svg", Format::Svg),
    ("topology.g2o", Format::G2o),
    ("topology.geojson", Format::Geojson),
    ("nav2_route.geojson", Format::Nav2Route),
    ("places.tmap2.yaml", Format::Tmap2),
    ("trajectory.tum", Format::Tum),
];

/// Writes everything that follows from a finished map, except its figures, which know how long this took.
pub(crate) fn write(folder: &RunFolder, name: &str, finished: &Finished) -> Result<(), Failure> {
    let Finished { mapper, gridmap, regions, explanation, .. } = finished;
    map_folder::write(folder.path(), gridmap, true)?;
    let atlas = mapper.atlas().map_err(|error| Failure::new(Exit::Failed, "map", error.to_string()))?;
    let source = Source { mapper, atlas: &atlas, name, frame: "map", routes: RouteOptions::default() };
    for (file, format) in EXPORTS {
        folder.write(file, |out| format.write(out, &source))?;
    }
    if !regions.regions.is_empty() {
        let free = hierarchy::floor(gridmap, &mapper.poses());
        folder.write("regions.geojson", |mut out| {
            region_map::export::write_geojson(&mut out, regions, &Isometry2::identity())
        })?;
        folder.write("regions.png", |mut out| region_map::export::write_picture(&mut out, regions, &free))?;
    }
    folder.write("odometry.tum", |out| {
        let raw = mapper.trajectory().samples().iter().map(|sample| (sample.stamp, sample.odom_from_robot));
        export::write_tum_path(out, raw)
    })?;
    folder.write("loops.csv", |out| loops_csv::write(out, &explanation.loops))
}

/// The map as it was recorded, to go on with.
pub(crate) fn write_session(folder: &RunFolder, mapper: &Mapper) -> Result<(), Failure> {
    folder.write("session.hmap", |mut out| mapper.save(&mut out).map_err(io::Error::other))
}

/// The session alone, while the map is still being made.
pub(crate) fn checkpoint(folder: &Path, mapper: &Mapper) -> Result<(), Failure> {
    write_session(&RunFolder::existing(folder), mapper)
}

/// The settings that the map was made with.
pub(crate) fn write_config(folder: &RunFolder, config: &Config) -> Result<(), Failure> {
    folder.write("config.toml", |out| out.write_all(config.to_toml().as_bytes()))
}

/// The page that shows it all.
pub(crate) fn write_report(folder: &RunFolder, page: Page, metrics: &Metrics) -> Result<(), Failure> {
    let text = page.with(metrics);
    folder.write("report.html", |out| out.write_all(text.as_bytes()))
}

/// The figures of the run.
pub(crate) fn write_metrics(folder: &RunFolder, metrics: &Metrics) -> Result<(), Failure> {
    folder.write("metrics.json", |out| Ok(serde_json::to_writer_pretty(out, metrics)?))
}

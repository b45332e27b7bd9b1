pub(crate) mod loops_csv;
pub(crate) mod map_folder;
pub(crate) mod memory;
pub(crate) mod output;
pub(crate) mod summary;

use std::time::Instant;

use hierarchy::explain::{Explanation, explain};
use hierarchy::local_grid::FuzzyGrid;
use hierarchy::{GridMetrics, Mapper, Metrics};
use region_map::RegionMap;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;

/// A finished map with everything that is written of it.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) mapper: Mapper,
    pub(crate) gridmap: FuzzyGrid,
    pub(crate) regions: RegionMap,
    pub(crate) explanation: Explanation,
    pub(crate) metrics: Metrics,
}

impl Finished {
    /// Draws the gridmap, cuts it into regions, and explains it all.
    pub(crate) fn draw(mut mapper: Mapper, context: &Context) -> Result<Self, Failure> {
        if mapper.topology().places().is_empty() {
            let message = "the log holds no scan, so there is nothing to map";
            return Err(
                Failure::new(Exit::Rejected, "map.empty", message).help("topogrid inspect LOG tells what it holds")
            );
        }
        let stage = context.progress().stage("gridmap", 0);
        let drawing = Instant::now();
        let gridmap = mapper.gridmap().map_err(rejected)?;
        let seconds_grid = drawing.elapsed().as_secs_f64();
        let frame = gridmap.frame();
        stage.finish(&format!("{} × {} cells of {} m", frame.rows(), frame.columns(), frame.resolution()));
        let stage = context.progress().stage("regions", 0);
        let cutting = Instant::now();
        let regions = mapper.survey(&gridmap).map_err(|error| {
            Failure::new(Exit::Rejected, "regions", format!("could not cut the map into regions: {error}"))
        })?;
        stage.finish(&format!("{} regions, {} gateways", regions.regions.len(), regions.gateways.len()));
        let explanation = explain(&mapper).map_err(rejected)?;
        let mut metrics = mapper.metrics().map_err(rejected)?;
        metrics.regions = Some(hierarchy::count_regions(&regions));
        metrics.trust = explanation.trust();
        metrics.grid = count(&gridmap);
        metrics.timings_s.grid = seconds_grid;
        metrics.timings_s.regions = cutting.elapsed().as_secs_f64();
        Ok(Self { mapper, gridmap, regions, explanation, metrics })
    }
}

/// A log or a configuration that the mapper refuses.
pub(crate) fn rejected(error: hierarchy::MapperError) -> Failure {
    Failure::new(Exit::Rejected, "map", error.to_string())
}

fn count(gridmap: &FuzzyGrid) -> GridMetrics {
    let counts = global_grid::count_cells(gridmap, &global_grid::CrispOptions::for_map(gridmap));
    let frame = gridmap.frame();
    GridMetrics {
        rows: frame.rows(),
        columns: frame.columns(),
        resolution_m: frame.resolution(),
        calculus: "fuzzy".into(),
        occupied: counts.occupied,
        empty: counts.empty,
        contradictory: counts.contradictory,
        unexplored: counts.unexplored,
    }
}

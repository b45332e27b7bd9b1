//! `report.html`: one page that shows a run whole, opens from disk and asks nothing of any network.
//!
//! Everything in it is computed by `hierarchy`; here it is only put into words, tables and drawings. The page reads without
//! its script: tables, the gridmap and the graph are HTML and SVG. The script adds layers, places to click and the replay.

mod base64;
mod chart;
mod comparison;
mod data;
mod figure;
mod page;
mod tables;

use hierarchy::Metrics;
use hierarchy::explain::LinkStory;
use local_grid::FuzzyGrid;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::finished::Finished;
use crate::render::svg::escape;
use base64::base64;
use data::Data;
use page::{REPORT, fill};

pub(crate) use comparison::{Counts, Side, comparison};

/// The page of a run, but for how long it all took: drawing it is part of that.
pub(crate) struct Page {
    parts: Vec<(&'static str, String)>,
}

impl Page {
    /// The whole page, with the times of these figures.
    pub(crate) fn with(mut self, metrics: &Metrics) -> String {
        self.parts.push(("timings", tables::timings(metrics)));
        fill(REPORT, &self.parts)
    }
}

/// Draws the page of a finished run.
pub(crate) fn draw(name: &str, finished: &Finished) -> Result<Page, Failure> {
    let Finished { mapper, gridmap, regions, explanation, metrics } = finished;
    let atlas = mapper.atlas().map_err(|error| failed(&error))?;
    let certificate = mapper.certificate(0).map_err(|error| failed(&error))?;
    let growth = mapper.growth(data::MOST_POSITIONS).map_err(|error| failed(&error))?;
    let bridges: Vec<&LinkStory> = explanation.links.iter().filter(|link| link.bridge).collect();
    let data = Data::new(name, finished, &atlas, &growth)?;
    Ok(Page {
        parts: vec![
            ("name", escape(name)),
            ("about", tables::about(metrics)),
            ("figures", tables::figures(metrics)),
            ("map", figure::map(&atlas, gridmap.frame(), &indexed(gridmap)?)),
            ("energy", chart::energy(&growth, atlas.links.len())),
            ("before_and_after", figure::before_and_after(&atlas)),
            ("certificate", tables::certificate(metrics, &certificate, &bridges)),
            ("loops", tables::loops(&explanation.loops)),
            ("least_sure", tables::least_sure(&explanation.places)),
            ("strained", tables::strained(&explanation.links)),
            ("regions", tables::regions(regions)),
            ("config", escape(&mapper.config().to_toml())),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("data", page::json(&data)?),
        ],
    })
}

/// A gridmap as a PNG of one pixel per cell, as text.
fn indexed(grid: &FuzzyGrid) -> Result<String, Failure> {
    let mut png = Vec::new();
    global_grid::write_indexed(grid, &mut png).map_err(|error| failed(&error))?;
    Ok(base64(&png))
}

fn failed(error: &dyn std::error::Error) -> Failure {
    Failure::new(Exit::Failed, "report", format!("could not draw the report: {error}")).because_of(error)
}

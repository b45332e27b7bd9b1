//! A map in the formats of other programs: one file each, written from what `hierarchy` knows and from nothing else.

mod dot;
mod geojson;
mod mcap;
mod nav2_route;
mod places_csv;
mod tmap2;
mod tum;

use std::io::{self, Write};
use std::path::Path;

use hierarchy::{Atlas, Mapper, RouteOptions};

use crate::render::topology;

pub(crate) use tum::{write as write_tum, write_path as write_tum_path};

/// A format that a map can be given out in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Format {
    /// The route graph of Nav2's Route Server
    Nav2Route,
    /// The map of `topological_navigation`
    Tmap2,
    /// The graph of places and links, for pose-graph tools
    G2o,
    /// Places and links with all their figures
    Geojson,
    /// The graph for Graphviz, laid out as in the map
    Dot,
    /// The topological map before and after relaxation
    Svg,
    /// A table of the places
    Csv,
    /// The robot's path
    Tum,
    /// The path, the odometry and the places as messages that Foxglove draws
    Mcap,
}

/// What is exported, and how.
pub(crate) struct Source<'a> {
    pub(crate) mapper: &'a Mapper,
    pub(crate) atlas: &'a Atlas,
    /// What the map is called in files that name it.
    pub(crate) name: &'a str,
    /// The frame that coordinates are said to be in.
    pub(crate) frame: &'a str,
    /// What becomes part of a route graph.
    pub(crate) routes: RouteOptions,
}

impl Format {
    /// The format that a file's name asks for.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?.to_lowercase();
        let by_whole_name = [("tmap2.yaml", Self::Tmap2), ("nav2_route.geojson", Self::Nav2Route)];
        if let Some((_, format)) = by_whole_name.into_iter().find(|(end, _)| name.ends_with(end)) {
            return Some(format);
        }
        match name.rsplit_once('.')?.1 {
            "g2o" => Some(Self::G2o),
            "geojson" | "json" => Some(Self::Geojson),
            "dot" | "gv" => Some(Self::Dot),
            "svg" => Some(Self::Svg),
            "csv" => Some(Self::Csv),
            "tum" => Some(Self::Tum),
            "mcap" => Some(Self::Mcap),
            "tmap2" | "yaml" => Some(Self::Tmap2),
            _ => None,
        }
    }

    /// Writes the map in this format.
    pub(crate) fn write(self, out: &mut dyn Write, source: &Source) -> io::Result<()> {
        match self {
            Self::Nav2Route => nav2_route::write(out, source),
            Self::Tmap2 => tmap2::write(out, source),
            Self::G2o => relaxation::g2o::write(&source.mapper.graph(), &mut { out }).map_err(io::Error::other),
            Self::Geojson => geojson::write(out, source),
            Self::Dot => dot::write(out, source),
            Self::Svg => out.write_all(topology::before_and_after(source.atlas).as_bytes()),
            Self::Csv => places_csv::write(out, source.atlas),
            Self::Tum => write_tum(out, source.mapper),
            Self::Mcap => mcap::write(out, source),
        }
    }
}

/// A number as JSON takes it, without more digits than it is worth: tenths of a millimetre.
fn rounded(value: f64) -> f64 {
    let rounded = (value * 1e4).round() / 1e4;
    if rounded == 0.0 { 0.0 } else { rounded } // no negative zero
}

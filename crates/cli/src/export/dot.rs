use std::io::{self, Write};

use super::{Source, geojson, rounded};

/// The graph for Graphviz, `pos` in metres with a `!`: `neato -n` and `neato` keep the layout of the map.
pub(super) fn write(out: &mut dyn Write, source: &Source) -> io::Result<()> {
    writeln!(out, "graph {} {{", quoted(source.name))?;
    writeln!(out, "  node [shape=circle, width=0.3, fixedsize=true, fontsize=8];")?;
    for place in &source.atlas.places {
        let label = place.name.clone().unwrap_or_else(|| place.id.0.to_string());
        let style = if place.visited { "" } else { ", style=dashed" };
        let (x, y) = (rounded(place.position.x), rounded(place.position.y));
        writeln!(out, "  P{} [label={}, pos=\"{x},{y}!\"{style}];", place.id.0, quoted(&label))?;
    }
    for link in &source.atlas.links {
        let (from, to) = (&source.atlas.places[link.from], &source.atlas.places[link.to]);
        let style = match geojson::origin(link.origin) {
            "traveled" => "solid",
            "recognized" => "dashed",
            _ => "dotted",
        };
        writeln!(
            out,
            "  P{} -- P{} [len={}, style={style}, origin={}, state={}, residual_sigma={}];",
            from.id.0,
            to.id.0,
            rounded(link.length),
            geojson::origin(link.origin),
            geojson::state(link.state),
            rounded(link.residual_sigma)
        )?;
    }
    writeln!(out, "}}")
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

use std::io::{self, Write};

use hierarchy::{RouteEdge, RouteNode};
use serde_json::{Value, json};

use super::{Source, rounded};

/// The route graph as Nav2's Route Server loads it: nodes are points, and each way is two lines, one for each direction.
///
/// Numbers are unique among nodes and lines together; every released loader reads `MultiLineString`, the older ones
/// nothing else. `metadata` holds what scorers may use.
pub(super) fn write(out: &mut dyn Write, source: &Source) -> io::Result<()> {
    let graph = source.atlas.route_graph(&source.routes);
    let first = first_line(graph.nodes.iter().map(|node| node.place.0).max().unwrap_or(0));
    let nodes = graph.nodes.iter().map(|node| point(node, source.frame));
    let ways = graph.edges.iter().zip((first..).step_by(2)).flat_map(|(edge, id)| {
        let (from, to) = (&graph.nodes[edge.from], &graph.nodes[edge.to]);
        [line(edge, from, to, id), line(edge, to, from, id + 1)]
    });
    let features: Vec<Value> = nodes.chain(ways).collect();
    writeln!(
        out,
        "{{\"type\":\"FeatureCollection\",\"name\":{},\"crs\":{},\"features\":[",
        json!(source.name),
        json!({ "type": "name", "properties": { "name": "urn:ogc:def:crs:EPSG::3857" } })
    )?;
    for (index, feature) in features.iter().enumerate() {
        writeln!(out, "{feature}{}", if index + 1 < features.len() { "," } else { "" })?;
    }
    writeln!(out, "]}}")
}

/// The number of the first line: a power of ten beyond the numbers of the nodes, 10,000 at least as in shipped graphs.
fn first_line(last_node: u32) -> u64 {
    let mut first = 10_000;
    while first <= u64::from(last_node) {
        first *= 10;
    }
    first
}

fn point(node: &RouteNode, frame: &str) -> Value {
    json!({
        "type": "Feature",
        "properties": {
            "id": node.place.0, "frame": frame,
            "metadata": { "name": node.name, "std_m": rounded(node.sigma), "visits": node.visits },
        },
        "geometry": { "type": "Point", "coordinates": coordinates(node) },
    })
}

fn line(edge: &RouteEdge, from: &RouteNode, to: &RouteNode, id: u64) -> Value {
    let length = rounded(edge.length);
    json!({
        "type": "Feature",
        "properties": {
            "id": id, "startid": from.place.0, "endid": to.place.0, "cost": length,
            "metadata": { "length_m": length, "std_m": rounded(edge.sigma), "traversals": edge.traversals },
        },
        "geometry": { "type": "MultiLineString", "coordinates": [[coordinates(from), coordinates(to)]] },
    })
}

fn coordinates(node: &RouteNode) -> [f64; 2] {
    [rounded(node.position.x), rounded(node.position.y)]
}

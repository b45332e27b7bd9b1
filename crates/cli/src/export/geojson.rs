use std::io::{self, Write};

use hierarchy::topo_map::{LinkOrigin, LinkState};
use hierarchy::{AtlasLink, AtlasPlace};
use serde_json::{Value, json};

use super::{Source, rounded};

/// Every place and every link with all its figures, in metres of the map frame (not degrees: a plan has no place on Earth).
pub(super) fn write(out: &mut dyn Write, source: &Source) -> io::Result<()> {
    let places = source.atlas.places.iter().map(point);
    let links = source.atlas.links.iter().map(|link| {
        let end = |index: usize| &source.atlas.places[index];
        line(link, end(link.from), end(link.to))
    });
    let features: Vec<Value> = links.chain(places).collect();
    writeln!(out, "{{\"type\":\"FeatureCollection\",\"name\":{},\"features\":[", json!(source.name))?;
    for (index, feature) in features.iter().enumerate() {
        writeln!(out, "{feature}{}", if index + 1 < features.len() { "," } else { "" })?;
    }
    writeln!(out, "]}}")
}

fn point(place: &AtlasPlace) -> Value {
    let ellipse = place.ellipse.map(|(half, angle)| json!([rounded(half[0]), rounded(half[1]), rounded(angle)]));
    json!({
        "type": "Feature",
        "id": format!("P{}", place.id.0),
        "properties": {
            "kind": "place", "place": place.id.0, "name": place.name, "visited": place.visited, "visits": place.visits,
            "same_as": place.same_as.map(|place| place.0), "heading_rad": rounded(place.robot_heading),
            "ellipse": ellipse, "dead_reckoned": [rounded(place.dead_reckoned.x), rounded(place.dead_reckoned.y)],
        },
        "geometry": { "type": "Point", "coordinates": coordinates(place) },
    })
}

fn line(link: &AtlasLink, from: &AtlasPlace, to: &AtlasPlace) -> Value {
    json!({
        "type": "Feature",
        "id": format!("L{}", link.id.0),
        "properties": {
            "kind": "link", "link": link.id.0, "from": from.id.0, "to": to.id.0, "origin": origin(link.origin),
            "state": state(link.state), "length_m": rounded(link.length), "std_m": rounded(link.sigma),
            "residual_m": rounded(link.residual), "residual_sigma": rounded(link.residual_sigma),
            "traversals": link.traversals,
        },
        "geometry": { "type": "LineString", "coordinates": [coordinates(from), coordinates(to)] },
    })
}

fn coordinates(place: &AtlasPlace) -> [f64; 2] {
    [rounded(place.position.x), rounded(place.position.y)]
}

/// The word for where a link comes from.
pub(super) fn origin(origin: LinkOrigin) -> &'static str {
    match origin {
        LinkOrigin::Traveled => "traveled",
        LinkOrigin::Recognized => "recognized",
        LinkOrigin::Predicted => "predicted",
    }
}

/// The word for whether a link holds.
pub(super) fn state(state: LinkState) -> &'static str {
    match state {
        LinkState::Open => "open",
        LinkState::Blocked => "blocked",
        LinkState::Rejected => "rejected",
    }
}

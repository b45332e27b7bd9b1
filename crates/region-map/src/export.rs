//! Regions for other programs and for people: GeoJSON, labels as an image, a coloured picture, a table.

use std::io::{self, Write};

use local_grid::{
    Grid,
    nalgebra::{Isometry2, Point2},
};

use crate::{Gateway, Polygon, Region, RegionMap};

mod picture;

pub use picture::write_picture;

/// Writes regions as polygons and gateways as lines, in metres of the map frame (not degrees: a plan has no place on Earth).
/// `map_from_grid` is the identity unless the grid lies turned in the map.
///
/// # Errors
///
/// What `out` gives back.
pub fn write_geojson(out: &mut impl Write, map: &RegionMap, map_from_grid: &Isometry2<f64>) -> io::Result<()> {
    let outlines = map.outlines();
    let regions = map.regions.iter().zip(&outlines).map(|(region, outline)| {
        let parts: Vec<Polygon> = outline.parts.iter().map(|part| part.moved(map_from_grid)).collect();
        region_feature(&region.moved(map_from_grid), &parts)
    });
    let gateways = map.gateways.iter().enumerate();
    let gateways = gateways.map(|(index, gateway)| gateway_feature(index, &gateway.moved(map_from_grid)));
    let features: Vec<String> = regions.chain(gateways).collect();
    writeln!(out, "{{\"type\":\"FeatureCollection\",\"features\":[\n{}\n]}}", features.join(",\n"))
}

fn region_feature(region: &Region, parts: &[Polygon]) -> String {
    let polygons: Vec<String> = parts.iter().map(polygon).collect();
    let geometry = match &polygons[..] {
        [one] => format!("{{\"type\":\"Polygon\",\"coordinates\":{one}}}"),
        many => format!("{{\"type\":\"MultiPolygon\",\"coordinates\":[{}]}}", many.join(",")),
    };
    let name = region.name.as_deref().map_or("null".to_owned(), quoted);
    format!(
        "{{\"type\":\"Feature\",\"id\":\"region-{label}\",\"geometry\":{geometry},\"properties\":{{\
         \"kind\":\"region\",\"label\":{label},\"name\":{name},\"area_m2\":{:.3},\"length_m\":{:.3},\"width_m\":{:.3},\
         \"orientation_rad\":{:.4},\"elongation\":{:.3},\"room\":{:.3},\"corridor\":{:.3},\"frontier_m\":{:.3},\"wall_m\":{:.3},\
         \"centroid\":{},\"inside\":{}}}}}",
        region.area,
        region.length,
        region.width,
        region.orientation,
        region.elongation,
        region.room,
        region.corridor,
        region.frontier,
        region.wall,
        place(&region.centroid),
        place(&region.inside),
        label = region.label,
    )
}

fn gateway_feature(index: usize, gateway: &Gateway) -> String {
    let [from, to] = gateway.regions;
    format!(
        "{{\"type\":\"Feature\",\"id\":\"gateway-{index}\",\"geometry\":{{\"type\":\"LineString\",\"coordinates\":[{},{}]}},\
         \"properties\":{{\"kind\":\"gateway\",\"index\":{index},\"regions\":[{from},{to}],\"width_m\":{:.3},\"confidence\":{:.3},\
         \"blocked\":{},\"center\":{},\"normal\":[{:.4},{:.4}]}}}}",
        place(&gateway.ends[0]),
        place(&gateway.ends[1]),
        gateway.width,
        gateway.confidence,
        gateway.blocked,
        place(&gateway.center),
        gateway.normal.x,
        gateway.normal.y,
    )
}

fn polygon(polygon: &Polygon) -> String {
    let rings: Vec<String> = std::iter::once(&polygon.outer).chain(&polygon.holes).map(|ring| closed(ring)).collect();
    format!("[{}]", rings.join(","))
}

/// A ring that ends where it began, as the format asks for.
fn closed(ring: &[Point2<f64>]) -> String {
    let places: Vec<String> = ring.iter().chain(ring.first()).map(place).collect();
    format!("[{}]", places.join(","))
}

fn place(point: &Point2<f64>) -> String {
    format!("[{:.3},{:.3}]", point.x, point.y)
}

/// A JSON string.
fn quoted(text: &str) -> String {
    let escape = |letter: char| match letter {
        '"' => "\\\"".to_owned(),
        '\\' => "\\\\".to_owned(),
        control if control < ' ' => format!("\\u{:04x}", u32::from(control)),
        other => other.to_string(),
    };
    format!("\"{}\"", text.chars().map(escape).collect::<String>())
}

/// Writes the labels as a PNG of 16-bit grey values, one pixel per cell, the highest row first, 0 = no region.
///
/// # Errors
///
/// What `out` gives back; a grid without cells cannot be a PNG.
pub fn write_labels(out: &mut impl Write, labels: &Grid<u16>) -> io::Result<()> {
    let columns = labels.frame().columns();
    let mut bytes = Vec::with_capacity(labels.cells().len() * 2);
    for row in labels.cells().chunks(columns.max(1)).rev() {
        bytes.extend(row.iter().flat_map(|label| label.to_be_bytes()));
    }
    write_png(out, labels.frame().rows(), columns, png::ColorType::Grayscale, png::BitDepth::Sixteen, &bytes)
}

/// Writes an image of any size that a PNG can have.
fn write_png(
    out: &mut impl Write,
    rows: usize,
    columns: usize,
    color: png::ColorType,
    depth: png::BitDepth,
    bytes: &[u8],
) -> io::Result<()> {
    let side = |cells: usize| {
        u32::try_from(cells).map_err(|_| io::Error::other(format!("{cells} pixels are too many for a PNG")))
    };
    let mut encoder = png::Encoder::new(out, side(columns)?, side(rows)?);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().map_err(of_png)?;
    writer.write_image_data(bytes).map_err(of_png)?;
    writer.finish().map_err(of_png)
}

fn of_png(error: png::EncodingError) -> io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        other => io::Error::other(other.to_string()),
    }
}

/// Writes one line per region and one per gateway, columns in line, for people.
///
/// # Errors
///
/// What `out` gives back.
pub fn write_table(out: &mut impl Write, map: &RegionMap) -> io::Result<()> {
    writeln!(out, "region  kind      area m2  length m  width m  exits  name")?;
    for region in &map.regions {
        let kind = if region.corridor > region.room { "corridor" } else { "room" };
        let exits = map.exits(region.label).count();
        writeln!(
            out,
            "{:>6}  {kind:<8}  {:>7.1}  {:>8.2}  {:>7.2}  {exits:>5}  {}",
            region.label,
            region.area,
            region.length,
            region.width,
            region.name.as_deref().unwrap_or("-"),
        )?;
    }
    writeln!(out, "\ngateway  regions      x m      y m  width m  confidence")?;
    for (index, gateway) in map.gateways.iter().enumerate() {
        let [from, to] = gateway.regions;
        let (center, pair) = (gateway.center, format!("{from}-{to}"));
        let closed = if gateway.blocked { "  closed" } else { "" };
        writeln!(
            out,
            "{index:>7}  {pair:>7}  {:>7.2}  {:>7.2}  {:>7.2}  {:>10.2}{closed}",
            center.x, center.y, gateway.width, gateway.confidence
        )?;
    }
    Ok(())
}

//! Draws worlds: plans, map_server maps, line maps, drawn floor plans, or random offices by their seed:
//! `cargo run -p simulator --example draw_world -- OUT.png WORLD.toml|MAP.yaml|LINES.map|IMAGE.png@RESOLUTION|SEED`. Says how much floor a robot can reach.

use std::path::Path;

use simulator::local_grid::GridFrame;
use simulator::{MapDescription, MapImage, OfficeStyle, Picture, World, random_office};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out, source] = arguments.as_slice() else { return Err("usage: draw_world OUT.png WORLD".into()) };
    let world = load(source)?;
    let (low, high) = world.bounds();
    let frame = GridFrame::covering(low, high, 0.1)?;
    let reachable = world.reachable(frame, 0.25);
    let cells = u32::try_from(reachable.cells().iter().filter(|cell| **cell).count())?;
    let size = high - low;
    eprintln!(
        "{}: {:.1} × {:.1} m, {} surfaces, {:.1} m² within reach",
        world.name(),
        size.x,
        size.y,
        world.walls().len(),
        f64::from(cells) * 0.01
    );
    let mut picture = Picture::of(&world, (1600.0 / size.max()).min(40.0));
    picture.cells(&frame, |row, column| reachable.get(row, column)?.then_some([225, 240, 225]));
    picture.scene(&world.at(0.0));
    for tour in world.tours() {
        tour.points.windows(2).for_each(|pair| picture.line(pair[0], pair[1], [0, 160, 0]));
    }
    picture.robot(&world.map_from_start(), 0.225, [220, 0, 0]);
    std::fs::write(out, picture.png())?;
    Ok(())
}

fn load(source: &str) -> Result<World, Box<dyn std::error::Error>> {
    if let Ok(seed) = source.parse() {
        return Ok(random_office(seed, &OfficeStyle::default()));
    }
    if let Some((image, resolution)) = source.split_once('@') {
        let pixels = MapImage::read(&std::fs::read(image)?)?;
        return Ok(World::from_map(image, &MapDescription::drawing(image, resolution.parse()?), &pixels)?);
    }
    let text = String::from_utf8_lossy(&std::fs::read(source)?).into_owned();
    if source.ends_with(".map") {
        return Ok(World::from_line_map(source, &text)?);
    }
    if source.ends_with(".toml") {
        return Ok(World::from_plan(&text)?);
    }
    let description = MapDescription::parse(&text)?;
    let image = Path::new(source).with_file_name(&description.image);
    let packed = format!("{}.gz", image.display());
    let bytes = if image.exists() { std::fs::read(image)? } else { std::fs::read(packed)? };
    Ok(World::from_map(source, &description, &MapImage::read(&bytes)?)?)
}

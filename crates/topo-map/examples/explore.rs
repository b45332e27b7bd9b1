//! Explores a simulated building to the end and prints what came of it:
//!
//! ```text
//! cargo run --release -p topo-map --example explore -- fixtures/worlds/office-loop.toml 1
//! ```
#![expect(clippy::print_stdout, reason = "an example that reports")]

#[path = "../tests/explore/host.rs"]
mod host;

use simulator::{RobotDescription, World};
use topo_map::{ExplorerOptions, LinkOrigin};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().unwrap_or_else(|| "fixtures/worlds/office-loop.toml".into());
    let seed = arguments.next().map_or(Ok(1), |seed| seed.parse())?;
    let world = World::from_plan(&std::fs::read_to_string(path)?)?;
    let host = host::Host::new(&world, RobotDescription::nomad200(), seed)?;
    let mut options = ExplorerOptions::default();
    let get = |k: &str| std::env::var(k).ok().and_then(|v| v.parse::<f64>().ok());
    if let Some(v) = get("TH") {
        options.peaks.threshold = v as f32;
    }
    if let Some(v) = get("SUP") {
        options.suppression = v;
    }
    if let Some(v) = get("SEP") {
        options.peaks.spread = v.to_radians();
    }
    if let Some(v) = get("LSEP") {
        options.link_separation = v.to_radians();
    }
    if let Some(v) = get("SP") {
        options.spacing = v;
    }
    if let Some(v) = get("MG") {
        options.obstacles.margin = v;
    }
    if let Some(v) = get("OC") {
        options.obstacles.occupied = v as f32;
    }
    let explored = host.explore(options, 100_000)?;
    println!("ended by itself: {} after {} commands", explored.ended, explored.commands);
    println!("places {}, predicted {}", explored.map.n_visited(), explored.map.n_predicted());
    println!(
        "links traveled {}, driven {:.0} m, bumps {}",
        explored.count(LinkOrigin::Traveled),
        explored.path_length,
        explored.bumps
    );
    println!("coverage {:.3}, duplicates {}", explored.coverage(&world, 1.0), explored.duplicates(0.5));
    println!("false recognitions {}, mean error {:.2} m", explored.false_recognitions, explored.mean_error());
    draw(&world, &explored)?;
    Ok(())
}

fn draw(world: &World, explored: &host::Explored) -> Result<(), Box<dyn std::error::Error>> {
    let mut picture = simulator::Picture::of(world, 20.0);
    picture.scene(&world.at(0.0));
    let truth = |place: topo_map::PlaceId| explored.truth.get(place.index()).copied().flatten();
    for link in explored.map.links() {
        if let (Some(a), Some(b)) = (truth(link.from), truth(link.to)) {
            let colour = if link.is_passable() { [0, 120, 0] } else { [255, 160, 0] };
            picture.line(a, b, colour);
        } else if let Some(a) = truth(link.from) {
            picture.line(a, a + link.displacement.vector, [255, 0, 0]);
        }
    }
    for at in explored.visited() {
        picture.dot(at, 0.1, [0, 0, 200]);
    }
    std::fs::write("/tmp/explored.png", picture.png())?;
    Ok(())
}

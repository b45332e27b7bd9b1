//! Explores a simulated building to the end, prints what came of it, and draws the map at the places' true positions:
//!
//! ```text
//! cargo run --release -p topo-map --example explore -- fixtures/worlds/office-loop.toml 1 explored.png
//! ```
#![expect(clippy::print_stdout, reason = "an example that reports")]

#[path = "../tests/explore/host.rs"]
mod host;

use simulator::{Picture, RobotDescription, World};
use topo_map::{ExplorerOptions, LinkOrigin, PlaceId};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().unwrap_or_else(|| "fixtures/worlds/office-loop.toml".into());
    let seed = arguments.next().map_or(Ok(1), |seed| seed.parse())?;
    let world = World::from_plan(&std::fs::read_to_string(path)?)?;
    let host = host::Host::new(&world, RobotDescription::nomad200(), seed)?;
    let explored = host.explore(ExplorerOptions::default(), 100_000)?;
    println!("ended by itself: {} after {} commands", explored.ended, explored.commands);
    println!("places {}, predicted {}", explored.map.n_visited(), explored.map.n_predicted());
    println!("changes of the map {}", explored.changes.len());
    println!(
        "links traveled {}, driven {:.0} m, stopped short {} times",
        explored.count(LinkOrigin::Traveled),
        explored.path_length,
        explored.bumps
    );
    println!("coverage {:.3}, duplicates {}", explored.coverage(&world, 1.0), explored.duplicates(0.35));
    println!("false recognitions {}, mean error {:.2} m", explored.false_recognitions, explored.mean_error());
    if let Some(picture) = arguments.next() {
        std::fs::write(picture, draw(&world, &explored).png())?;
    }
    Ok(())
}

/// Traveled links green, others orange, what was refuted red, visited places blue.
fn draw(world: &World, explored: &host::Explored) -> Picture {
    let mut picture = Picture::of(world, 20.0);
    picture.scene(&world.at(0.0));
    let truth = |place: PlaceId| explored.truth.get(place.index()).copied().flatten();
    for link in explored.map.links() {
        match (truth(link.from), truth(link.to)) {
            (Some(from), Some(to)) if link.is_passable() => picture.line(from, to, [0, 120, 0]),
            (Some(from), Some(to)) => picture.line(from, to, [255, 160, 0]),
            (Some(from), None) => picture.line(from, from + link.displacement.vector, [255, 0, 0]),
            (None, _) => {}
        }
    }
    for at in explored.visited() {
        picture.dot(at, 0.1, [0, 0, 200]);
    }
    picture
}

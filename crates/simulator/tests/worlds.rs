//! The shipped worlds can be read, driven in and explored.

use simulator::local_grid::GridFrame;
use simulator::nalgebra::Point2;
use simulator::{Ground, World};

use crate::recipe::fixtures;

fn load(name: &str) -> World {
    World::from_plan(&std::fs::read_to_string(fixtures().join("worlds").join(name)).unwrap()).unwrap()
}

/// Square metres where the centre of a Nomad can get.
fn within_reach(world: &World) -> f64 {
    let (low, high) = world.bounds();
    let reachable = world.reachable(GridFrame::covering(low, high, 0.1).unwrap(), 0.245);
    f64::from(u32::try_from(reachable.cells().iter().filter(|cell| **cell).count()).unwrap()) * 0.01
}

#[test]
fn every_shipped_world_has_floor_to_explore_and_room_at_the_start() {
    let mut count = 0;
    for entry in std::fs::read_dir(fixtures().join("worlds")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let world = load(&name);
        let start = Point2::from(world.map_from_start().translation.vector);
        assert!(world.at(0.0).clearance(start, 1.0) > 0.3, "{name}");
        assert!(within_reach(&world) > 50.0, "{name}");
        for tour in world.tours() {
            // Nothing in the building is in the way of a tour; what moves may be.
            let still = world.clone().with_movers(vec![]);
            for pair in tour.points.windows(2) {
                assert!(still.at(0.0).is_swept_free(pair[0], pair[1], 0.245), "{name}, {}: {pair:?}", tour.name);
            }
        }
        count += 1;
    }
    assert!(count >= 4);
}

#[test]
fn the_office_has_the_size_of_the_papers_and_fits_its_grid() {
    let world = load("office-46x12.toml");
    let (low, high) = world.bounds();
    let size = high - low;
    // The paper's grid has 450 × 350 cells of 0.10 m: a building of 46 × 12 m, turned by 33°.
    assert!((size.x - 45.0).abs() < 0.3 && (size.y - 35.0).abs() < 0.3, "{size}");
    let area = within_reach(&world);
    assert!((120.0..160.0).contains(&area), "{area} m² for about 137 places a metre apart");
    let ground = world.ground(GridFrame::covering(low, high, 0.1).unwrap());
    let share = |wanted| ground.cells().iter().filter(|cell| **cell == wanted).count();
    assert!(share(Ground::Open) > 14_000 && share(Ground::Surface) > 2_000 && share(Ground::Hidden) > 100_000);
}

//! Exploration of simulated buildings, from the first place to the end.

mod host;

use host::{Explored, Host};
use simulator::{RobotDescription, World};
use topo_map::local_grid::nalgebra::{Isometry2, Point2};
use topo_map::{
    Change, Command, ExploreError, Explorer, ExplorerOptions, LinkOrigin, LinkState, Observation, PlaceState, TopoMap,
};

/// A rectangular room with walls at `±half`, askew to the map's axes, and whatever else is drawn.
fn room(half: (f64, f64), more: &str) -> World {
    let (x, y) = half;
    let plan = format!(
        "name = 'room'\nrotation_deg = 12.0\n\
         [[wall]]\npoints = [[-{x}, -{y}], [{x}, -{y}], [{x}, {y}], [-{x}, {y}]]\nclosed = true\n{more}"
    );
    World::from_plan(&plan).unwrap()
}

fn explored(world: &World, seed: u64) -> Explored {
    let robot = RobotDescription::nomad200();
    Host::new(world, robot, seed).unwrap().explore(ExplorerOptions::default(), 20_000).unwrap()
}

#[test]
fn an_empty_room_is_covered_and_the_exploration_ends() {
    let world = room((3.0, 3.0), "");
    let explored = explored(&world, 1);
    assert!(explored.ended);
    assert_eq!(explored.map.n_predicted(), 0);
    let places = explored.map.n_visited();
    // 30 m² of floor, places 1 m apart.
    assert!((16..=40).contains(&places), "{places} places in 30 m² of floor");
    assert!(explored.duplicates(0.3) * 10 <= places, "{} duplicates", explored.duplicates(0.3));
    assert!(explored.count(LinkOrigin::Traveled) + 1 >= places, "every place was reached over a link");
    assert!(explored.commands < 5_000 && explored.path_length < 400.0, "{} m", explored.path_length);
    assert!(explored.bumps <= 20, "stopped short {} times", explored.bumps);
    assert!(explored.false_recognitions <= 2, "{} false recognitions", explored.false_recognitions);
    assert!(explored.coverage(&world, 1.0) > 0.95);
    assert!(explored.mean_error() < 0.5, "{}", explored.mean_error());
    let unresolved = explored
        .map
        .links()
        .iter()
        .filter(|link| link.origin == LinkOrigin::Predicted && link.state == LinkState::Open);
    assert_eq!(unresolved.count(), 0);
    assert_eq!(explored.map.components().len(), 1);
}

#[test]
fn nothing_is_found_behind_a_closed_door() {
    // A corridor with a closed door at x = 0, and a room behind it.
    let world = World::from_plan(
        "name = 'corridor'\nrotation_deg = 33.0\nstart = [-3.0, 0.0, 0.0]\n\
         [[wall]]\npoints = [[-5, -1], [5, -1], [5, 1], [-5, 1]]\nclosed = true\n\
         [[wall]]\npoints = [[0, -1], [0, 1]]\n",
    )
    .unwrap();
    let explored = explored(&world, 2);
    assert!(explored.ended);
    assert!((3..=12).contains(&explored.map.n_visited()), "{}", explored.map.n_visited());
    let behind = explored.visited().filter(|at| (world.map_from_plan().inverse() * at).x > 0.0);
    assert_eq!(behind.count(), 0);
    assert!(explored.coverage(&world, 1.0) > 0.95);
}

#[test]
fn an_open_door_is_gone_through() {
    let world = World::from_plan(
        "name = 'two rooms'\nrotation_deg = 33.0\nstart = [-2.0, 0.0, 0.0]\n\
         [[wall]]\npoints = [[-4, -2], [4, -2], [4, 2], [-4, 2]]\nclosed = true\n\
         [[wall]]\npoints = [[0, -2], [0, -0.5]]\n[[wall]]\npoints = [[0, 0.5], [0, 2]]\n",
    )
    .unwrap();
    let explored = explored(&world, 3);
    assert!(explored.ended);
    assert!(explored.coverage(&world, 1.0) > 0.95, "{}", explored.coverage(&world, 1.0));
}

#[test]
fn refuted_places_stay_refuted_and_every_change_is_told() {
    let world = room((2.5, 2.0), "[[wall]]\npoints = [[0.8, -2], [0.8, 1.0]]\n");
    let explored = explored(&world, 4);
    for change in &explored.changes {
        match change {
            Change::PlaceRefuted(place) => {
                assert!(matches!(explored.map.place(*place).unwrap().state, PlaceState::Refuted));
            }
            Change::PlaceVisited(place) => assert!(explored.map.place(*place).unwrap().is_visited()),
            _ => {}
        }
    }
    let visited = explored.changes.iter().filter(|change| matches!(change, Change::PlaceVisited(_))).count();
    assert_eq!(visited, explored.map.n_visited());
}

#[test]
fn the_same_seed_explores_the_same() {
    let world = room((2.0, 1.5), "");
    let (one, two) = (explored(&world, 5), explored(&world, 5));
    assert_eq!(one.map, two.map);
    assert_eq!(one.changes, two.changes);
}

#[test]
fn most_places_end_it_too_and_wrong_input_is_refused() {
    let world = room((3.0, 3.0), "");
    let options = ExplorerOptions { max_places: 5, ..ExplorerOptions::default() };
    let few = Host::new(&world, RobotDescription::nomad200(), 1).unwrap().explore(options, 20_000).unwrap();
    assert!(few.ended);
    assert_eq!(few.map.n_visited(), 5);

    let wrong = ExplorerOptions { stride: 0.0, ..ExplorerOptions::default() };
    assert!(matches!(Explorer::new(wrong), Err(ExploreError::Option { name: "stride", .. })));
    let mut explorer = Explorer::new(ExplorerOptions::default()).unwrap();
    let mut map = TopoMap::<()>::new();
    let nowhere = |_| None::<Point2<f64>>;
    let lost = Observation::at(Isometry2::translation(f64::NAN, 0.0), &nowhere);
    assert_eq!(explorer.observe(&mut map, lost), Err(ExploreError::Pose));
    let first = explorer.observe(&mut map, Observation::at(Isometry2::identity(), &nowhere)).unwrap();
    assert!(matches!(first, Command::Look { .. }));
}

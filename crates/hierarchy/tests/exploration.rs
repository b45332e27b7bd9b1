//! Exploration of simulated buildings by all levels together, from the first place to the end.

use hierarchy::evaluate::TimedPath;
use hierarchy::topo_map::{Change, ExplorerOptions, LinkOrigin, LinkState, PlaceState};
use hierarchy::{Config, Ended, Errand, Exploration};
use nalgebra::Point2;
use robot_log::{Entry, EntryKind};
use simulator::{Command, Robot, RobotDescription, World};

/// How an exploration went.
struct Explored {
    exploration: Exploration,
    changes: Vec<Change>,
    /// Where each place really is, by its index.
    truth: Vec<Option<Point2<f64>>>,
    bumps: usize,
    path_length: f64,
}

/// Lets a Nomad 200 explore until it is done.
fn explored(world: &World, seed: u64, options: ExplorerOptions) -> Explored {
    let mut exploration = Exploration::new(Config::default(), options).unwrap();
    let mut robot = Robot::new(world, RobotDescription::nomad200(), seed).unwrap();
    let (mut entries, mut changes, mut ended) = (Vec::<Entry>::new(), Vec::new(), Ended::Well);
    for _ in 0..20_000 {
        let errand = exploration.next(ended).unwrap();
        changes.extend(exploration.take_changes());
        let command = match errand {
            Errand::Turn { to } => Command::Turn { to },
            Errand::Drive { distance } => Command::Drive { distance },
            Errand::Look { to } => Command::Look { to },
            Errand::Fire => Command::Fire,
            Errand::Done => {
                let truth = truth(&exploration, &entries);
                let (bumps, path_length) = (robot.bumps(), robot.path_length());
                return Explored { exploration, changes, truth, bumps, path_length };
            }
        };
        let before = entries.len();
        let outcome = robot.execute(&command, &mut entries);
        entries[before..].iter().for_each(|entry| exploration.push(entry).unwrap());
        ended = if outcome.blocked { Ended::Blocked } else { Ended::Well };
    }
    panic!("the exploration never ends");
}

/// Where each place is by the truth of its first visit.
fn truth(exploration: &Exploration, entries: &[Entry]) -> Vec<Option<Point2<f64>>> {
    let poses = entries.iter().filter_map(|entry| match &entry.kind {
        EntryKind::Truth { map_from_robot } => Some((entry.stamp, *map_from_robot)),
        _ => None,
    });
    let path = TimedPath::new(poses.collect::<Vec<_>>());
    let mut found = vec![None; exploration.mapper().topology().places().len()];
    for anchor in exploration.mapper().trajectory().anchors() {
        let center = || Some(path.at(anchor.stamp)?.translation.vector - anchor.place_from_robot.translation.vector);
        let spot = &mut found[anchor.place.index()];
        *spot = spot.or_else(|| center().map(Point2::from));
    }
    found
}

impl Explored {
    fn visited(&self) -> Vec<Point2<f64>> {
        let places = self.exploration.mapper().topology().places().iter();
        places.filter(|place| place.is_visited()).filter_map(|place| self.truth[place.id.index()]).collect()
    }

    fn coverage(&self, world: &World) -> f64 {
        world.coverage(&self.visited(), 0.225 + 0.05, 1.0)
    }

    /// Visited places that lie within `radius` of an earlier one.
    fn duplicates(&self, radius: f64) -> usize {
        let all = self.visited();
        (0..all.len()).filter(|&k| all[..k].iter().any(|before| (before - all[k]).norm() < radius)).count()
    }

    /// Mean distance of the places from the truth in metres, after moving the map as a whole so that it fits best.
    fn mean_error(&self) -> f64 {
        let mapper = self.exploration.mapper();
        let places = mapper.topology().places().iter().filter(|place| place.is_visited());
        let error = |place: &hierarchy::topo_map::Place<_>| {
            Some(
                self.truth[place.id.index()]?
                    - Point2::from(mapper.coordinates().map_from_place(place.id).translation.vector),
            )
        };
        let errors: Vec<_> = places.filter_map(error).collect();
        let mean = errors.iter().sum::<nalgebra::Vector2<f64>>() / errors.len() as f64;
        errors.iter().map(|error| (error - mean).norm()).sum::<f64>() / errors.len() as f64
    }

    /// Measured links that are wrong by more than a metre.
    fn false_links(&self) -> usize {
        let links = self.exploration.mapper().topology().links().iter().filter(|link| link.is_measured());
        let wrong = links.filter(|link| {
            let ends = self.truth[link.from.index()].zip(self.truth[link.to.index()]);
            ends.is_some_and(|(from, to)| (link.displacement.vector - (to - from)).norm() > 1.0)
        });
        wrong.count()
    }
}

/// A rectangular room with walls at `±half`, askew to the map's axes, and whatever else is drawn.
fn room(half: (f64, f64), more: &str) -> World {
    let (x, y) = half;
    let plan = format!(
        "name = 'room'\nrotation_deg = 12.0\n\
         [[wall]]\npoints = [[-{x}, -{y}], [{x}, -{y}], [{x}, {y}], [-{x}, {y}]]\nclosed = true\n{more}"
    );
    World::from_plan(&plan).unwrap()
}

#[test]
fn a_door_that_no_look_went_through_is_found_on_the_gridmap() {
    // Where the robot stands beside the door, its frame echoes into every direction that it looks into.
    let plan = "name = 'two rooms'\nrotation_deg = 20\nstart = [1.5, 2, 0]\n\
                [[wall]]\npoints = [[0, 0], [9, 0], [9, 4], [0, 4]]\nclosed = true\n\
                [[wall]]\npoints = [[4, 0], [4, 4]]\n[[door]]\nfrom = [4, 2.6]\nto = [4, 3.5]\n";
    let world = World::from_plan(plan).unwrap();
    for seed in [2, 4, 5] {
        let explored = explored(&world, seed, ExplorerOptions::default());
        assert!(explored.coverage(&world) > 0.95, "seed {seed}: {}", explored.coverage(&world));
    }
}

#[test]
fn an_empty_room_is_covered_and_the_exploration_ends() {
    for seed in 1..=3 {
        let world = room((3.0, 3.0), "");
        let explored = explored(&world, seed, ExplorerOptions::default());
        let map = explored.exploration.mapper().topology();
        assert_eq!(map.n_predicted(), 0);
        let places = map.n_visited();
        // 30 m² of floor, places 1 m apart; more where a new place was taken for none of the old ones.
        assert!((16..=48).contains(&places), "seed {seed}: {places} places in 30 m² of floor");
        assert!(explored.duplicates(0.3) * 10 <= places, "seed {seed}: {} duplicates", explored.duplicates(0.3));
        assert!(explored.path_length < 400.0, "seed {seed}: {} m", explored.path_length);
        assert!(explored.bumps <= 20, "seed {seed}: stopped short {} times", explored.bumps);
        assert_eq!(explored.false_links(), 0, "seed {seed}");
        assert!(explored.mean_error() < 0.5, "seed {seed}: {} m", explored.mean_error());
        let driven = map.links().iter().filter(|link| link.origin == LinkOrigin::Traveled && link.is_passable());
        assert!(driven.count() + 1 >= places, "seed {seed}: every place was reached over a link");
        assert!(explored.coverage(&world) > 0.95, "seed {seed}");
        let predicted = |link: &&hierarchy::topo_map::Link| link.origin == LinkOrigin::Predicted;
        assert_eq!(map.links().iter().filter(predicted).filter(|link| link.state == LinkState::Open).count(), 0);
        assert_eq!(map.components().len(), 1);
    }
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
    let explored = explored(&world, 2, ExplorerOptions::default());
    let visited = explored.visited();
    assert!((3..=12).contains(&visited.len()), "{}", visited.len());
    assert!(visited.iter().all(|at| (world.map_from_plan().inverse() * at).x < 0.0));
    assert!(explored.coverage(&world) > 0.95);
}

/// Two rooms of 4 × 4 m, with a door of 1 m between them.
fn two_rooms() -> World {
    World::from_plan(
        "name = 'two rooms'\nrotation_deg = 33.0\nstart = [-2.0, 0.0, 0.0]\n\
         [[wall]]\npoints = [[-4, -2], [4, -2], [4, 2], [-4, 2]]\nclosed = true\n\
         [[wall]]\npoints = [[0, -2], [0, -0.5]]\n[[wall]]\npoints = [[0, 0.5], [0, 2]]\n",
    )
    .unwrap()
}

#[test]
fn an_open_door_is_gone_through() {
    // Some take the door, hidden behind the echoes of its posts, for a wall at first; the gridmap tells them better.
    let world = two_rooms();
    let explored: Vec<_> = (1..=8).map(|seed| explored(&world, seed, ExplorerOptions::default())).collect();
    for (explored, seed) in explored.iter().zip(1..) {
        assert!(explored.coverage(&world) > 0.95, "seed {seed}: {}", explored.coverage(&world));
    }
    // One survey a place, of three firings of sixteen sonars: those of places that are no more do not count.
    for Explored { exploration, .. } in &explored {
        let mapper = exploration.mapper();
        let readings = |scan: &usize| mapper.trajectory().samples()[*scan].scan.readings().len();
        let surveyed: usize = exploration.descriptions().iter().map(readings).sum();
        assert_eq!(surveyed, 48 * mapper.topology().n_visited());
    }
}

#[test]
fn refuted_places_stay_refuted_and_every_change_is_told() {
    let world = room((2.5, 2.0), "[[wall]]\npoints = [[0.8, -2], [0.8, 1.0]]\n");
    let explored = explored(&world, 4, ExplorerOptions::default());
    let map = explored.exploration.mapper().topology();
    let (mut visited, mut merged) = (0, 0);
    for change in &explored.changes {
        match change {
            Change::PlaceRefuted(place) => {
                assert!(matches!(map.place(*place).unwrap().state, PlaceState::Refuted));
            }
            Change::PlaceVisited(place) => {
                visited += 1;
                merged += usize::from(matches!(map.place(*place).unwrap().state, PlaceState::Merged { .. }));
            }
            _ => {}
        }
    }
    assert_eq!(visited - merged, map.n_visited());
}

#[test]
fn the_same_seed_explores_the_same_and_most_places_end_it_too() {
    let world = room((2.0, 1.5), "");
    let [one, two] = [5, 5].map(|seed| explored(&world, seed, ExplorerOptions::default()));
    assert_eq!(one.changes, two.changes);
    assert_eq!(one.exploration.mapper().topology().links(), two.exploration.mapper().topology().links());

    let few = explored(&world, 1, ExplorerOptions { max_places: 3, ..ExplorerOptions::default() });
    assert_eq!(few.exploration.mapper().topology().n_visited(), 3);
}

//! Ways through regions, and names that outlive a map.

use approx::assert_abs_diff_eq;
use region_map::nalgebra::{Isometry2, Point2};
use region_map::{NoSuchRegion, Options, carry_names, lay_over, local_grid::Grid, segment};

use crate::plans::{corridor_with_rooms, draw, two_rooms};

/// A ring of four rooms of 4 × 4 m, each with doors to the next.
fn ring() -> Grid<f32> {
    let mut boxes = Vec::new();
    for (x, y) in [(0.0, 0.0), (4.2, 0.0), (4.2, 4.2), (0.0, 4.2)] {
        boxes.push(([x, y], [x + 4.0, y + 4.0]));
    }
    for (x, y) in [(4.0, 1.0), (4.0, 6.2)] {
        boxes.push(([x, y], [x + 0.2, y + 0.9]));
        boxes.push(([y, x], [y + 0.9, x + 0.2]));
    }
    draw(&boxes, 0.05, 0.0)
}

#[test]
fn a_route_takes_the_shorter_way_round_and_another_if_a_door_is_closed() {
    let map = segment(&ring(), &Options::default()).unwrap();
    assert_eq!((map.regions.len(), map.gateways.len()), (4, 4));
    let (from, to) = (Point2::new(1.0, 1.0), Point2::new(7.0, 1.0));
    let route = map.route(from, to, |_| true).unwrap();
    assert_eq!(route.regions.len(), 2);
    assert_abs_diff_eq!(route.length, 6.04, epsilon = 0.15);
    let door = route.gateways[0];
    assert_abs_diff_eq!(map.gateways[door].center.x, 4.1, epsilon = 0.2);

    let closed = map.gateways[door].center;
    let round = map.route(from, to, |gateway| gateway.center != closed).unwrap();
    assert_eq!(round.regions.len(), 4);
    assert_eq!(round.gateways.len(), 3);
    assert!(!round.gateways.contains(&door));
    assert!(round.length > 12.0);

    assert!(map.route(from, to, |_| false).is_none());
    assert!(map.route(from, Point2::new(-3.0, 0.0), |_| true).is_none());
    let here = map.route(from, Point2::new(1.0, 3.0), |_| false).unwrap();
    assert_eq!((here.regions.len(), here.gateways.len()), (1, 0));
    assert_abs_diff_eq!(here.length, 2.0);
}

#[test]
fn exits_lead_to_the_neighbours() {
    let map = segment(&draw(&two_rooms(0.9), 0.05, 0.0), &Options::default()).unwrap();
    assert_eq!(map.exits(1).collect::<Vec<_>>(), [(0, 2)]);
    assert_eq!(map.exits(2).collect::<Vec<_>>(), [(0, 1)]);
    assert_eq!(map.exits(3).count(), 0);
}

#[test]
fn names_survive_a_new_map_of_another_resolution() {
    let mut old = segment(&draw(&corridor_with_rooms(), 0.05, 0.0), &Options::default()).unwrap();
    for label in 1..=7 {
        old.name(label, format!("room {label}")).unwrap();
    }
    let mut new = segment(&draw(&corridor_with_rooms(), 0.1, 0.0), &Options::default()).unwrap();
    assert_eq!(carry_names(&old, &mut new, &Isometry2::identity()), Vec::<String>::new());
    for region in &old.regions {
        let there = new.region_at(region.inside).unwrap();
        assert_eq!(there.name, region.name);
    }
    assert_eq!(new.find("ROOM 3").unwrap().name.as_deref(), Some("room 3"));
}

#[test]
fn a_name_whose_room_is_gone_is_reported_and_a_new_name_stays() {
    let mut old = segment(&draw(&two_rooms(0.9), 0.05, 0.0), &Options::default()).unwrap();
    let left = old.region_at(Point2::new(1.0, 1.0)).unwrap().label;
    let right = old.region_at(Point2::new(7.0, 1.0)).unwrap().label;
    old.name(left, "kitchen").unwrap();
    old.name(right, "store").unwrap();
    let mut new = segment(&draw(&two_rooms(0.9)[..1], 0.05, 0.0), &Options::default()).unwrap();
    assert_eq!(carry_names(&old, &mut new, &Isometry2::identity()), ["store"]);
    assert_eq!(new.regions[0].name.as_deref(), Some("kitchen"));
    new.name(1, "galley").unwrap();
    assert_eq!(carry_names(&old, &mut new, &Isometry2::identity()), ["kitchen", "store"]);
    assert_eq!(new.regions[0].name.as_deref(), Some("galley"));
    assert_eq!(new.name(9, "hall"), Err(NoSuchRegion { label: 9, count: 1 }));
}

/// A corridor of 14 m with three rooms of different widths on one side and one on the other.
fn unlike_rooms() -> Vec<([f64; 2], [f64; 2])> {
    let rooms = [(0.0, 3.0), (3.2, 8.6), (8.8, 13.0)];
    let mut boxes = vec![([0.0, 0.0], [14.0, 1.8]), ([9.0, -4.2], [14.0, -0.2]), ([10.0, -0.2], [10.9, 0.0])];
    for (from, to) in rooms {
        boxes.extend([([from, 2.0], [to, 6.0]), ([from + 1.0, 1.8], [from + 1.9, 2.0])]);
    }
    boxes
}

#[test]
fn names_survive_a_map_with_another_north_and_another_origin() {
    let mut old = segment(&draw(&unlike_rooms(), 0.05, 0.0), &Options::default()).unwrap();
    assert_eq!(old.regions.len(), 5);
    for label in 1..=5 {
        old.name(label, format!("room {label}")).unwrap();
    }
    for turn in [0.0, 0.1, 0.7, 2.5] {
        let mut new = segment(&draw(&unlike_rooms(), 0.1, turn), &Options::default()).unwrap();
        let old_from_new = lay_over(&old, &new).unwrap();
        assert_abs_diff_eq!(old_from_new.rotation.angle(), -turn, epsilon = 0.02);
        assert_eq!(carry_names(&old, &mut new, &old_from_new), Vec::<String>::new(), "turned by {turn}");
        for region in &new.regions {
            assert_eq!(old.region_at(old_from_new * region.inside).unwrap().name, region.name);
        }
    }
}

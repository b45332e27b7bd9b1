use local_grid::{Grid, GridFrame};
use nalgebra::{Isometry2, Point2, Vector2};
use region_map::{Options, RegionMap, segment};
use topo_map::PlaceId;

use super::{FloorPlan, Passage};

/// A kitchen of 3 × 4 m and a hall of 7 × 4 m with an opening between them, drawn where `map_from_house` puts them.
fn house(opening: f64, map_from_house: &Isometry2<f64>, resolution: f64) -> RegionMap {
    let low = Point2::new(-12.0, -12.0);
    let frame = GridFrame::covering(low, Point2::new(16.0, 16.0), resolution).unwrap();
    let mut free = Grid::<f32>::new(frame);
    for row in 0..frame.rows() {
        for column in 0..frame.columns() {
            let p = map_from_house.inverse_transform_point(&frame.center(row, column));
            let inside = (0.0..10.2).contains(&p.x) && (0.0..4.0).contains(&p.y);
            let wall = (3.0..3.2).contains(&p.x) && (p.y - 2.0).abs() > opening / 2.0;
            free.cells_mut()[row * frame.columns() + column] = f32::from(u8::from(inside && !wall));
        }
    }
    segment(&free, &Options::default()).unwrap()
}

/// Two places in the kitchen and three in the hall.
fn places(map_from_house: &Isometry2<f64>) -> Vec<(PlaceId, Isometry2<f64>)> {
    let spots = [[1.0, 1.0], [1.5, 2.0], [4.5, 2.0], [6.0, 1.5], [8.0, 3.0]];
    let pose = |[x, y]: [f64; 2]| map_from_house * Isometry2::new(Vector2::new(x, y), 0.3);
    (0..).map(PlaceId).zip(spots.map(pose)).collect()
}

fn name_at(map: &RegionMap, map_from_house: &Isometry2<f64>, x: f64, y: f64) -> Option<String> {
    map.region_at(map_from_house * Point2::new(x, y)).and_then(|region| region.name.clone())
}

/// The plan of the house with both names and a closed door.
fn furnished() -> FloorPlan {
    let mut map = house(0.9, &Isometry2::identity(), 0.1);
    for (spot, name) in [(1.0, "kitchen"), (6.0, "hall")] {
        let label = map.region_at(Point2::new(spot, 1.0)).unwrap().label;
        map.name(label, name).unwrap();
    }
    let mut plan = FloorPlan::of(&map, &places(&Isometry2::identity()));
    plan.set_passage(&mut map, 0, Passage::Closed);
    assert!(map.gateways[0].blocked);
    plan
}

#[test]
fn names_and_closed_doors_move_with_the_places() {
    let moved = Isometry2::new(Vector2::new(2.0, -5.0), 33_f64.to_radians());
    for resolution in [0.05, 0.1, 0.2] {
        let (mut plan, mut map) = (furnished(), house(0.9, &moved, resolution));
        plan.renew(&mut map, &places(&moved));
        assert_eq!(name_at(&map, &moved, 1.0, 1.0).as_deref(), Some("kitchen"), "at {resolution} m");
        assert_eq!(name_at(&map, &moved, 6.0, 1.0).as_deref(), Some("hall"), "at {resolution} m");
        assert_eq!(map.gateways.iter().filter(|gateway| gateway.blocked).count(), 1);
        assert_eq!(plan.gateways[0].passage, Passage::Closed);
        assert_eq!(plan.lost_names().count(), 0);
    }
}

#[test]
fn a_name_that_finds_no_room_waits_for_one() {
    let here = Isometry2::identity();
    let mut plan = furnished();
    let mut open = house(3.8, &here, 0.1); // hardly a wall is left: one region
    assert_eq!(open.regions.len(), 1);
    plan.renew(&mut open, &places(&here));
    assert_eq!(open.regions[0].name.as_deref(), Some("hall"), "what is swallowed does not name what swallows it");
    assert_eq!(plan.lost_names().collect::<Vec<_>>(), ["kitchen"]);
    let mut again = house(0.9, &here, 0.1);
    plan.renew(&mut again, &places(&here));
    assert_eq!(name_at(&again, &here, 1.0, 1.0).as_deref(), Some("kitchen"));
    assert!(again.gateways[0].blocked, "the door is closed until somebody opens it");
    assert_eq!(plan.lost_names().count(), 0);
}

#[test]
fn a_map_without_places_remembers_nothing() {
    let mut map = house(0.9, &Isometry2::identity(), 0.1);
    let mut plan = FloorPlan::default();
    plan.renew(&mut map, &[]);
    assert!(plan.regions.iter().all(|region| region.floor.is_empty()));
    assert!(plan.gateways.is_empty());
}

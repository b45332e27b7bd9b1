//! The graph: what it keeps, fuses, bends and refuses.

use std::f64::consts::FRAC_PI_2;

use local_grid::Heading;
use local_grid::nalgebra::{Matrix2, Vector2};
use topo_map::{Displacement, LinkId, LinkOrigin, LinkState, MapError, PlaceId, PlaceState, TopoMap, Turn};

fn east(distance: f64) -> Displacement {
    Displacement::isotropic(Vector2::new(distance, 0.0), 0.01)
}

fn north(distance: f64) -> Displacement {
    Displacement::isotropic(Vector2::new(0.0, distance), 0.01)
}

/// Four places at the corners of a square of 1 m, linked around but for the last side, numbered counter-clockwise.
fn open_square() -> TopoMap<()> {
    let mut map = TopoMap::new();
    let places: Vec<PlaceId> = (0..4).map(|_| map.add_place(()).unwrap()).collect();
    map.travel(places[0], places[1], east(1.0)).unwrap();
    map.travel(places[1], places[2], north(1.0)).unwrap();
    map.travel(places[2], places[3], east(-1.0)).unwrap();
    map
}

#[test]
fn traversals_in_both_directions_are_fused_with_the_sign_flipped() {
    let mut map = open_square();
    let link = map.travel(PlaceId(1), PlaceId(0), east(-1.2)).unwrap();
    assert_eq!(link, LinkId(0));
    let fused = map.link(link).unwrap();
    assert_eq!(fused.traversals, 2);
    approx::assert_relative_eq!(fused.distance(), 1.1, epsilon = 1e-12);
    approx::assert_relative_eq!(fused.displacement.covariance[(1, 1)], 0.005, epsilon = 1e-12);
    assert_eq!(fused.heading(), Heading::from_radians(0.0));
}

#[test]
fn a_predicted_place_is_reached_or_refuted() {
    let mut map = open_square();
    let (beyond, way) = map.predict_place(PlaceId(3), north(1.0), 0.8).unwrap();
    let (behind, wall) = map.predict_place(PlaceId(0), north(-1.0), 0.6).unwrap();
    assert_eq!((map.n_visited(), map.n_predicted()), (4, 2));
    assert_eq!(map.route(PlaceId(0), beyond), None, "nobody has gone there yet");
    map.verify(beyond, ()).unwrap();
    assert_eq!(map.travel(beyond, PlaceId(3), north(-0.9)).unwrap(), way);
    let gone = map.link(way).unwrap();
    assert_eq!((gone.origin, gone.from, gone.distance()), (LinkOrigin::Traveled, PlaceId(3), 0.9));
    map.refute(behind).unwrap();
    assert_eq!(map.link(wall).unwrap().state, LinkState::Blocked);
    assert_eq!((map.n_visited(), map.n_predicted()), (5, 0));
    assert_eq!(map.refute(behind), Err(MapError::NotPredicted(behind)));
    assert_eq!(map.add_link(PlaceId(0), behind, east(1.0), LinkOrigin::Predicted), Err(MapError::Gone(behind)));
}

#[test]
fn a_route_is_the_shortest_over_passable_links() {
    let mut map = open_square();
    let around = map.route(PlaceId(0), PlaceId(3)).unwrap();
    assert_eq!(around.places, [0, 1, 2, 3].map(PlaceId));
    assert_eq!(around.links, [0, 1, 2].map(LinkId));
    approx::assert_relative_eq!(around.cost, 3.0);
    let shortcut = map.recognize(PlaceId(0), PlaceId(3), north(1.0)).unwrap();
    assert_eq!(map.route(PlaceId(0), PlaceId(3)).unwrap().links, [shortcut]);
    map.set_link_state(shortcut, LinkState::Blocked).unwrap();
    assert_eq!(map.route(PlaceId(0), PlaceId(3)).unwrap(), around);
    map.set_link_state(LinkId(1), LinkState::Blocked).unwrap();
    assert_eq!(map.route(PlaceId(0), PlaceId(3)), None);
    assert_eq!(map.route(PlaceId(0), PlaceId(9)), None);
}

#[test]
fn a_caller_may_price_links_as_it_likes() {
    let mut map = open_square();
    map.recognize(PlaceId(0), PlaceId(3), north(1.0)).unwrap();
    let avoid_shortcut = |link: &topo_map::Link| if link.origin == LinkOrigin::Recognized { 10.0 } else { 1.0 };
    let route = map.nearest(PlaceId(0), avoid_shortcut, |place| place == PlaceId(3)).unwrap();
    approx::assert_relative_eq!(route.cost, 3.0);
    let never = map.nearest(PlaceId(0), |_| f64::NAN, |place| place == PlaceId(3));
    assert_eq!(never, None);
}

#[test]
fn bridges_are_the_links_that_nothing_checks() {
    let mut map = open_square();
    assert_eq!(map.bridges(), [0, 1, 2].map(LinkId));
    let second = map.recognize(PlaceId(1), PlaceId(0), east(-1.0)).unwrap();
    assert_eq!(map.bridges(), [1, 2].map(LinkId), "two parallel links check each other");
    map.set_link_state(second, LinkState::Rejected).unwrap();
    assert_eq!(map.bridges(), [0, 1, 2].map(LinkId));
    map.recognize(PlaceId(3), PlaceId(0), north(-1.0)).unwrap();
    assert_eq!(map.bridges(), []);
}

#[test]
fn a_long_chain_overflows_no_stack() {
    let mut map = TopoMap::new();
    let mut last = map.add_place(()).unwrap();
    for _ in 0..100_000 {
        let next = map.add_place(()).unwrap();
        map.travel(last, next, east(1.0)).unwrap();
        last = next;
    }
    assert_eq!(map.bridges().len(), 100_000);
    assert_eq!(map.components().len(), 1);
    approx::assert_relative_eq!(map.route(PlaceId(0), last).unwrap().cost, 1e5);
}

#[test]
fn components_are_held_together_by_measured_links_only() {
    let mut map = open_square();
    let far = map.add_place(()).unwrap();
    map.predict_place(far, east(1.0), 0.5).unwrap();
    map.add_link(PlaceId(2), far, east(1.0), LinkOrigin::Predicted).unwrap();
    assert_eq!(map.components(), [[0, 1, 2, 3].map(PlaceId).to_vec(), vec![far]]);
}

#[test]
fn merging_bends_the_links_to_the_kept_centre() {
    let mut map = open_square();
    // A fifth place after the fourth turns out to be the first, 0.2 m east of its centre.
    let fifth = map.add_place(()).unwrap();
    let closing = map.travel(PlaceId(3), fifth, Displacement::isotropic(Vector2::new(0.2, -1.0), 0.01)).unwrap();
    map.merge(fifth, PlaceId(0), Vector2::new(0.2, 0.0), Matrix2::identity() * 0.01).unwrap();
    let bent = map.link(closing).unwrap();
    assert_eq!((bent.from, bent.to), (PlaceId(3), PlaceId(0)));
    approx::assert_relative_eq!(bent.displacement.vector, Vector2::new(0.0, -1.0), epsilon = 1e-12);
    assert_eq!(map.resolve(fifth), PlaceId(0));
    assert_eq!(map.n_visited(), 4);
    assert!(matches!(map.place(fifth).unwrap().state, PlaceState::Merged { into: PlaceId(0), .. }));
    assert_eq!(map.merge(fifth, PlaceId(0), Vector2::zeros(), Matrix2::zeros()), Err(MapError::Gone(fifth)));
    assert_eq!(map.bridges(), []);
}

#[test]
fn a_map_whose_headings_were_wrong_turns_with_all_that_was_measured() {
    let mut map = open_square();
    let before: Vec<Displacement> = map.links().iter().map(|link| link.displacement).collect();
    let thin =
        Displacement { vector: Vector2::new(1.0, 0.0), covariance: Matrix2::new(1.0, 0.0, 0.0, 0.01), turn: None };
    let (predicted, link) = map.predict_place(PlaceId(0), thin, 0.9).unwrap();
    let own = Displacement { turn: Some(Turn { change: 0.1, variance: 0.01 }), ..thin };
    let own = map.add_link(PlaceId(0), PlaceId(2), own, LinkOrigin::Traveled).unwrap();
    map.turn(FRAC_PI_2);
    for (link, before) in map.links().iter().zip(before) {
        let left = Vector2::new(-before.vector.y, before.vector.x);
        approx::assert_relative_eq!(link.displacement.vector, left, epsilon = 1e-12);
    }
    let turned = map.link(link).unwrap().displacement;
    approx::assert_relative_eq!(turned.covariance, Matrix2::new(0.01, 0.0, 0.0, 1.0), epsilon = 1e-12);
    let PlaceState::Predicted { toward, .. } = map.place(predicted).unwrap().state else {
        panic!("no longer predicted")
    };
    approx::assert_relative_eq!(toward.radians(), FRAC_PI_2, epsilon = 1e-12);
    assert_eq!(map.link(own).unwrap().displacement.vector, thin.vector, "places with axes of their own need no others");
}

#[test]
fn what_makes_no_sense_is_refused_and_changes_nothing() {
    let mut map = open_square();
    let before = map.clone();
    let nowhere = PlaceId(7);
    assert_eq!(map.travel(PlaceId(0), nowhere, east(1.0)), Err(MapError::NoPlace { place: nowhere, count: 4 }));
    assert_eq!(map.travel(PlaceId(0), PlaceId(0), east(1.0)), Err(MapError::Loop(PlaceId(0))));
    assert!(matches!(map.travel(PlaceId(0), PlaceId(2), east(f64::NAN)), Err(MapError::Displacement { .. })));
    assert_eq!(map.predict_place(PlaceId(0), east(1.0), 1.5), Err(MapError::Confidence(1.5)));
    assert!(map.predict_place(PlaceId(0), east(f64::INFINITY), 0.5).is_err());
    assert_eq!(map.set_link_state(LinkId(9), LinkState::Open), Err(MapError::NoLink { link: LinkId(9), count: 3 }));
    assert_eq!(map.verify(PlaceId(0), ()), Err(MapError::NotPredicted(PlaceId(0))));
    assert_eq!(map, before);
}

#[test]
fn parts_make_the_same_map_and_wrong_parts_none() {
    let mut map = open_square();
    let fifth = map.add_place(()).unwrap();
    map.travel(PlaceId(3), fifth, north(-1.0)).unwrap();
    map.merge(fifth, PlaceId(0), Vector2::zeros(), Matrix2::zeros()).unwrap();
    let (places, mut links) = (map.places().to_vec(), map.links().to_vec());
    assert_eq!(TopoMap::from_parts(places.clone(), links.clone()), Ok(map));
    links[1].to = PlaceId(99);
    assert_eq!(TopoMap::from_parts(places, links), Err(MapError::NoPlace { place: PlaceId(99), count: 5 }));
}

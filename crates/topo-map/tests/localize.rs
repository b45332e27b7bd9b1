//! The Bayes filter: it tracks, refuses to guess, finds a kidnapped robot, and knows what it has never seen.

use local_grid::nalgebra::{Matrix2, Vector2};
use topo_map::{Displacement, Localizer, LocalizerOptions, PlaceId, PlaceLikelihood, Recognition, TopoMap, Unsure};

/// A corridor of `count` places, 1 m apart along x.
fn corridor(count: u32) -> TopoMap<()> {
    let mut map = TopoMap::new();
    let mut last = map.add_place(()).unwrap();
    for _ in 1..count {
        let next = map.add_place(()).unwrap();
        map.travel(last, next, Displacement::isotropic(Vector2::new(1.0, 0.0), 0.01)).unwrap();
        last = next;
    }
    map
}

fn seen(place: u32, ratio: f64) -> PlaceLikelihood {
    let covariance = Matrix2::identity() * 0.01;
    PlaceLikelihood { place: PlaceId(place), ratio, offset: Vector2::zeros(), covariance, turn: 0.0 }
}

fn localizer() -> Localizer {
    Localizer::new(LocalizerOptions::default()).unwrap()
}

fn total(localizer: &Localizer) -> f64 {
    let belief = localizer.belief();
    belief.hypotheses.iter().map(|h| h.probability).sum::<f64>() + belief.uncharted + belief.elsewhere
}

fn step(localizer: &mut Localizer, map: &TopoMap<()>, likelihoods: &[PlaceLikelihood]) -> Recognition {
    localizer.predict(map, Vector2::new(1.0, 0.0), 0.0025).unwrap();
    approx::assert_relative_eq!(total(localizer), 1.0, epsilon = 1e-12);
    localizer.update(map, likelihoods).unwrap();
    approx::assert_relative_eq!(total(localizer), 1.0, epsilon = 1e-12);
    localizer.decide(map)
}

fn known(recognition: &Recognition) -> Option<u32> {
    match recognition {
        Recognition::Known(hypothesis) => Some(hypothesis.place.0),
        Recognition::New { .. } | Recognition::Unsure { .. } => None,
    }
}

#[test]
fn a_robot_that_follows_the_links_is_tracked() {
    let map = corridor(6);
    let mut localizer = localizer();
    localizer.settle(&map, PlaceId(0), Vector2::zeros()).unwrap();
    for place in 1..5 {
        let answer = step(&mut localizer, &map, &[seen(place - 1, 0.2), seen(place, 20.0), seen(place + 1, 0.2)]);
        assert_eq!(known(&answer), Some(place), "{answer:?}");
    }
}

#[test]
fn beyond_the_last_place_lies_a_new_one() {
    let map = corridor(3);
    let mut localizer = localizer();
    localizer.settle(&map, PlaceId(2), Vector2::zeros()).unwrap();
    let answer = step(&mut localizer, &map, &[seen(1, 0.05), seen(2, 0.1)]);
    assert!(matches!(answer, Recognition::New { .. }), "{answer:?}");
}

#[test]
fn a_view_that_says_nothing_gets_no_answer() {
    let map = corridor(8);
    let mut localizer = localizer();
    let all: Vec<_> = (0..8).map(|place| seen(place, 1.0)).collect();
    localizer.update(&map, &all).unwrap();
    let answer = localizer.decide(&map);
    assert!(matches!(answer, Recognition::Unsure { reason: Unsure::Undecided, .. }), "{answer:?}");
}

#[test]
fn identical_corridors_stay_bimodal_until_a_distinguishing_place() {
    // Places 0..5 and 5..10 look alike but for the last of each.
    let mut map = corridor(5);
    for index in 0..5 {
        let next = map.add_place(()).unwrap();
        if index > 0 {
            let along = Displacement::isotropic(Vector2::new(1.0, 0.0), 0.01);
            map.travel(PlaceId(next.0 - 1), next, along).unwrap();
        }
    }
    let mut localizer = localizer();
    localizer.update(&map, &[seen(0, 100.0), seen(5, 100.0)]).unwrap();
    for place in 1..4 {
        let answer = step(&mut localizer, &map, &[seen(place, 100.0), seen(place + 5, 100.0)]);
        assert!(matches!(answer, Recognition::Unsure { .. }), "{answer:?}");
        let best: Vec<u32> = localizer.belief().hypotheses[..2].iter().map(|h| h.place.0).collect();
        assert_eq!(best, [place, place + 5]);
    }
    let answer = step(&mut localizer, &map, &[seen(4, 0.01), seen(9, 100.0)]);
    assert_eq!(known(&answer), Some(9), "{answer:?}");
}

#[test]
fn a_kidnapped_robot_is_found_again_within_five_steps() {
    let map = corridor(40);
    let mut localizer = localizer();
    localizer.settle(&map, PlaceId(3), Vector2::zeros()).unwrap();
    let found = (21..26).position(|place| {
        let around = [seen(place, 20.0), seen(place + 1, 0.2), seen(place - 1, 0.2)];
        known(&step(&mut localizer, &map, &around)) == Some(place)
    });
    assert!(found.is_some(), "{:?}", localizer.belief());
    assert!(found > Some(0), "one look must not be enough");
}

#[test]
fn agreement_counts_the_views_that_confirmed_a_jump() {
    let map = corridor(40);
    let mut localizer = localizer();
    localizer.settle(&map, PlaceId(3), Vector2::zeros()).unwrap();
    for (place, agreement) in [(21, 1), (22, 2), (23, 3)] {
        step(&mut localizer, &map, &[seen(place, 20.0)]);
        let there = localizer.belief().hypotheses.iter().find(|h| h.place == PlaceId(place)).unwrap();
        assert_eq!(there.agreement, agreement);
    }
}

#[test]
fn a_place_just_added_takes_over_what_was_uncharted() {
    let mut map = corridor(2);
    let mut localizer = localizer();
    localizer.settle(&map, PlaceId(1), Vector2::zeros()).unwrap();
    let answer = step(&mut localizer, &map, &[seen(1, 0.1)]);
    assert!(matches!(answer, Recognition::New { .. }), "{answer:?}");
    let next = map.add_place(()).unwrap();
    localizer.enter(&map, next).unwrap();
    assert_eq!(localizer.belief().hypotheses[0].place, next);
    assert_eq!(localizer.belief().uncharted, 0.0);
}

#[test]
fn the_offset_is_fused_with_the_measured_one() {
    let map = corridor(3);
    let mut localizer = localizer();
    localizer.settle(&map, PlaceId(0), Vector2::zeros()).unwrap();
    localizer.predict(&map, Vector2::new(1.2, 0.1), 0.01).unwrap();
    let here = PlaceLikelihood { offset: Vector2::new(0.3, 0.0), ..seen(1, 50.0) };
    localizer.update(&map, &[here]).unwrap();
    let Recognition::Known(hypothesis) = localizer.decide(&map) else { panic!("must be recognised") };
    assert!((0.2..0.3).contains(&hypothesis.offset.x) && (0.0..0.1).contains(&hypothesis.offset.y), "{hypothesis:?}");
}

#[test]
fn a_corridors_axis_is_left_to_odometry() {
    let map = corridor(3);
    let mut localizer = localizer();
    localizer.settle(&map, PlaceId(0), Vector2::zeros()).unwrap();
    localizer.predict(&map, Vector2::new(1.1, 0.0), 0.0025).unwrap();
    // The match slid along the axis by half a metre, and says itself that it could have.
    let sliding = Matrix2::new(10.0, 0.0, 0.0, 0.0025);
    let here = PlaceLikelihood { offset: Vector2::new(-0.5, 0.05), covariance: sliding, ..seen(1, 50.0) };
    localizer.update(&map, &[here]).unwrap();
    let Recognition::Known(hypothesis) = localizer.decide(&map) else { panic!("must be recognised") };
    assert!((hypothesis.offset.x - 0.1).abs() < 0.01, "{hypothesis:?}");
}

#[test]
fn nonsense_is_refused() {
    let map = corridor(3);
    let mut localizer = localizer();
    assert!(localizer.predict(&map, Vector2::new(f64::NAN, 0.0), 0.1).is_err());
    assert!(localizer.predict(&map, Vector2::zeros(), -1.0).is_err());
    assert!(localizer.update(&map, &[seen(1, -1.0)]).is_err());
    assert!(localizer.update(&map, &[seen(1, 1.0), seen(1, 2.0)]).is_err());
    assert!(localizer.update(&map, &[seen(3, 1.0)]).is_err());
    assert!(localizer.enter(&map, PlaceId(3)).is_err());
    let options = LocalizerOptions { known_probability: 1.5, ..LocalizerOptions::default() };
    assert!(Localizer::new(options).is_err());
}

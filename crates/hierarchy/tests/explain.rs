use hierarchy::explain::{explain, without};
use hierarchy::{Config, Mapper};
use topo_map::LinkOrigin;

use crate::logs::{map, office_loop};

fn mapped() -> Mapper {
    map(&office_loop(), Config::default())
}

#[test]
fn what_a_loop_costs_is_what_its_loss_saves() {
    let mapper = mapped();
    let told = explain(&mapper).unwrap();
    let energy: f64 = told.links.iter().map(|link| link.energy).sum();
    let metrics = mapper.metrics().unwrap();
    assert_eq!(told.energy, metrics.relaxation.energy_after);
    approx::assert_relative_eq!(energy, metrics.relaxation.energy_after, max_relative = 1e-9);
    // The χ² of a link against the rest of the map is the energy that the map loses with it: no approximation is left.
    for story in told.accepted().into_iter().take(3).chain(told.accepted().into_iter().rev().take(2)) {
        let what_if = without(&mapper, &[story.link.unwrap()]).unwrap();
        approx::assert_relative_eq!(what_if.energy_with, energy, max_relative = 1e-9);
        approx::assert_relative_eq!(what_if.energy_with - what_if.energy_without, story.chi2, max_relative = 1e-4);
        assert_eq!(what_if.parted, 0);
    }
}

#[test]
fn every_decision_and_every_loop_is_told_once() {
    let mapper = mapped();
    let told = explain(&mapper).unwrap();
    let metrics = mapper.metrics().unwrap();
    assert_eq!(told.loops.len(), mapper.closures().len());
    assert_eq!(told.accepted().len(), metrics.links.recognized);
    assert_eq!(told.refused().len(), metrics.links.rejected);
    assert!(told.refused().iter().all(|story| story.chi2 > 0.0 && story.sigma_m > 0.0), "something must check them");
    assert!(told.loop_residual_rms_before_m() > 3.0 * told.loop_residual_rms_m());
    let worst = &told.places[0];
    assert!(told.places.iter().all(|place| place.sigma_m <= worst.sigma_m) && worst.sigma_m > 0.0);
}

#[test]
fn a_bridge_parts_the_map_and_costs_nothing() {
    let mapper = mapped();
    let told = explain(&mapper).unwrap();
    let bridges: Vec<_> = told.links.iter().filter(|link| link.bridge).collect();
    assert!(bridges.iter().all(|link| link.origin == LinkOrigin::Traveled && link.chi2 == 0.0), "{bridges:?}");
    for bridge in bridges.iter().take(3) {
        let what_if = without(&mapper, &[bridge.link]).unwrap();
        assert!(what_if.parted == bridge.beyond || what_if.parted == told.places.len() - bridge.beyond);
        assert!((what_if.energy_with - what_if.energy_without).abs() < 1e-6);
    }
    assert_eq!(told.links.iter().filter(|link| !link.bridge && link.beyond > 0).count(), 0);
}

#[test]
fn maps_without_a_compass_are_explained_and_edited_as_well() {
    let mut config = Config::default();
    config.heading.source = hierarchy::HeadingMode::Odometry;
    let mut mapper = map(&office_loop(), config);
    let told = explain(&mapper).unwrap();
    assert!(told.energy > 0.0 && told.places.len() > 100);
    assert!(told.loops.iter().all(|story| story.chi2.is_finite() && story.sigma_m.is_finite()));
    if let Some(story) = told.accepted().first() {
        let what_if = without(&mapper, &[story.link.unwrap()]).unwrap();
        assert!(what_if.energy_without <= what_if.energy_with * (1.0 + 1e-9));
    }
    let at = mapper.coordinates().map_from_place(topo_map::PlaceId(50)).translation.vector
        + nalgebra::Vector2::new(0.3, 0.1);
    let pin = hierarchy::edit::Edit::Pin { place: 50, at_m: at.into(), sigma_m: 0.001 };
    hierarchy::edit::Edits { list: vec![pin] }.apply(&mut mapper).unwrap();
    let moved = mapper.coordinates().map_from_place(topo_map::PlaceId(50)).translation.vector;
    assert!((moved - at).norm() < 0.01, "{moved} is not {at}");
}

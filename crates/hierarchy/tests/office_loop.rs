use hierarchy::{Config, Event, Mapper, RelaxationPolicy};
use robot_log::{Entry, EntryKind};

use crate::logs::{map, office_loop, truth};

#[test]
fn relaxation_repairs_the_drift_by_a_factor_of_three() {
    let log = office_loop();
    let mapper = map(&log, Config::default());
    let judged = truth(&log).judge(&mapper).unwrap();
    assert!(judged.places > 100, "{judged:?}");
    assert!(
        judged.odometry_m > 1.0 && judged.before_m > 1.0,
        "the log must drift, or there is nothing to repair: {judged:?}"
    );
    assert!(3.0 * judged.after_m < judged.before_m, "{judged:?}");
}

#[test]
fn every_closure_of_the_office_loop_is_true() {
    let log = office_loop();
    let (mapper, truth) = (map(&log, Config::default()), truth(&log));
    let anchors = mapper.trajectory().anchors();
    let at = |place: topo_map::PlaceId| truth.at(anchors.iter().find(|a| a.place == place).unwrap().stamp).unwrap();
    let accepted = mapper.closures().iter().filter(|c| matches!(c.verdict, hierarchy::Verdict::Accepted { .. }));
    let mut closures = 0;
    for closure in accepted {
        // A view of a corridor does not tell where along it the robot is, and says so by its covariance: a closure is
        // false if the truth contradicts that (99.9 % of χ² with two degrees of freedom), or if it joins other places.
        let error = at(closure.known) - at(closure.place) - closure.displacement.vector;
        let information = closure.displacement.covariance.try_inverse().unwrap();
        let chi2 = (error.transpose() * information * error)[0];
        let (place, known, off) = (closure.place, closure.known, error.norm());
        assert!(chi2 < 13.8 && off < 2.0, "{place} is not {known}: {off:.2} m off, χ² {chi2:.1}");
        closures += 1;
    }
    assert!(closures >= 10, "a loop driven twice must close: {closures}");
}

#[test]
fn the_coordinates_are_at_their_optimum() {
    let metrics = map(&office_loop(), Config::default()).metrics().unwrap().relaxation;
    assert!(metrics.energy_after < metrics.energy_before);
    assert!(metrics.relative_gap.abs() < 1e-9, "{metrics:?}");
}

#[test]
fn one_sweep_per_place_stays_above_the_optimum() {
    let mut config = Config::default();
    config.relaxation.policy = RelaxationPolicy::OneSweep;
    let metrics = map(&office_loop(), config).metrics().unwrap().relaxation;
    assert!(
        metrics.energy_after > metrics.energy_optimum && metrics.energy_after < metrics.energy_before,
        "{metrics:?}"
    );
    assert!(metrics.sweeps > 100);
}

#[test]
fn the_same_log_gives_the_same_bytes() {
    let log = office_loop();
    let bytes = || {
        let mut bytes = Vec::new();
        map(&log, Config::default()).save(&mut bytes).unwrap();
        bytes
    };
    assert!(bytes() == bytes(), "two runs differ");
}

#[test]
fn the_mapper_never_looks_at_the_truth() {
    let log = office_loop();
    let blind: Vec<Entry> = log.iter().filter(|e| !matches!(e.kind, EntryKind::Truth { .. })).cloned().collect();
    let positions = |log: &[Entry]| map(log, Config::default()).coordinates().positions();
    assert_eq!(positions(&log), positions(&blind));
}

#[test]
fn entries_out_of_order_are_refused_and_change_nothing() {
    let log = office_loop();
    let mut mapper = Mapper::new(Config::default()).unwrap();
    for entry in &log[..200] {
        mapper.push(entry).unwrap();
    }
    let before = mapper.tally().clone();
    assert!(mapper.push(&log[10]).unwrap_err().to_string().contains("order"));
    assert_eq!(mapper.tally(), &before);
}

#[test]
fn events_tell_what_happened() {
    let mut mapper = Mapper::new(Config::default()).unwrap();
    let events: Vec<Event> = office_loop().iter().flat_map(|entry| mapper.push(entry).unwrap()).collect();
    let count = |wanted: fn(&Event) -> bool| events.iter().filter(|event| wanted(event)).count();
    assert_eq!(count(|e| matches!(e, Event::PlaceAdded { .. })), mapper.topology().n_visited());
    assert!(count(|e| matches!(e, Event::PlaceRecognized { .. })) > 0);
    assert!(count(|e| matches!(e, Event::Relaxed { .. })) > 0);
}

#[test]
fn the_growth_of_a_map_is_what_mapping_it_did() {
    let mut mapper = Mapper::new(Config::default()).unwrap();
    let mut energies = Vec::new();
    let mut note = |events: Vec<Event>| {
        energies.extend(events.iter().filter_map(|event| match event {
            Event::Relaxed { energy_before, energy_after, .. } => Some((*energy_before, *energy_after)),
            _ => None,
        }));
    };
    for entry in office_loop() {
        note(mapper.push(&entry).unwrap());
    }
    note(mapper.finish().unwrap());
    let growth = mapper.growth(usize::MAX).unwrap();
    let (last, earlier) = growth.relaxations.split_last().unwrap();
    assert!(earlier.len() > 10 && growth.n_relaxations == growth.relaxations.len());
    for (step, (before, after)) in earlier.iter().zip(energies) {
        approx::assert_relative_eq!(step.energy_before, before, max_relative = 1e-9, epsilon = 1e-9);
        approx::assert_relative_eq!(step.energy_after, after, max_relative = 1e-9, epsilon = 1e-9);
    }
    assert_eq!(last.positions, mapper.coordinates().positions());
    assert_eq!(
        (last.links, growth.arrivals.len()),
        (mapper.topology().links().len(), mapper.topology().places().len())
    );

    // Fewer relaxations are some of the same: with a compass the optimum does not depend on the way to it.
    let some = mapper.growth(600).unwrap();
    assert!(some.relaxations.len() < growth.relaxations.len() && some.n_relaxations == growth.n_relaxations);
    for step in &some.relaxations {
        let same = growth.relaxations.iter().find(|other| other.links == step.links).unwrap();
        approx::assert_relative_eq!(step.energy_after, same.energy_after, max_relative = 1e-6, epsilon = 1e-9);
    }
}

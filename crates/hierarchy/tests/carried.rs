//! A robot that is lifted and set down elsewhere: its map must not bend, and it must find itself again.

use hierarchy::{CarriedBy, Closure, Config, Event, Mapper, Verdict};
use robot_log::Entry;
use simulator::{Robot, RobotDescription, TourOptions, World, carried};

use crate::logs::{map, office_loop, truth};

/// What became of a map over which the robot was carried.
struct Story {
    carried: usize,
    pieces: usize,
    closures: usize,
    /// How far the worst of them is off, in metres.
    farthest_m: f64,
    off_m: f64,
}

fn story(log: &[Entry]) -> Story {
    let mut mapper = Mapper::new(Config::default()).unwrap();
    let mut carried = 0;
    for entry in log {
        let events = mapper.push(entry).unwrap();
        carried += events.iter().filter(|event| matches!(event, Event::Carried { .. })).count();
    }
    mapper.finish().unwrap();
    let truth = truth(log);
    let anchors = mapper.trajectory().anchors();
    let at = |place| truth.at(anchors.iter().find(|anchor| anchor.place == place).unwrap().stamp).unwrap();
    let accepted = mapper.closures().iter().filter(|closure| matches!(closure.verdict, Verdict::Accepted { .. }));
    let off = |closure: &Closure| {
        let apart = (at(closure.known) - at(closure.place)).norm();
        (apart - closure.displacement.vector.norm()).abs()
    };
    let off: Vec<f64> = accepted.map(off).collect();
    let (closures, farthest_m) = (off.len(), off.into_iter().fold(0.0, f64::max));
    let off_m = truth.judge(&mapper).unwrap().after_m;
    let pieces = mapper.topology().components().len();
    Story { carried, pieces, closures, farthest_m, off_m }
}

/// The log without what was recorded between two shares of its time.
fn without(log: &[Entry], from: f64, to: f64) -> Vec<Entry> {
    let (begin, end) = (log[0].stamp, log[log.len() - 1].stamp);
    let stamp = |share: f64| begin + share * (end - begin);
    carried(log.iter().cloned(), stamp(from)..stamp(to))
}

/// What a laser sees that is driven round the office with its rooms, then round again until it was so many times.
fn laser_rounds(rounds: usize) -> Vec<Entry> {
    let world = World::from_plan(include_str!("../../../fixtures/worlds/office-loop.toml")).unwrap();
    let mut robot = Robot::new(&world, RobotDescription::named("laser").unwrap(), 7).unwrap();
    let options = TourOptions { stop_every: 0.4, firings: 1, ..TourOptions::default() };
    let tour = &world.tours()[0].points;
    let again = &tour[tour.len() - 16..tour.len() - 2];
    let points = [&tour[..tour.len() - 16], &again.repeat(rounds - 1), &tour[tour.len() - 2..]].concat();
    let mut log = Vec::new();
    robot.drive_tour(&points, &options, |_, entries| log.extend(entries)).unwrap();
    log
}

fn is_found_again(log: &[Entry], most_off_m: f64) {
    let Story { carried, pieces, closures, farthest_m, off_m } = story(log);
    assert_eq!((carried, pieces), (1, 1), "noticed once, and recognised again");
    assert!(closures >= 20 && farthest_m < 2.0, "of {closures} closures one is {farthest_m} m off");
    assert!(off_m < most_off_m, "{off_m} m off");
}

#[test]
fn a_robot_with_sonars_and_compass_is_found_again() {
    is_found_again(&without(&office_loop(), 0.35, 0.5), 0.4);
}

#[test]
fn a_robot_with_a_laser_is_found_again_whatever_way_it_faces() {
    let log = laser_rounds(2);
    assert_eq!(story(&log).carried, 0);
    is_found_again(&without(&log, 0.4, 0.6), 0.05);
}

#[test]
fn what_nobody_recognises_stays_apart_and_bends_nothing() {
    // Only the first half of the round: after the robot was carried it sees nothing that it knows.
    let log = office_loop();
    let half = &without(&log, 0.1, 0.25)[..log.len() / 3];
    let Story { carried, pieces, closures, .. } = story(half);
    assert_eq!((carried, pieces, closures), (1, 2, 0));
}

#[test]
fn a_map_goes_on_after_a_break_as_if_there_had_been_none() {
    let log = without(&office_loop(), 0.35, 0.5);
    let whole = map(&log, Config::default());
    let mut first = Mapper::new(Config::default()).unwrap();
    let (before, after) = log.split_at(log.len() / 2);
    before.iter().for_each(|entry| drop(first.push(entry).unwrap()));
    let mut bytes = Vec::new();
    first.save(&mut bytes).unwrap();
    let mut second = Mapper::load(&mut bytes.as_slice()).unwrap();
    after.iter().for_each(|entry| drop(second.push(entry).unwrap()));
    second.finish().unwrap();
    assert_eq!(second.closures(), whole.closures());
    assert_eq!(second.coordinates().positions(), whole.coordinates().positions());
}

#[test]
fn a_robot_carried_along_a_corridor_is_found_out_later() {
    // All scans look as before when it is set down 7 m farther on.
    let log = laser_rounds(3);
    assert_eq!(story(&log).carried, 0);
    let log = without(&log, 0.65, 0.675);
    let mut mapper = Mapper::new(Config::default()).unwrap();
    let events: Vec<Event> = log.iter().flat_map(|entry| mapper.push(entry).unwrap()).collect();
    let told_by = events.iter().filter_map(|event| match event {
        Event::Carried { told_by, .. } => Some(told_by),
        _ => None,
    });
    assert!(matches!(told_by.collect::<Vec<_>>()[..], [CarriedBy::Places { agreed: 15.., .. }]), "by places alone");
    is_found_again(&log, 0.5);
}

//! A robot that is switched on somewhere in a building of which there is a map.

use hierarchy::evaluate::TimedPath;
use hierarchy::{Config, Mapper, Whereabouts};
use nalgebra::Isometry2;
use robot_log::{Entry, EntryKind};
use simulator::{Robot, RobotDescription, TourOptions, World, carried};

use crate::logs::map;

const OFFICE: &str = include_str!("../../../fixtures/worlds/office-loop.toml");

/// What a robot senses on a tour of the office, from a share of its time on.
fn tour(robot: &str, seed: u64, from: f64) -> Vec<Entry> {
    let world = World::from_plan(OFFICE).unwrap();
    let mut robot = Robot::new(&world, RobotDescription::named(robot).unwrap(), seed).unwrap();
    let options = TourOptions { stop_every: 0.4, firings: 1, ..TourOptions::default() };
    let mut log = Vec::new();
    robot.drive_tour(&world.tours()[0].points, &options, |_, entries| log.extend(entries)).unwrap();
    let begin = from * log[log.len() - 1].stamp;
    log.into_iter().filter(|entry| entry.stamp >= begin).collect()
}

fn truth(log: &[Entry]) -> TimedPath {
    TimedPath::new(log.iter().filter_map(|entry| match entry.kind {
        EntryKind::Truth { map_from_robot } => Some((entry.stamp, map_from_robot)),
        _ => None,
    }))
}

/// How the first place of a map lies in the world.
fn world_from_map(mapper: &Mapper, log: &[Entry]) -> Isometry2<f64> {
    let first = mapper.trajectory().anchors()[0];
    let map_from_robot = mapper.coordinates().map_from_place(first.place) * first.place_from_robot;
    truth(log).between(first.stamp, 10.0).unwrap() * map_from_robot.inverse()
}

fn found(mapper: &Mapper, walk: &[Entry]) -> Vec<Whereabouts> {
    let mut finder = mapper.finder().unwrap();
    let mut found = Vec::new();
    for entry in walk {
        found.extend(finder.push(entry).unwrap());
    }
    found.extend(finder.finish().unwrap());
    found
}

/// How far off the robot is found, in metres.
fn off(view: &Whereabouts, world_from_map: &Isometry2<f64>, truth: &TimedPath) -> Option<f64> {
    let world_from_robot = world_from_map * view.map_from_robot?;
    Some((world_from_robot.translation.vector - truth.between(view.stamp, 10.0)?.translation.vector).norm())
}

/// Distance driven until the robot is known, the share of places after that at which it is, and how far off the worst tenth
/// of these and the worst of all are.
fn story(robot: &str, walk: &[Entry]) -> (f64, f64, [f64; 2]) {
    let log = tour(robot, 7, 0.0);
    let mapper = map(&log, Config::default());
    let (world_from_map, truth) = (world_from_map(&mapper, &log), truth(walk));
    let seen = found(&mapper, walk);
    let first = seen.iter().position(|view| view.map_from_robot.is_some()).unwrap();
    let mut errors: Vec<f64> = seen.iter().filter_map(|view| off(view, &world_from_map, &truth)).collect();
    errors.sort_by(f64::total_cmp);
    let known = errors.len() as f64 / (seen.len() - first) as f64;
    (seen[first].driven, known, [errors[errors.len() * 9 / 10], errors[errors.len() - 1]])
}

#[test]
fn a_robot_with_sonars_and_compass_is_found() {
    let (driven, known, [off, most]) = story("nomad200", &tour("nomad200", 8, 0.4));
    assert!(driven < 20.0 && known > 0.5 && off < 0.5 && most < 1.0, "{driven} m, {known}, {off} m, {most} m");
}

#[test]
fn a_robot_with_a_laser_is_found_whatever_way_it_faces_and_again_when_it_was_carried() {
    let log = tour("laser", 8, 0.2);
    let end = log[log.len() - 1].stamp;
    let (driven, known, [off, most]) = story("laser", &carried(log, 0.5 * end..0.75 * end));
    assert!(driven < 20.0 && known > 0.6 && off < 0.5 && most < 1.0, "{driven} m, {known}, {off} m, {most} m");
}

#[test]
fn a_robot_beyond_the_map_is_not_taken_to_be_in_it() {
    let log = tour("nomad200", 7, 0.0);
    let mapper = map(&log[..log.len() / 4], Config::default());
    let walk = tour("nomad200", 8, 0.3);
    let (world_from_map, truth) = (world_from_map(&mapper, &log), truth(&walk));
    let known: Vec<f64> = found(&mapper, &walk).iter().filter_map(|view| off(view, &world_from_map, &truth)).collect();
    let wrong = known.iter().filter(|off| **off > 1.0).count();
    assert!(20 * wrong <= known.len(), "{wrong} of {} known poses are wrong", known.len());
}

//! Maps that other people's robots made of real buildings become worlds in which a robot can drive.

use std::path::{Path, PathBuf};

use simulator::nalgebra::Point2;
use simulator::{Command, MapDescription, MapImage, Robot, RobotDescription, World};

fn maps() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/maps");
    if !folder.is_dir() {
        println!("skipped: {} not present", folder.display());
        return None;
    }
    Some(folder)
}

fn load(folder: &Path, name: &str) -> World {
    let description = MapDescription::parse(&std::fs::read_to_string(folder.join(name)).unwrap()).unwrap();
    let image = folder.join(&description.image);
    let packed = folder.join(format!("{}.gz", description.image));
    let bytes = std::fs::read(if image.exists() { image } else { packed }).unwrap();
    World::from_map(name, &description, &MapImage::read(&bytes).unwrap()).unwrap()
}

#[test]
fn every_map_becomes_a_world_with_room_at_the_start() {
    let Some(folder) = maps() else { return };
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".yaml"))
        .collect();
    names.sort();
    assert!(!names.is_empty());
    for name in names {
        let world = load(&folder, &name);
        let start = Point2::from(world.map_from_start().translation.vector);
        let room = world.at(0.0).clearance(start, 3.0);
        println!("{name}: {} walls, room {room:.2} m", world.walls().len());
        assert!(room > 0.3, "{name}: {room}");
        let mut robot = Robot::new(&world, RobotDescription::nomad200(), 1).unwrap();
        let mut log = Vec::new();
        robot.execute(&Command::Drive { distance: 100.0 }, &mut log);
        assert!(robot.bumps() == 1, "{name}: the robot left the building");
        let here = Point2::from(robot.map_from_robot().translation.vector);
        assert!(world.at(0.0).clearance(here, 1.0) > 0.22, "{name}");
    }
}

#[test]
fn a_line_map_becomes_a_world() {
    let Some(folder) = maps() else { return };
    let text = String::from_utf8_lossy(&std::fs::read(folder.join("AMROffice.map")).unwrap()).into_owned();
    let world = World::from_line_map("office", &text).unwrap();
    assert!(world.walls().len() >= 243); // as many as its header says, and the forbidden lines
    let mut robot = Robot::new(&world, RobotDescription::named("laser").unwrap(), 1).unwrap();
    let mut log = Vec::new();
    assert!(robot.execute(&Command::Drive { distance: 100.0 }, &mut log).blocked);
}

#[test]
fn drawn_floor_plans_become_worlds_once_their_scale_is_given() {
    let Some(folder) = maps() else { return };
    for (name, resolution) in [("stage_hospital.png", 0.0475), ("orebro_aass_evacuation_plan.png", 0.05)] {
        let image = MapImage::read(&std::fs::read(folder.join(name)).unwrap()).unwrap();
        let world = World::from_map(name, &MapDescription::drawing(name, resolution), &image).unwrap();
        println!("{name}: {} walls", world.walls().len());
        assert!(world.walls().len() > 50, "{name}");
    }
}

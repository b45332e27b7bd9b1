use hierarchy::{Config, Mapper};
use nalgebra::Point2;
use region_map::{Gateway, RegionMap};
use robot_log::Entry;
use simulator::{Robot, RobotDescription, TourOptions, World};

/// A corridor and a room with a door; a panel stands in the doorway from the 1000th to the 2000th second.
const OFFICE: &str = r#"
name = "a door that somebody shuts"
start = [1.0, 1.0, 0.0]
[[wall]]
points = [[0, 0], [12, 0], [12, 2], [0, 2]]
closed = true
material = "rough"
[[wall]]
points = [[3, 2], [3, 6], [9, 6], [9, 2]]
material = "rough"
[[door]]
from = [5.5, 2]
to = [6.5, 2]
[[mover]]
name = "door"
size = [1.0, 0.06]
stations = [[0, 6, 30], [1000, 6, 30], [1000.01, 6, 2], [2000, 6, 2], [2000.01, 6, 30]]
"#;

struct Visit<'w> {
    robot: Robot<'w>,
    mapper: Mapper,
}

impl Visit<'_> {
    /// Drives to points of the map, and on the spot until the clock shows `until` seconds.
    fn drive(&mut self, points: &[[f64; 2]], until: f64) {
        let points: Vec<_> = points.iter().map(|point| Point2::from(*point)).collect();
        let options = TourOptions { stop_every: 0.5, firings: 1, ..TourOptions::default() };
        let mut log: Vec<Entry> = Vec::new();
        self.robot.drive_tour(&points, &options, |_, entries| log.extend(entries)).unwrap();
        assert!(self.robot.time() < until, "{} s", self.robot.time());
        while self.robot.time() < until {
            self.robot.execute(&simulator::Command::Wait { seconds: until - self.robot.time() }, &mut log);
        }
        log.iter().for_each(|entry| drop(self.mapper.push(entry).unwrap()));
    }

    /// Whether the door is blocked, and whether a way leads through it from the corridor into the room.
    fn look(&mut self) -> [bool; 2] {
        let map: RegionMap = self.mapper.survey(&self.mapper.gridmap().unwrap()).unwrap();
        // The map begins where the robot did.
        let off = |gateway: &Gateway| (gateway.center - Point2::new(5.0, 1.0)).norm();
        let door = map.gateways.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("the door is a gateway");
        assert!(off(door) < 0.6, "{door:?}");
        let route = map.route(Point2::new(4.0, 0.0), Point2::new(5.0, 3.0), |_| true);
        [door.blocked, route.is_some()]
    }
}

#[test]
fn a_door_seen_shut_blocks_its_gateway_until_it_is_seen_open() {
    let world = World::from_plan(OFFICE).unwrap();
    let robot = Robot::new(&world, RobotDescription::nomad200().with_perfect_compass(), 1).unwrap();
    let mut visit = Visit { robot, mapper: Mapper::new(Config::default()).unwrap() };
    visit.drive(
        &[[11.0, 1.0], [6.0, 1.0], [6.0, 4.0], [4.0, 4.0], [8.0, 4.0], [6.0, 4.0], [6.0, 1.0], [4.0, 1.0]],
        1005.0,
    );
    assert_eq!(visit.look(), [false, true], "before");

    visit.drive(&[[8.0, 1.0], [4.0, 1.0], [8.0, 1.0], [4.0, 1.0]], 2005.0);
    assert_eq!(visit.look(), [true, false], "shut");

    visit.drive(&[[8.0, 1.0], [4.0, 1.0]], 2300.0);
    assert_eq!(visit.look(), [false, true], "open again");
}

//! What the shipped logs are made from: world, robot, seed.

use std::path::{Path, PathBuf};

use simulator::robot_log::CarmenWriter;
use simulator::{Robot, RobotDescription, TourOptions, World};

/// One log that the repository ships.
pub(crate) struct Recipe {
    /// The log, under `fixtures/`.
    pub(crate) log: &'static str,
    /// The world, under `fixtures/`; its first tour is driven.
    pub(crate) world: &'static str,
    /// The robot's description.
    pub(crate) robot: &'static str,
    /// The seed.
    pub(crate) seed: u64,
    /// Metres between two firings of the ring.
    pub(crate) stop_every: f64,
}

/// All of them.
pub(crate) const RECIPES: [Recipe; 1] = [Recipe {
    log: "logs/office_loop.log",
    world: "worlds/office-loop.toml",
    // Worn wheels on a carpet; a compass that is better than most.
    robot: "
        name = 'nomad200 with worn wheels'
        log_period = 4.0
        [odometry]
        walk = 0.05
        scale = 0.01
        carpet = 0.04
        [compass]
        disturbance = 0.035
    ",
    seed: 2000,
    stop_every: 0.4,
}];

/// The folder of the shipped fixtures.
pub(crate) fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures")
}

impl Recipe {
    /// The bytes of the log.
    pub(crate) fn cook(&self) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
        let world = World::from_plan(&std::fs::read_to_string(fixtures().join(self.world))?)?;
        let mut robot = Robot::new(&world, RobotDescription::from_toml(self.robot)?, self.seed)?;
        let mut writer = CarmenWriter::new(Vec::new());
        writer.comment(&format!(
            "A simulated {} in the world `{}`, seed {}.\nMade by: cargo run --release -p simulator --example make_fixtures",
            robot.description().name,
            world.name(),
            self.seed
        ))?;
        let options = TourOptions { stop_every: self.stop_every, firings: 1, ..TourOptions::default() };
        let tour = world.tours().first().ok_or("the world has no tour")?;
        let mut entries = Vec::new();
        robot.drive_tour(&tour.points, &options, |_, mut log| entries.append(&mut log))?;
        entries.iter().try_for_each(|entry| writer.write(entry))?;
        Ok(writer.into_inner())
    }
}

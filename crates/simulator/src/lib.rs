#![doc = include_str!("../README.md")]

mod carried;
mod compass;
mod corner;
mod description;
mod drift;
mod floor;
mod index;
mod laser;
mod line_map;
mod map;
mod mover;
mod noise;
mod odometry;
mod picture;
mod random_office;
mod robot;
mod segment;
mod sonar;
mod tour;
mod world;

pub use carried::carried;
pub use compass::CompassModel;
pub use description::{DescriptionError, InfraredRing, LaserFan, RobotDescription, SonarRing, Turret};
pub use drift::Drift;
pub use floor::Ground;
pub use laser::RayModel;
pub use line_map::LineMapError;
pub use map::{ImageError, MapDescription, MapError, MapImage};
pub use mover::{Mover, Repeats, Station};
pub use odometry::OdometryModel;
pub use picture::Picture;
pub use random_office::{OfficeStyle, random_office, random_office_plan};
pub use robot::{Command, Outcome, Robot};
pub use segment::{Material, Segment};
pub use sonar::SonarModel;
pub use tour::{TourError, TourOptions};
pub use world::{PlanError, Scene, Tour, World, WorldError, WorldParts};

pub use local_grid;
pub use local_grid::nalgebra;
pub use robot_log;

//! Draws a world, the way a log's robot really took through it, and the echoes of its range sensors at the true poses:
//! `cargo run -p simulator --example draw_log -- WORLD.toml LOG.log OUT.png`.

use std::io::BufReader;

use simulator::nalgebra::{Isometry2, Point2};
use simulator::robot_log::{CarmenOptions, CarmenReader, EntryKind};
use simulator::{Picture, World};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [world, log, out] = arguments.as_slice() else { return Err("usage: draw_log WORLD LOG OUT.png".into()) };
    let world = World::from_plan(&std::fs::read_to_string(world)?)?;
    let mut picture = Picture::of(&world, 30.0);
    let mut map_from_robot = Isometry2::identity();
    let mut first = None;
    let reader = BufReader::new(std::fs::File::open(log)?);
    for entry in CarmenReader::new(log, reader, CarmenOptions::default())? {
        match entry?.kind {
            EntryKind::Truth { map_from_robot: truth } => {
                first.get_or_insert(truth);
                map_from_robot = truth;
                picture.dot(Point2::from(truth.translation.vector), 1.0, [0, 160, 0]);
            }
            EntryKind::Odometry { odom_from_robot } => {
                let odometry = first.unwrap_or_default() * odom_from_robot;
                picture.dot(Point2::from(odometry.translation.vector), 1.0, [230, 140, 0]);
            }
            EntryKind::Scan { scan, .. } => {
                for echo in scan.echo_points() {
                    picture.dot(map_from_robot * Point2::from(echo), 1.0, [220, 60, 60]);
                }
            }
            _ => {}
        }
    }
    picture.scene(&world.at(0.0));
    std::fs::write(out, picture.png())?;
    Ok(())
}

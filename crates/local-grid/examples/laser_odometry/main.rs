//! Carries a robot's pose through a laser log by matching each scan to the map of the scans before it.
//!
//! ```text
//! cargo run --release -p local-grid --example laser_odometry -- LOG [--relations FILE] [--map OUT.pgm] [--drift SEED]
//! ```
//!
//! Reads CARMEN `FLASER` lines (plain or gzip), the `L` lines of Wean Hall, and CoreSLAM's tables of ticks and ranges.
//! With `--drift` the odometry is spoilt first by 2 % of distance and 1° per metre, as for logs that were corrected.
#![expect(clippy::print_stdout, reason = "an example says what it found")]

mod io;

use std::error::Error;
use std::time::Instant;

use io::{Log, Relation, drifted, read_log, read_relations, write_pgm};
use local_grid::nalgebra::{Isometry2, Matrix3, UnitComplex};
use local_grid::{
    LocalMap, LocalMapError, LocalMapOptions, MatchOptions, Prior, StructureOptions, TrackOptions, WallCompass,
    WallCompassOptions, echoes, judge, track, wall_direction_of_echoes,
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|k| arguments.get(k + 1));
    let path = arguments.first().ok_or("which log? see the top of this example")?;
    let mut log = read_log(path)?;
    let truth: Vec<Isometry2<f64>> = log.iter().map(|entry| entry.odom_from_robot).collect();
    if let Some(seed) = value("--drift") {
        drifted(&mut log, seed.parse()?);
    }
    let start = Instant::now();
    let known = arguments.iter().any(|argument| argument == "--known");
    let (poses, map) = carry(&log, known)?;
    let seconds = start.elapsed().as_secs_f64();
    println!("{} scans in {seconds:.3} s ({:.0} µs each)", log.len(), 1e6 * seconds / log.len() as f64);
    sharpness(&log, &poses, &map);
    if let Some(file) = value("--relations") {
        report(&log, &poses, &read_relations(file)?);
    }
    if value("--drift").is_some() {
        let raw: Vec<_> = log.iter().map(|entry| entry.odom_from_robot).collect();
        println!("ATE {:.3} m, raw {:.3} m", ate(&poses, &truth), ate(&raw, &truth));
    }
    if let Some(file) = value("--map") {
        write_pgm(file, &map.to_grid()?)?;
    }
    if let Some(file) = value("--trajectory") {
        io::write_trajectory(file, &log, &poses)?;
    }
    Ok(())
}

/// The pose at every scan, and the map at the end.
type Carried = (Vec<Isometry2<f64>>, LocalMap);

fn carry(log: &[Log], known: bool) -> Result<Carried, LocalMapError> {
    let options = TrackOptions::default();
    let mut map = LocalMap::new(LocalMapOptions::default())?;
    let mut poses: Vec<Isometry2<f64>> = Vec::with_capacity(log.len());
    let mut compass = WallCompass::new(WallCompassOptions::default());
    let mut drawn_at: Option<Isometry2<f64>> = None;
    for (k, entry) in log.iter().enumerate() {
        let pose = match poses.last() {
            _ if known => entry.odom_from_robot,
            None => entry.odom_from_robot,
            Some(before) => {
                let step = log[k - 1].odom_from_robot.inv_mul(&entry.odom_from_robot);
                let seen = echoes(&entry.scan, 30.0);
                let mut pose = track(&map, &seen, &odometry(before, &step), &options).map_from_robot;
                if let Some(walls) = wall_direction_of_echoes(&seen, &StructureOptions::default()) {
                    let turn = compass.sight(&walls, pose.rotation.angle());
                    pose.rotation *= UnitComplex::new(turn);
                }
                pose
            }
        };
        let far = drawn_at.is_none_or(|last| {
            let moved = last.inv_mul(&pose);
            moved.translation.vector.norm() > 0.1 || moved.rotation.angle().abs() > 0.1
        });
        if far {
            map.insert(&pose, &entry.scan)?;
            drawn_at = Some(pose);
        }
        poses.push(pose);
    }
    Ok((poses, map))
}

/// How well all scans agree with the finished map, and how many cells its walls take: doubled walls take more.
fn sharpness(log: &[Log], poses: &[Isometry2<f64>], map: &LocalMap) {
    let fit = |(entry, pose): (&Log, &Isometry2<f64>)| {
        judge(map, &echoes(&entry.scan, 30.0), pose, &MatchOptions::default()).score
    };
    let score = log.iter().zip(poses).map(fit).sum::<f64>() / log.len() as f64;
    println!("walls take {} cells, scans fit the finished map with score {score:.4}", map.walls().count());
}

/// Where odometry puts the robot, and how far it is trusted: a tenth of each step and turn, and 2° per metre.
fn odometry(map_from_before: &Isometry2<f64>, step: &Isometry2<f64>) -> Prior {
    let (metres, turn) = (step.translation.vector.norm(), step.rotation.angle().abs());
    let (position, heading) = (0.02 + 0.1 * metres, 0.02 + 0.1 * turn + 0.035 * metres);
    let information = Matrix3::from_diagonal(&[position.powi(-2), position.powi(-2), heading.powi(-2)].into());
    Prior { map_from_robot: map_from_before * step, information }
}

/// Mean absolute errors against true relations (Kuemmerle et al. 2009).
fn report(log: &[Log], poses: &[Isometry2<f64>], relations: &[Relation]) {
    for least in [0.0, 15.0] {
        let (mut n, mut metres, mut radians) = (0.0, 0.0, 0.0);
        for relation in relations.iter().filter(|relation| (relation.to - relation.from).abs() > least) {
            let at = |stamp| io::interpolate(log, poses, stamp);
            let (Some(from), Some(to)) = (at(relation.from), at(relation.to)) else { continue };
            let error = relation.from_pose_to.inv_mul(&from.inv_mul(&to));
            n += 1.0;
            metres += error.translation.vector.norm();
            radians += error.rotation.angle().abs();
        }
        println!(
            "relations over {least:>2} s: {n} of them, mean {:.4} m, {:.2}°",
            metres / n,
            (radians / n).to_degrees()
        );
    }
}

/// Root mean square distance after the best rigid alignment.
fn ate(poses: &[Isometry2<f64>], truth: &[Isometry2<f64>]) -> f64 {
    let n = poses.len() as f64;
    let mean = |path: &[Isometry2<f64>]| {
        path.iter().map(|p| p.translation.vector).sum::<local_grid::nalgebra::Vector2<f64>>() / n
    };
    let (centre, true_centre) = (mean(poses), mean(truth));
    let pairs =
        || poses.iter().zip(truth).map(|(p, q)| (p.translation.vector - centre, q.translation.vector - true_centre));
    let (sin, cos) = pairs().fold((0.0, 0.0), |(sin, cos), (p, q)| (sin + p.perp(&q), cos + p.dot(&q)));
    let turn = local_grid::nalgebra::Rotation2::new(f64::atan2(sin, cos));
    (pairs().map(|(p, q)| (turn * p - q).norm_squared()).sum::<f64>() / n).sqrt()
}

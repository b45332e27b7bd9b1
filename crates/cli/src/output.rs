use std::io::{self, Write};

use hierarchy::Mapper;
use nalgebra::Isometry2;

use crate::commands::run::Finished;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::map_folder;
use crate::render::topology;
use crate::run_folder::RunFolder;

/// Writes everything that a finished map holds, except its metrics, which know how long this took.
pub(crate) fn write(folder: &mut RunFolder, finished: &Finished) -> Result<(), Failure> {
    let Finished { mapper, gridmap, regions, .. } = finished;
    write_map(folder, finished)?;
    let atlas = mapper.atlas().map_err(|error| Failure::new(Exit::Failed, "map", error.to_string()))?;
    folder.write("topology.svg", "the topological map before and after relaxation", |out| {
        out.write_all(topology::before_and_after(&atlas).as_bytes())
    })?;
    folder.write("topology.g2o", "the same as a graph of places and links", |mut out| {
        relaxation::g2o::write(&mapper.graph(), &mut out).map_err(io::Error::other)
    })?;
    if !regions.regions.is_empty() {
        let free = gridmap.map(|cell| cell.empty);
        folder.write("regions.geojson", "rooms, corridors and gateways", |mut out| {
            region_map::export::write_geojson(&mut out, regions, &Isometry2::identity())
        })?;
        folder.write("regions.png", "the same to look at", |mut out| {
            region_map::export::write_picture(&mut out, regions, &free)
        })?;
    }
    let stamped = || mapper.trajectory().samples().iter().map(|sample| sample.stamp);
    folder
        .write("trajectory.tum", "the robot's path in the map", |out| write_tum(out, stamped().zip(mapper.poses())))?;
    folder.write("odometry.tum", "the path as the raw odometry has it", |out| {
        let raw = mapper.trajectory().samples().iter().map(|sample| sample.odom_from_robot);
        write_tum(out, stamped().zip(raw))
    })?;
    folder.write("loops.csv", "every closure that was weighed, and why it holds or not", |out| {
        write_loops(out, mapper)
    })?;
    folder.write("session.hmap", "the map to go on with: topogrid resume", |mut out| {
        mapper.save(&mut out).map_err(io::Error::other)
    })?;
    folder
        .write("config.toml", "the effective configuration", |out| out.write_all(mapper.config().to_toml().as_bytes()))
}

/// The gridmap for a map server, for people, and in layers without loss; what the map server will read is read back.
fn write_map(folder: &mut RunFolder, finished: &Finished) -> Result<(), Failure> {
    map_folder::write(folder.path(), &finished.gridmap, true)?;
    folder.note("map.yaml", "the gridmap for a map server, with map.pgm");
    folder.note("map.png", "the gridmap to look at: empty, occupied, contradictory, unexplored");
    folder.note("layers", "empty, occupied and what follows from them, 16 bit, with a legend");
    Ok(())
}

/// A trajectory as `stamp x y z qx qy qz qw`, seconds and metres.
fn write_tum(out: &mut dyn Write, poses: impl Iterator<Item = (f64, Isometry2<f64>)>) -> io::Result<()> {
    for (stamp, pose) in poses {
        let (at, half) = (pose.translation.vector, 0.5 * pose.rotation.angle());
        writeln!(out, "{stamp:.6} {:.6} {:.6} 0 0 0 {:.9} {:.9}", at.x, at.y, half.sin(), half.cos())?;
    }
    Ok(())
}

fn write_loops(out: &mut dyn Write, mapper: &Mapper) -> io::Result<()> {
    writeln!(out, "place,known,dx_m,dy_m,shift_m,score,accepted,reason")?;
    for closure in mapper.closures() {
        let vector = closure.displacement.vector;
        let accepted = matches!(closure.verdict, hierarchy::Verdict::Accepted { .. });
        writeln!(
            out,
            "{},{},{:.3},{:.3},{:.3},{:.3},{accepted},\"{}\"",
            closure.place.0, closure.known.0, vector.x, vector.y, closure.shift, closure.score, closure.verdict
        )?;
    }
    Ok(())
}

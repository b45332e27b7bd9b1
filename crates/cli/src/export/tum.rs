use std::io::{self, Write};

use hierarchy::Mapper;
use nalgebra::Isometry2;

/// The robot's path in the map.
pub(crate) fn write(out: &mut dyn Write, mapper: &Mapper) -> io::Result<()> {
    let stamps = mapper.trajectory().samples().iter().map(|sample| sample.stamp);
    write_path(out, stamps.zip(mapper.poses()))
}

/// A path as `stamp x y z qx qy qz qw`, seconds and metres.
pub(crate) fn write_path(out: &mut dyn Write, poses: impl Iterator<Item = (f64, Isometry2<f64>)>) -> io::Result<()> {
    for (stamp, pose) in poses {
        let (at, half) = (pose.translation.vector, 0.5 * pose.rotation.angle());
        writeln!(out, "{stamp:.6} {:.6} {:.6} 0 0 0 {:.9} {:.9}", at.x, at.y, half.sin(), half.cos())?;
    }
    Ok(())
}

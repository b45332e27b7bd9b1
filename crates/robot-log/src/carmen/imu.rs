use local_grid::Heading;

use super::CarmenOptions;
use super::params::{Param, Params};
use crate::entry::EntryKind;
use crate::error::Fault;
use crate::lines::Words;

/// `IMU acc_x acc_y acc_z q0 q1 q2 q3 mag_x mag_y mag_z gyro_x gyro_y gyro_z`: the heading is the yaw of the attitude
/// `q0 + q1 i + q2 j + q3 k`; no entry where the unit gives no attitude (all zero).
pub(super) fn heading(
    words: &mut Words<'_>,
    params: &Params,
    options: &CarmenOptions,
) -> Result<Option<EntryKind>, Fault> {
    words.skip(3, "the acceleration in metres per second squared")?;
    let at = words.clone().word();
    let mut attitude = [0.0; 4];
    for part in &mut attitude {
        *part = words.number("a part of the attitude's quaternion")?;
    }
    words.skip(6, "the magnetic field and the turn rates")?;
    let norm = attitude.iter().map(|part| part * part).sum::<f64>().sqrt();
    if norm == 0.0 {
        return Ok(None);
    }
    // Some units write six decimals, others three; far from 1 it is no rotation.
    if (norm - 1.0).abs() > 0.05 {
        return Err(words.not(at, format!("a quaternion of length 1 (this one has {norm:.3})")));
    }
    let [w, x, y, z] = attitude;
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    let deviation = params.of("IMU", Param::Deviation).filter(|deviation| *deviation > 0.0);
    let deviation = deviation.unwrap_or(options.heading_deviation);
    let heading = Heading::from_radians(yaw);
    let gyro = params.text("IMU", Param::Kind) == Some("gyro");
    Ok(Some(if gyro { EntryKind::Gyro { heading, deviation } } else { EntryKind::Heading { heading, deviation } }))
}

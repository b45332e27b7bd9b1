use std::sync::Arc;

use local_grid::nalgebra::Isometry2;
use local_grid::{RangeSensor, SensorError};

/// The sensors met so far, so that the scans of one sensor share its description.
#[derive(Debug, Default)]
pub(crate) struct Sensors {
    known: Vec<Known>,
}

#[derive(Debug)]
struct Known {
    tag: Vec<u8>,
    robot_from_sensor: Isometry2<f64>,
    /// Everything else that tells two sensors of one tag apart, as bits.
    key: Vec<u64>,
    sensor: Arc<RangeSensor>,
}

impl Sensors {
    /// No robot has more; a log that changes its sensor with every line must not fill the memory.
    const LIMIT: usize = 64;

    /// The sensor of the messages `tag` with the properties `key`; `make` builds it when it is new.
    pub(crate) fn find(
        &mut self,
        tag: &[u8],
        key: &[f64],
        robot_from_sensor: Isometry2<f64>,
        make: impl FnOnce() -> Result<RangeSensor, SensorError>,
    ) -> Result<Arc<RangeSensor>, SensorError> {
        let same = |known: &Known| {
            known.tag == tag
                && known.key.len() == key.len()
                && known.key.iter().zip(key).all(|(a, b)| *a == b.to_bits())
        };
        // The sensor used last is the likeliest.
        if let Some(index) = self.known.iter().rposition(same) {
            return Ok(Arc::clone(&self.known[index].sensor));
        }
        let sensor = Arc::new(make()?);
        if self.known.len() == Self::LIMIT {
            self.known.remove(0);
        }
        let key = key.iter().map(|value| value.to_bits()).collect();
        self.known.push(Known { tag: tag.to_vec(), robot_from_sensor, key, sensor: Arc::clone(&sensor) });
        Ok(sensor)
    }

    /// Where the sensor of the messages `tag` was mounted when it was first met.
    pub(crate) fn mount(&self, tag: &[u8]) -> Option<Isometry2<f64>> {
        self.known.iter().find(|known| known.tag == tag).map(|known| known.robot_from_sensor)
    }
}

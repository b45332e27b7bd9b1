use std::sync::Arc;

use local_grid::nalgebra::{Isometry2, Vector2};
use local_grid::{RangeSensor, SensorKind};
use serde::Deserialize;

use super::DescriptionError;

/// A range sensor as a description writes it: free mounts, or a fan of rays from one mount.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorText {
    name: String,
    kind: SensorKind,
    /// The full width of a beam; a fan's default is the step between its rays.
    beam_width_deg: Option<f64>,
    range_m: (f64, f64),
    /// Metres ahead, metres to the left, degrees to the left, per beam.
    mounts: Option<Vec<(f64, f64, f64)>>,
    fan: Option<FanText>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FanText {
    /// Metres ahead, metres to the left, degrees to the left.
    #[serde(default)]
    mount: (f64, f64, f64),
    first_deg: f64,
    step_deg: f64,
    count: usize,
}

impl SensorText {
    pub(super) fn build(&self) -> Result<Arc<RangeSensor>, DescriptionError> {
        const MOST_BEAMS: usize = 100_000;
        let of = |name: &str, what: &str| DescriptionError::Content(format!("sensor `{name}` {what}"));
        let pose = |(ahead, left, deg): (f64, f64, f64)| Isometry2::new(Vector2::new(ahead, left), deg.to_radians());
        let (mounts, step): (Vec<_>, Option<f64>) = match (&self.mounts, &self.fan) {
            (Some(mounts), None) => (mounts.iter().map(|mount| pose(*mount)).collect(), None),
            (None, Some(fan)) if fan.count <= MOST_BEAMS => {
                #[expect(clippy::cast_precision_loss, reason = "at most MOST_BEAMS")]
                let bearing = |k: usize| (fan.first_deg + fan.step_deg * k as f64).to_radians();
                let ray = |k: usize| pose(fan.mount) * Isometry2::rotation(bearing(k));
                ((0..fan.count).map(ray).collect(), Some(fan.step_deg.abs()))
            }
            (None, Some(_)) => return Err(of(&self.name, "has too many rays")),
            _ => return Err(of(&self.name, "needs either `mounts` or `fan`")),
        };
        let width = self.beam_width_deg.or(step).ok_or_else(|| of(&self.name, "needs `beam_width_deg`"))?;
        let (min, max) = self.range_m;
        RangeSensor::new(&self.name, self.kind, mounts, width.to_radians(), min..=max)
            .map(Arc::new)
            .map_err(DescriptionError::Sensor)
    }
}

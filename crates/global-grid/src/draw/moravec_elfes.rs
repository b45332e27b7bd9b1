use local_grid::raster::ConeCells;
use local_grid::{Grid, GridFrame, Reading, Scan};
use nalgebra::Isometry2;

/// The constants of Moravec & Elfes' sonar map (1985; Elfes 1987).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct MoravecElfesOptions {
    /// `R_min`: nearer than this the sonar says nothing, in metres.
    pub nearest: f64,
    /// `ε`: the deviation of a range, in metres.
    pub deviation: f64,
    /// `w`: the full width of the cone, in radians.
    pub width: f64,
}

impl Default for MoravecElfesOptions {
    fn default() -> Self {
        Self { nearest: 0.43, deviation: 0.1, width: 30f64.to_radians() }
    }
}

impl MoravecElfesOptions {
    /// `E_r E_a`: how surely a cell before the reading is empty.
    #[must_use]
    pub fn empty(&self, distance: f64, bearing: f64, range: f64) -> f64 {
        let last = range - self.deviation;
        if !(self.nearest..=last).contains(&distance) || last <= self.nearest {
            return 0.0;
        }
        let share = (distance - self.nearest) / (last - self.nearest);
        (1.0 - share * share) * self.angular(bearing)
    }

    /// `O_r O_a`: how surely a cell at the reading is occupied, before it is normalised.
    #[must_use]
    pub fn occupied(&self, distance: f64, bearing: f64, range: f64) -> f64 {
        let off = (distance - range) / self.deviation;
        (1.0 - off * off).max(0.0) * self.angular(bearing)
    }

    /// `1 − (2θ/w)²`, not below 0.
    fn angular(&self, bearing: f64) -> f64 {
        let share = 2.0 * bearing / self.width;
        (1.0 - share * share).max(0.0)
    }
}

/// The map of Moravec & Elfes (1985): 1 occupied, −1 empty, 0 unknown. For comparison only.
///
/// For each reading `R` in turn, first `Emp ← Emp + p − Emp p` over the whole cone, with `p = E_r E_a`; then the occupied
/// part `O_r O_a (1 − Emp)` is normalised to a sum of 1 over the cone and united into `Occ`. A cell reads `Occ` where that is
/// not less than `Emp`, else `−Emp`. The rule depends on the order of the readings and on the size of the cells, so nothing
/// can be taken out again: the map is built at once. Readings without echo have no occupied part.
#[must_use]
pub fn moravec_elfes<'a>(
    frame: GridFrame,
    posed_scans: impl IntoIterator<Item = (&'a Isometry2<f64>, &'a Scan)>,
    options: &MoravecElfesOptions,
) -> Grid<f32> {
    let (mut empty, mut occupied) = (vec![0.0f64; frame.n_cells()], vec![0.0f64; frame.n_cells()]);
    for (map_from_robot, scan) in posed_scans {
        for beam in scan.beams() {
            let (range, echo) = match beam.reading {
                Reading::Echo(range) => (f64::from(range), true),
                Reading::NoEcho => (scan.sensor().max_range(), false),
                Reading::Invalid => continue,
            };
            let map_from_sensor = map_from_robot * beam.robot_from_sensor;
            let cone = ConeCells::new(&frame, &map_from_sensor, 0.5 * options.width, range + options.deviation);
            for (cell, distance, bearing) in cone.clone() {
                unite(&mut empty[cell], options.empty(distance, bearing, range));
            }
            let said = |(cell, distance, bearing)| (cell, options.occupied(distance, bearing, range));
            let left = |(cell, p): (usize, f64)| (cell, p * (1.0 - empty[cell]));
            let total: f64 = if echo { cone.clone().map(said).map(left).map(|(_, p)| p).sum() } else { 0.0 };
            if total > 0.0 {
                cone.map(said).map(left).for_each(|(cell, p)| unite(&mut occupied[cell], p / total));
            }
        }
    }
    #[expect(clippy::cast_possible_truncation, reason = "degrees in [−1, 1]")]
    let read = |(e, o): (f64, f64)| if o >= e { o as f32 } else { -e as f32 };
    let cells = empty.into_iter().zip(occupied).map(read).collect();
    Grid::from_cells(frame, cells).unwrap_or_else(|_| Grid::new(frame))
}

/// `a ← a + b − a b`.
fn unite(a: &mut f64, b: f64) {
    *a = 1.0 - (1.0 - *a) * (1.0 - b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use local_grid::{RangeSensor, SensorKind};
    use nalgebra::Point2;
    use std::sync::Arc;

    fn scan(range: f64) -> Scan {
        let sensor = RangeSensor::ring("sonar", SensorKind::Sonar, 1, 0.0, 0.5, 0.1..=6.0).unwrap();
        Scan::from_ranges(Arc::new(sensor), [range]).unwrap()
    }

    fn frame() -> GridFrame {
        GridFrame::new(Point2::new(-1.0, -3.0), 0.05, 120, 180).unwrap()
    }

    #[test]
    fn profiles_are_as_computed_by_hand() {
        let options = MoravecElfesOptions::default();
        let bearing = 5f64.to_radians();
        approx::assert_abs_diff_eq!(options.empty(1.0, 0.0, 2.0), 0.849_646, epsilon = 1e-6);
        approx::assert_abs_diff_eq!(options.empty(1.0, bearing, 2.0), 0.849_646 * 0.888_889, epsilon = 1e-6);
        assert_eq!(options.occupied(2.0, 0.0, 2.0), 1.0);
        assert_eq!(options.occupied(2.0, 0.3, 2.0), 0.0); // beyond the edge it stays at 0
    }

    #[test]
    fn one_echo_is_worth_one_occupied_cell() {
        let map = moravec_elfes(frame(), [(&Isometry2::identity(), &scan(2.0))], &MoravecElfesOptions::default());
        let occupied: f32 = map.cells().iter().filter(|&&cell| cell > 0.0).sum();
        approx::assert_abs_diff_eq!(occupied, 1.0, epsilon = 1e-3);
        assert!(*map.at(Point2::new(1.0, 0.0)).unwrap() < -0.8);
    }

    #[test]
    fn silence_makes_nothing_occupied() {
        let map = moravec_elfes(frame(), [(&Isometry2::identity(), &scan(9.0))], &MoravecElfesOptions::default());
        assert!(map.cells().iter().all(|&cell| cell <= 0.0) && map.cells().iter().any(|&cell| cell < 0.0));
    }
}

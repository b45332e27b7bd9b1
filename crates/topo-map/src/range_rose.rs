use local_grid::{Heading, Reading, Scan, SensorKind};
use nalgebra::{Isometry2, Point2};

/// How far one sees from a place in each of 48 directions of the map frame, every 7.5°.
///
/// A ring of 16 sensors fills it with three firings, turned by 7.5° each; a laser with one or two. The first direction
/// is east, the others follow counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeRose {
    center: Point2<f64>,
    ranges: [Option<f32>; RangeRose::DIRECTIONS],
}

impl RangeRose {
    /// How many directions there are.
    pub const DIRECTIONS: usize = 48;

    /// A rose around `center` that has seen nothing yet.
    #[must_use]
    pub fn new(center: Point2<f64>) -> Self {
        Self { center, ranges: [None; Self::DIRECTIONS] }
    }

    /// The point from which distances are measured, in the frame of the scans' poses.
    #[must_use]
    pub fn center(&self) -> Point2<f64> {
        self.center
    }

    /// Takes in a scan; where several beams look into one direction the shortest counts.
    ///
    /// Silence means the sensor's maximum range, except for infrared sensors, whose maximum is within arm's reach.
    pub fn add(&mut self, map_from_robot: &Isometry2<f64>, scan: &Scan) {
        let sensor = scan.sensor();
        for beam in scan.beams() {
            let range = match beam.reading {
                Reading::Echo(range) => f64::from(range),
                Reading::NoEcho if sensor.kind() != SensorKind::Infrared => sensor.max_range(),
                Reading::NoEcho | Reading::Invalid => continue,
            };
            let end = map_from_robot * (beam.robot_from_sensor * Point2::new(range, 0.0));
            let bin = Self::bin_of(Heading::of(end - self.center));
            #[expect(clippy::cast_possible_truncation, reason = "ranges are metres; f32 resolves micrometres")]
            let distance = (end - self.center).norm() as f32;
            let known = &mut self.ranges[bin];
            *known = Some(known.map_or(distance, |before| before.min(distance)));
        }
    }

    /// The share of directions into which some beam looked.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "at most 48")]
        let seen = self.ranges.iter().flatten().count() as f64;
        seen / 48.0
    }

    /// The heading of direction `bin`.
    #[must_use]
    pub fn heading(bin: usize) -> Heading {
        #[expect(clippy::cast_precision_loss, reason = "at most 48")]
        let turns = bin as f64 / Self::DIRECTIONS as f64;
        Heading::from_radians(turns * std::f64::consts::TAU)
    }

    /// The direction nearest to a heading.
    #[must_use]
    pub fn bin_of(heading: Heading) -> usize {
        let turns = heading.radians() / std::f64::consts::TAU;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..=48")]
        let bin = (turns.rem_euclid(1.0) * 48.0).round() as usize;
        bin % Self::DIRECTIONS
    }

    /// The distance in direction `bin` (any number, taken round the circle), in metres; where no beam looked, that of
    /// the nearest direction into which one did. Nothing seen at all counts as blocked: 0.
    #[must_use]
    pub fn range(&self, bin: usize) -> f32 {
        let n = Self::DIRECTIONS;
        (0..=n / 2)
            .find_map(|off| match (self.ranges[(bin + off) % n], self.ranges[(bin + n - off) % n]) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (one, None) | (None, one) => one,
            })
            .unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use local_grid::RangeSensor;

    use super::*;

    fn scan(kind: SensorKind, ranges: [f64; 16]) -> Scan {
        let ring = RangeSensor::ring("ring", kind, 16, 0.225, 0.4, 0.43..=6.45).unwrap();
        Scan::from_ranges(Arc::new(ring), ranges).unwrap()
    }

    #[test]
    fn three_firings_fill_all_directions() {
        let mut rose = RangeRose::new(Point2::new(1.0, 2.0));
        for firing in 0..3 {
            let pose = Isometry2::new(rose.center().coords, f64::from(firing) * 7.5_f64.to_radians());
            rose.add(&pose, &scan(SensorKind::Sonar, [1.0 + f64::from(firing); 16]));
        }
        approx::assert_relative_eq!(rose.coverage(), 1.0);
        for bin in 0..48 {
            #[expect(clippy::cast_precision_loss, reason = "0, 1 or 2")]
            let expected = 1.225 + (bin % 3) as f32;
            approx::assert_relative_eq!(rose.range(bin), expected, epsilon = 1e-5);
        }
    }

    #[test]
    fn gaps_take_the_nearer_and_shorter_neighbour() {
        let mut rose = RangeRose::new(Point2::origin());
        let mut ranges = [2.0; 16];
        ranges[1] = 1.0;
        rose.add(&Isometry2::identity(), &scan(SensorKind::Sonar, ranges));
        approx::assert_relative_eq!(rose.range(1), 2.225, epsilon = 1e-5);
        approx::assert_relative_eq!(rose.range(2), 1.225, epsilon = 1e-5);
        approx::assert_relative_eq!(rose.range(48 + 3), 1.225, epsilon = 1e-5);
    }

    #[test]
    fn silence_is_far_for_sonar_and_nothing_for_infrared() {
        let mut rose = RangeRose::new(Point2::origin());
        rose.add(&Isometry2::identity(), &scan(SensorKind::Infrared, [9.0; 16]));
        assert_eq!(rose.coverage(), 0.0);
        assert_eq!(rose.range(7), 0.0);
        rose.add(&Isometry2::identity(), &scan(SensorKind::Sonar, [9.0; 16]));
        approx::assert_relative_eq!(rose.range(7), 6.675, epsilon = 1e-5);
    }

    #[test]
    fn headings_and_bins_agree() {
        for bin in 0..48 {
            assert_eq!(RangeRose::bin_of(RangeRose::heading(bin)), bin);
        }
    }
}

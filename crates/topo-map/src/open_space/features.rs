use local_grid::{Cell, Grid, Heading};
use nalgebra::Point2;

use crate::RangeRose;

/// How many numbers the network looks at.
pub const N_FEATURES: usize = 11;

/// What the network looks at in one direction.
///
/// Seven ranges at −22.5° … +22.5° in steps of 7.5°, cut at 3 m and scaled to `[0, 1]`; the longest and the shortest of
/// them; and how occupied and how empty the working grid says the way ahead is, as means over a box.
pub type Features = [f32; N_FEATURES];

/// What the features are measured against.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct FeatureOptions {
    /// Ranges are cut here, in metres.
    pub clip: f32,
    /// Width of the box ahead, in metres.
    pub box_width: f64,
    /// Length of the box ahead, from the robot's centre, in metres.
    pub box_length: f64,
}

impl Default for FeatureOptions {
    fn default() -> Self {
        Self { clip: 3.0, box_width: 0.6, box_length: 1.2 }
    }
}

impl FeatureOptions {
    /// What is seen from the centre of `rose` in direction `bin`; `grid` must be in the frame of the rose.
    #[must_use]
    pub fn of<C: Cell>(&self, rose: &RangeRose, grid: &Grid<C>, bin: usize) -> Features {
        let mut features = [0.0; N_FEATURES];
        let n = RangeRose::DIRECTIONS;
        for (k, feature) in features[..7].iter_mut().enumerate() {
            *feature = rose.range(bin + n + k - 3).min(self.clip) / self.clip;
        }
        features[7] = features[..7].iter().copied().fold(0.0, f32::max);
        features[8] = features[..7].iter().copied().fold(1.0, f32::min);
        let (occupied, empty) = self.box_ahead(grid, rose.center(), RangeRose::heading(bin));
        (features[9], features[10]) = (occupied, empty);
        features
    }

    /// Mean occupancy and emptiness of the box ahead; unknown cells count as neither.
    fn box_ahead<C: Cell>(&self, grid: &Grid<C>, from: Point2<f64>, heading: Heading) -> (f32, f32) {
        let ahead = heading.unit_vector();
        let left = nalgebra::Vector2::new(-ahead.y, ahead.x);
        let step = grid.frame().resolution();
        let (mut occupied, mut empty, mut count) = (0.0, 0.0, 0.0_f32);
        let mut along = 0.5 * step;
        while along < self.box_length {
            let mut across = -0.5 * (self.box_width - step);
            while across <= 0.5 * self.box_width {
                if let Some(cell) = grid.at(from + ahead * along + left * across) {
                    let known = cell.known();
                    occupied += known.occupied;
                    empty += known.empty;
                }
                count += 1.0;
                across += step;
            }
            along += step;
        }
        (occupied / count.max(1.0), empty / count.max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use local_grid::{Fuzzy, GridFrame};

    use super::*;

    #[test]
    fn the_box_lies_ahead() {
        let frame = GridFrame::new(Point2::new(-3.0, -3.0), 0.1, 60, 60).unwrap();
        let mut grid = Grid::<Fuzzy>::new(frame);
        for row in 0..60 {
            for column in 0..60 {
                let center = frame.center(row, column);
                let cell = grid.get_mut(row, column).unwrap();
                *cell = if center.x > 0.0 {
                    Fuzzy { empty: 1.0, occupied: 0.0 }
                } else {
                    Fuzzy { empty: 0.0, occupied: 0.5 }
                };
            }
        }
        let rose = RangeRose::new(Point2::origin());
        let east = FeatureOptions::default().of(&rose, &grid, 0);
        approx::assert_relative_eq!(east[10], 1.0, epsilon = 1e-5);
        approx::assert_relative_eq!(east[9], 0.0, epsilon = 1e-5);
        let west = FeatureOptions::default().of(&rose, &grid, 24);
        approx::assert_relative_eq!(west[9], 0.5, epsilon = 1e-5);
    }
}

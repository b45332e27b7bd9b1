use global_grid::{Calculus, GridError, GridMap, GridOptions};
use local_grid::FuzzyGrid;

use crate::mapper::Mapper;

/// The gridmap that the same scans would make where the raw odometry believes them to have been taken.
///
/// It is what a map has to be better than: drawn as [`Mapper::gridmap`] draws, in the frame of the odometry.
///
/// # Errors
///
/// Nothing was sensed, or the path runs farther than a dense grid can reach.
pub fn odometry_map(mapper: &Mapper) -> Result<FuzzyGrid, GridError> {
    odometry_map_by(mapper, Calculus::Fuzzy)
}

/// The same, its readings fused by another calculus, as [`Mapper::gridmap_by`] fuses them.
///
/// # Errors
///
/// As [`odometry_map`].
pub fn odometry_map_by(mapper: &Mapper, calculus: Calculus) -> Result<FuzzyGrid, GridError> {
    let mut grid = GridMap::new(GridOptions { calculus, ..mapper.config().grid.options() })?;
    for (key, sample) in (0..).zip(mapper.trajectory().samples()) {
        grid.insert(key, &sample.odom_from_robot, &sample.scan)?;
    }
    grid.to_grid()
}

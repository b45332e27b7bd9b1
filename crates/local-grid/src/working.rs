use nalgebra::{Isometry2, Point2};

use crate::signature::SignatureOptions;
use crate::{Cell, Evidence, FrameError, Grid, GridFrame, Scan, SensorModel, Signature};

/// How large a window the robot carries along, and how finely it is cut.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct WorkingGridOptions {
    /// Edge of the square window in metres. It must hold the sensors' useful range around a place and the way between
    /// two places: about 6 m for sonar, more for a laser.
    pub size: f64,
    /// Edge of a cell in metres.
    pub resolution: f64,
}

impl Default for WorkingGridOptions {
    fn default() -> Self {
        Self { size: 8.4, resolution: 0.1 } // a signature of 6.4 m at any point within 1 m of the robot
    }
}

/// A window of evidence that rolls along with the robot, in the `odom` frame: the working memory in which places are seen.
///
/// Its axes are those of `odom`, which the caller keeps turned like the map (by compass, or by an estimated heading); only
/// its corner moves, in whole cells, so nothing is ever resampled. What falls behind the border is forgotten.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkingGrid<C: Cell> {
    grid: Grid<C>,
}

impl<C: Cell> WorkingGrid<C> {
    /// An empty window around `center`.
    ///
    /// # Errors
    ///
    /// A size or resolution out of which no grid can be made.
    pub fn new(options: &WorkingGridOptions, center: Point2<f64>) -> Result<Self, FrameError> {
        let square = GridFrame::covering(Point2::origin(), Point2::new(options.size, 0.0), options.resolution)?;
        let cells = square.columns().saturating_sub(1).max(1); // `covering` holds its far border, too
        let corner = corner_around(center, options.resolution, cells);
        Ok(Self { grid: Grid::new(GridFrame::new(corner, options.resolution, cells, cells)?) })
    }

    /// The window as it lies now, in the `odom` frame.
    #[must_use]
    pub fn grid(&self) -> &Grid<C> {
        &self.grid
    }

    /// Rolls the window to the robot and fuses `scan`, taken where `odom_from_robot` puts the robot.
    ///
    /// # Errors
    ///
    /// A pose that is not finite.
    pub fn integrate(
        &mut self,
        model: &impl SensorModel,
        odom_from_robot: &Isometry2<f64>,
        scan: &Scan,
    ) -> Result<(), FrameError> {
        self.roll_to(Point2::from(odom_from_robot.translation.vector))?;
        self.grid.integrate(model, odom_from_robot, scan);
        Ok(())
    }

    /// Rolls the window so that `center` lies in its middle, to within half a cell; known cells keep their places.
    ///
    /// # Errors
    ///
    /// A point that is not finite.
    pub fn roll_to(&mut self, center: Point2<f64>) -> Result<(), FrameError> {
        let frame = *self.grid.frame();
        let cells = frame.columns();
        let corner = corner_around(center, frame.resolution(), cells);
        let steps = (corner - frame.origin()) / frame.resolution();
        if steps.x.abs() < 0.5 && steps.y.abs() < 0.5 {
            return Ok(());
        }
        let mut rolled = Grid::new(GridFrame::new(corner, frame.resolution(), cells, cells)?);
        copy_shifted(&self.grid, &mut rolled, steps.x, steps.y);
        self.grid = rolled;
        Ok(())
    }

    /// What is known around `odom_from_place`, as the signature of a place there.
    ///
    /// Cells are taken over as they are: the place may lie anywhere in a cell, and the signature keeps where.
    #[must_use]
    pub fn signature(&self, odom_from_place: Point2<f64>, options: &SignatureOptions) -> Signature {
        Signature::cut(&self.grid, odom_from_place, options)
    }

    /// What is known at a point of the `odom` frame; nothing outside the window.
    #[must_use]
    pub fn known_at(&self, point: Point2<f64>) -> Evidence {
        self.grid.at(point).map_or_else(Evidence::default, Cell::known)
    }
}

/// The lattice corner from which `cells` cells lie evenly around `center`.
fn corner_around(center: Point2<f64>, resolution: f64, cells: usize) -> Point2<f64> {
    #[expect(clippy::cast_precision_loss, reason = "a window has few cells")]
    let half = 0.5 * cells as f64;
    Point2::from((center.coords / resolution).map(|at| (at - half).round()) * resolution)
}

/// Copies what two grids of one lattice have in common; `to` begins so many columns and rows after `from`.
#[expect(clippy::cast_possible_truncation, reason = "saturates, and then nothing is in common")]
fn copy_shifted<C: Copy>(from: &Grid<C>, to: &mut Grid<C>, columns: f64, rows: f64) {
    let (dx, dy) = (columns.round() as i64, rows.round() as i64);
    let n = from.frame().columns();
    let Ok(width) = i64::try_from(n) else { return };
    let kept = width.saturating_sub(dx.saturating_abs()).max(0);
    let (Ok(kept), Ok(source), Ok(target)) =
        (usize::try_from(kept), usize::try_from(dx.max(0)), usize::try_from((-dx).max(0)))
    else {
        return;
    };
    if kept == 0 {
        return;
    }
    for row in 0..to.frame().rows() {
        let below =
            i64::try_from(row).ok().and_then(|row| row.checked_add(dy)).and_then(|row| usize::try_from(row).ok());
        let Some(old) = below.filter(|&old| old < from.frame().rows()) else { continue };
        let kept_cells = &from.cells()[old * n + source..old * n + source + kept];
        to.cells_mut()[row * n + target..row * n + target + kept].copy_from_slice(kept_cells);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Fuzzy;

    fn window() -> WorkingGrid<Fuzzy> {
        let options = WorkingGridOptions { size: 2.0, resolution: 0.1 };
        WorkingGrid::new(&options, Point2::origin()).unwrap()
    }

    fn mark(window: &mut WorkingGrid<Fuzzy>, point: Point2<f64>) {
        let (row, column) = window.grid.frame().cell_at(point).unwrap();
        window.grid.get_mut(row, column).unwrap().occupied = 1.0;
    }

    #[test]
    fn known_cells_keep_their_places_while_the_window_rolls() {
        let mut window = window();
        let wall = Point2::new(0.52, -0.31);
        mark(&mut window, wall);
        for center in [Point2::new(0.3, -0.2), Point2::new(-0.2, 0.4), Point2::new(0.44, 0.49)] {
            window.roll_to(center).unwrap();
            assert_eq!(window.known_at(wall).occupied, 1.0);
            assert_eq!(window.grid.cells().iter().filter(|cell| cell.occupied > 0.0).count(), 1);
        }
    }

    #[test]
    fn what_falls_behind_is_forgotten() {
        let mut window = window();
        let wall = Point2::new(0.52, -0.31);
        mark(&mut window, wall);
        window.roll_to(Point2::new(-3.0, 0.0)).unwrap();
        window.roll_to(Point2::new(0.0, 1e9)).unwrap();
        window.roll_to(Point2::origin()).unwrap();
        assert!(window.grid.cells().iter().all(|cell| *cell == Fuzzy::default()));
    }

    #[test]
    fn a_lost_pose_is_refused() {
        assert!(window().roll_to(Point2::new(f64::NAN, 0.0)).is_err() || window().roll_to(Point2::origin()).is_ok());
        assert!(window().roll_to(Point2::new(f64::INFINITY, 0.0)).is_err());
        assert!(
            WorkingGrid::<Fuzzy>::new(&WorkingGridOptions { size: 1e9, resolution: 1e-3 }, Point2::origin()).is_err()
        );
    }
}

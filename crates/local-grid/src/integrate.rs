//! How scans enter grids.

use nalgebra::Isometry2;

use crate::{Cell, Fuzzy, Grid, Scan, SensorModel, Union};

impl<C: Cell> Grid<C> {
    /// Fuses every beam of `scan`, taken where `grid_from_robot` puts the robot.
    ///
    /// Readings fall where the sensors' faces are, not the robot's centre. What lies outside the grid is left out.
    pub fn integrate(&mut self, model: &impl SensorModel, grid_from_robot: &Isometry2<f64>, scan: &Scan) {
        self.integrate_by(model, grid_from_robot, scan, C::fuse);
    }
}

impl Grid<Fuzzy> {
    /// As [`Grid::integrate`], with a union of choice.
    pub fn integrate_united(
        &mut self,
        model: &impl SensorModel,
        grid_from_robot: &Isometry2<f64>,
        scan: &Scan,
        union: Union,
    ) {
        self.integrate_by(model, grid_from_robot, scan, |cell, evidence| cell.unite(evidence, union));
    }
}

impl<C> Grid<C> {
    /// Draws every beam of `scan` and hands each piece of evidence with its cell to `fuse`.
    pub fn integrate_by(
        &mut self,
        model: &impl SensorModel,
        grid_from_robot: &Isometry2<f64>,
        scan: &Scan,
        mut fuse: impl FnMut(&mut C, crate::Evidence),
    ) {
        let frame = *self.frame();
        let cells = self.cells_mut();
        for beam in scan.beams() {
            let Some(sounding) = model.sounding(scan.sensor(), beam.reading) else { continue };
            let grid_from_sensor = grid_from_robot * beam.robot_from_sensor;
            model.draw(&frame, &grid_from_sensor, sounding, |index, evidence| fuse(&mut cells[index], evidence));
        }
    }
}

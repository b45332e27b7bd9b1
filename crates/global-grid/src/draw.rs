use local_grid::{Footprint, GridFrame, RangeSensor, Reading, Scan, SensorKind, SensorModel};
use nalgebra::{Isometry2, Point2};

use crate::calculus::Step;
use crate::tiles::{TILE, TILE_CELLS, Tiles, tile_of, within_tile};
use crate::{GridOptions, SonarModel};

/// Whether a scan's evidence is put into the map or taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    In,
    Out,
}

/// Draws a scan into the tiles, or out of them: the second undoes the first exactly.
pub(crate) fn draw(
    tiles: &mut Tiles,
    options: &GridOptions,
    map_from_robot: &Isometry2<f64>,
    scan: &Scan,
    direction: Direction,
) {
    match (scan.sensor().kind(), &options.sonar) {
        (SensorKind::Sonar, SonarModel::Cone(model)) => each(tiles, options, model, map_from_robot, scan, direction),
        (SensorKind::Sonar, SonarModel::Regions(model)) => each(tiles, options, model, map_from_robot, scan, direction),
        (SensorKind::Laser | SensorKind::Infrared, _) => {
            each(tiles, options, &options.laser, map_from_robot, scan, direction);
        }
    }
}

fn each(
    tiles: &mut Tiles,
    options: &GridOptions,
    model: &impl SensorModel,
    map_from_robot: &Isometry2<f64>,
    scan: &Scan,
    direction: Direction,
) {
    for beam in scan.beams() {
        let Some(sounding) = model.sounding(scan.sensor(), beam.reading) else { continue };
        let map_from_sensor = map_from_robot * beam.robot_from_sensor;
        let (frame, corner) = frame_around(model.footprint(sounding), &map_from_sensor, options.resolution);
        model.draw(&frame, &map_from_sensor, sounding, |index, evidence| {
            let (row, column) = (index / frame.columns(), index % frame.columns());
            let cell = (corner.0 + cell_number(row), corner.1 + cell_number(column));
            deposit(tiles, cell, options.calculus.step(evidence), direction);
        });
    }
}

/// The cells around a footprint, and the `(row, column)` of the first of them in the whole plane.
fn frame_around(footprint: Footprint, map_from_sensor: &Isometry2<f64>, resolution: f64) -> (GridFrame, (i32, i32)) {
    let (Footprint::Ray { reach } | Footprint::Cone { reach, .. }) = footprint;
    let sensor = map_from_sensor.translation.vector;
    let low = sensor.map(|at| ((at - reach) / resolution).floor() - 1.0);
    #[expect(clippy::cast_possible_truncation, reason = "poses and ranges are checked at the door")]
    let corner = (low.y as i32, low.x as i32);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "ranges are checked at the door")]
    let edge = (2.0 * reach / resolution).ceil() as usize + 3;
    let frame = GridFrame::new(Point2::from(low * resolution), resolution, edge, edge)
        .expect("the resolution was checked by the options, poses and ranges at the door");
    (frame, corner)
}

fn deposit(tiles: &mut Tiles, (row, column): (i32, i32), step: Step, direction: Direction) {
    let slot = tiles.slot((tile_of(row), tile_of(column)));
    let at = within_tile(row) * TILE + within_tile(column);
    debug_assert!(at < TILE_CELLS);
    let (empty, occupied) = tiles.tile_mut(slot).planes_mut();
    for (sum, step) in [(&mut empty[at], step.empty), (&mut occupied[at], step.occupied)] {
        *sum = match direction {
            Direction::In => sum.wrapping_add(u32::from(step)),
            Direction::Out => sum.wrapping_sub(u32::from(step)),
        };
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "a footprint is a few thousand cells")]
fn cell_number(index: usize) -> i32 {
    index as i32
}

/// The longest that a beam of a scan can be drawn, in metres.
pub(crate) fn longest_reach(options: &GridOptions, sensor: &RangeSensor, readings: &[Reading]) -> f64 {
    let reach = |reading: &Reading| -> f64 {
        let footprint = match (sensor.kind(), &options.sonar) {
            (SensorKind::Sonar, SonarModel::Cone(model)) => {
                model.sounding(sensor, *reading).map(|s| model.footprint(s))
            }
            (SensorKind::Sonar, SonarModel::Regions(model)) => {
                model.sounding(sensor, *reading).map(|s| model.footprint(s))
            }
            _ => options.laser.sounding(sensor, *reading).map(|s| options.laser.footprint(s)),
        };
        footprint.map_or(0.0, |(Footprint::Ray { reach } | Footprint::Cone { reach, .. })| reach)
    };
    readings.iter().map(reach).fold(0.0, f64::max)
}

pub(crate) mod arcs;
pub(crate) mod cone;
pub(crate) mod counts;
pub(crate) mod echo_model;
pub(crate) mod fan;
pub(crate) mod moravec_elfes;
pub(crate) mod oriolo;
pub(crate) mod share;
pub(crate) mod sonar;
pub(crate) mod sums;
pub(crate) mod window;

use local_grid::{Evidence, Footprint, GridFrame, RangeSensor, Reading, Scan, SensorKind, SensorModel};
use nalgebra::{Isometry2, Point2};
use std::sync::Arc;

use crate::calculus::Step;
use crate::draw::cone::Opening;
use crate::draw::fan::{Fan, FanPen};
use crate::draw::oriolo::{ConeTables, Row};
use crate::draw::sonar::{model_of, sweep};
use crate::draw::sums::{Sums, Worth};
use crate::draw::window::Window;
use crate::plane::TILE;
use crate::{GridOptions, SonarModel};

/// Whether a scan's evidence is put into the map or taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    In,
    Out,
}

impl Direction {
    fn of(self, units: u16) -> u32 {
        self.signed(u32::from(units))
    }

    /// What is added to a count.
    #[inline]
    pub(crate) fn one(self) -> i8 {
        match self {
            Self::In => 1,
            Self::Out => -1,
        }
    }

    /// What is added to a sum that wraps.
    #[inline]
    pub(crate) fn signed(self, units: u32) -> u32 {
        match self {
            Self::In => units,
            Self::Out => units.wrapping_neg(),
        }
    }
}

/// Draws scans into sums, or out of them: the second undoes the first exactly.
#[derive(Debug, Clone)]
pub(crate) struct Pen {
    /// What a reading of a [`SharedEcho`](crate::SharedEcho) sonar, or of a laser, adds where it says most.
    sonar: Step,
    laser: Step,
    /// Kept from sonar to sonar, for empty and for occupied evidence.
    swept: Window,
    heard: Window,
    opening: Opening,
    window: Window,
    points: Window,
    /// Oriolo's cone, where the options ask for it.
    oriolo: Option<ConeTables>,
    row: Row,
    fan_pen: FanPen,
    known: Option<Arc<RangeSensor>>,
    fan: Option<Fan>,
}

impl Pen {
    /// A pen for maps of given options.
    pub(crate) fn new(options: &GridOptions) -> Self {
        let sonar = model_of(options).map_or(Step::default(), |model| most(options, model.empty, 0.0));
        let (empty, occupied) = (options.laser.empty, options.laser.occupied);
        let laser = Step { empty: most(options, empty, 0.0).empty, occupied: most(options, 0.0, occupied).occupied };
        let window = Window::default();
        let oriolo = match &options.sonar {
            SonarModel::Cone(model) => ConeTables::new(model, options),
            SonarModel::Shared(_) | SonarModel::Regions(_) => None,
        };
        Self {
            sonar,
            laser,
            oriolo,
            row: Row::default(),
            swept: Window::default(),
            heard: Window::default(),
            opening: Opening::default(),
            window,
            points: Window::default(),
            fan_pen: FanPen::default(),
            known: None,
            fan: None,
        }
    }

    /// What a count of the sums that are drawn into is worth.
    pub(crate) fn worth(&self) -> Worth {
        Worth { swept: self.sonar.empty.into(), cleared: self.laser.empty.into(), hit: self.laser.occupied.into() }
    }

    /// Forgets where tiles are kept, after some were released.
    pub(crate) fn forget_tiles(&mut self) {
        self.fan_pen.forget_tiles();
        self.swept = Window::default();
        self.heard = Window::default();
    }

    /// Draws one scan.
    pub(crate) fn draw(
        &mut self,
        sums: &mut Sums,
        options: &GridOptions,
        (map_from_robot, scan): (&Isometry2<f64>, &Scan),
        direction: Direction,
    ) {
        let posed = (map_from_robot, scan);
        match (scan.sensor().kind(), &options.sonar) {
            (SensorKind::Sonar, SonarModel::Shared(model)) => {
                let pens = (&mut self.swept, &mut self.opening);
                sweep(&mut sums.swept, pens, (model, options.resolution), posed, direction);
            }
            (SensorKind::Sonar, SonarModel::Cone(model)) => match &self.oriolo {
                Some(tables) => {
                    tables.draw(sums, (&mut self.swept, &mut self.heard, &mut self.row), posed, direction);
                }
                None => self.each(sums, options, model, posed, direction),
            },
            (SensorKind::Sonar, SonarModel::Regions(model)) => self.each(sums, options, model, posed, direction),
            (SensorKind::Laser | SensorKind::Infrared, _) => self.rays(sums, options, posed, direction),
        }
    }

    /// The most that a scan can add to one cell, empty and occupied, in units.
    pub(crate) fn most_of(&mut self, options: &GridOptions, scan: &Scan) -> (u32, u32) {
        let n_beams = u32::try_from(scan.readings().len()).unwrap_or(u32::MAX);
        let (step, times) = match (scan.sensor().kind(), &options.sonar) {
            (SensorKind::Sonar, SonarModel::Shared(_)) => (self.sonar, n_beams),
            (SensorKind::Sonar, SonarModel::Cone(_) | SonarModel::Regions(_)) => {
                (Step { empty: most(options, 1.0, 0.0).empty, occupied: most(options, 0.0, 1.0).occupied }, n_beams)
            }
            // The beams of a fan may hit a cell, miss it, and hit it again; more often only by freak.
            _ if scan.sweep().is_none() && self.fan_of(scan.sensor()).is_some() => (self.laser, 4.min(n_beams)),
            _ => (self.laser, n_beams),
        };
        (times.saturating_mul(step.empty.into()), times.saturating_mul(step.occupied.into()))
    }

    /// The fan of a sensor, if its beams stand side by side; worked out once for many scans of one sensor.
    fn fan_of(&mut self, sensor: &Arc<RangeSensor>) -> Option<&Fan> {
        if !self.known.as_ref().is_some_and(|known| Arc::ptr_eq(known, sensor)) {
            let same = self.known.as_ref().is_some_and(|known| known == sensor);
            if !same {
                self.fan = Fan::new(sensor);
            }
            self.known = Some(sensor.clone());
        }
        self.fan.as_ref()
    }

    /// Draws a laser scan: as one area if its beams stand side by side, otherwise ray by ray.
    fn rays(&mut self, sums: &mut Sums, options: &GridOptions, posed: (&Isometry2<f64>, &Scan), direction: Direction) {
        self.fan_of(posed.1.sensor());
        let at_once = posed.1.sweep().is_none(); // what swept while the robot moved starts at more than one point
        let Some(fan) = self.fan.as_ref().filter(|_| at_once) else {
            return self.each(sums, options, &options.laser, posed, direction);
        };
        self.fan_pen.draw(
            (&mut sums.cleared, &mut sums.hit),
            fan,
            (&options.laser, options.resolution),
            posed,
            direction,
        );
    }

    /// Draws beam by beam and cell by cell, as the model says: exact, and slow.
    fn each(
        &mut self,
        sums: &mut Sums,
        options: &GridOptions,
        model: &impl SensorModel,
        (map_from_robot, scan): (&Isometry2<f64>, &Scan),
        direction: Direction,
    ) {
        for beam in scan.beams() {
            let Some(sounding) = model.sounding(scan.sensor(), beam.reading) else { continue };
            let map_from_sensor = map_from_robot * beam.robot_from_sensor;
            let (frame, corner) = frame_around(model.footprint(sounding), &map_from_sensor, options.resolution);
            let end = (corner.0 + cell_number(frame.rows()), corner.1 + cell_number(frame.columns()));
            self.window.open(corner, end);
            self.points.open(corner, end);
            model.draw(&frame, &map_from_sensor, sounding, |index, evidence| {
                let (row, column) = (index / frame.columns(), index % frame.columns());
                let cell = (corner.0 + cell_number(row), corner.1 + cell_number(column));
                self.deposit(sums, cell, options.calculus.step(evidence), direction);
            });
        }
    }

    fn deposit(&mut self, sums: &mut Sums, (row, column): (i32, i32), step: Step, direction: Direction) {
        if step.empty > 0 {
            self.window.add_span(&mut sums.empty, row, (column, column + 1), direction.of(step.empty));
        }
        if step.occupied > 0 {
            let (slot, place) = self.points.cell(&mut sums.occupied, row, column);
            let sum = &mut sums.occupied.tile_mut(slot)[place];
            *sum = sum.wrapping_add(direction.of(step.occupied));
        }
    }
}

/// What one reading adds to a cell of which it says so much.
fn most(options: &GridOptions, empty: f64, occupied: f64) -> Step {
    #[expect(clippy::cast_possible_truncation, reason = "degrees in [0, 1]")]
    let evidence = Evidence { empty: empty as f32, occupied: occupied as f32 };
    options.calculus.step(evidence)
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

#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "a footprint is a few thousand cells")]
fn cell_number(index: usize) -> i32 {
    debug_assert!(index < TILE * TILE * TILE);
    index as i32
}

/// The longest that a beam of a scan can be drawn, in metres.
pub(crate) fn longest_reach(options: &GridOptions, sensor: &Arc<RangeSensor>, readings: &[Reading]) -> f64 {
    let reach = |reading: &Reading| -> f64 {
        let footprint = match (sensor.kind(), &options.sonar) {
            (SensorKind::Sonar, SonarModel::Shared(model)) => footprint(model, sensor, *reading),
            (SensorKind::Sonar, SonarModel::Cone(model)) => footprint(model, sensor, *reading),
            (SensorKind::Sonar, SonarModel::Regions(model)) => footprint(model, sensor, *reading),
            _ => footprint(&options.laser, sensor, *reading),
        };
        footprint.map_or(0.0, |(Footprint::Ray { reach } | Footprint::Cone { reach, .. })| reach)
    };
    readings.iter().map(reach).fold(0.0, f64::max)
}

fn footprint(model: &impl SensorModel, sensor: &RangeSensor, reading: Reading) -> Option<Footprint> {
    model.sounding(sensor, reading).map(|sounding| model.footprint(sounding))
}

/// Whether a scan's echoes are shared out.
pub(crate) fn shares_echoes(options: &GridOptions, scan: &Scan) -> bool {
    scan.sensor().kind() == SensorKind::Sonar && model_of(options).is_some()
}

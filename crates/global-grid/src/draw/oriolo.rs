use local_grid::{Scan, SensorModel, SonarCone, Sounding};
use nalgebra::Isometry2;

use crate::Calculus;
use crate::draw::Direction;
use crate::draw::cone::{Cone, nearest};
use crate::draw::sonar::{cells, open, step};
use crate::draw::sums::Sums;
use crate::draw::window::Window;
use crate::options::GridOptions;
use crate::plane::{Plane, TILE, within};
use crate::tally::{STRONGEST_EVIDENCE, UNITS_PER_NAT, nats};

/// The widest half cone, in radians, that [`Cone`] can bound.
const WIDEST: f64 = 1.5;
/// Steps of a table. Between them values are interpolated, which costs less than a unit of evidence.
const STEPS: usize = 2048;

/// Oriolo's cone, drawn from tables: what [`SonarCone`] says of every cell, to within two units of evidence (`10⁻⁴` nat).
///
/// The model is a product of three profiles: one of the angle, one of the distance, and one of the distance from the
/// reading. The first two cost a Bessel function and an exponential, so they are tabulated, the first over `sin²θ`, which a
/// cell has without a trigonometric function; so is the logarithm that turns degrees into nats. Which cells lie in the cone
/// is decided in single precision: a cell whose centre lies on the edge, to a ten-thousandth of a cell, may fall to
/// either side.
#[derive(Debug, Clone)]
pub(crate) struct ConeTables {
    model: SonarCone,
    calculus: Calculus,
    half_width: (f64, f64),
    resolution: f64,
    /// `D` over `sin²θ`.
    angular: Table,
    /// `m_v` over the distance in cells.
    visibility: Table,
    /// Units of evidence over degrees: `−ln(1 − p)`, or what belief in one side is worth in log-odds.
    units: Table,
}

/// What one reading adds to the cells of a row, empty and occupied, in units.
#[derive(Debug, Clone, Default)]
pub(crate) struct Row {
    empty: Vec<u32>,
    occupied: Vec<u32>,
}

impl ConeTables {
    /// The tables of a model, or `None` where its cone is too wide.
    pub(crate) fn new(model: &SonarCone, options: &GridOptions) -> Option<Self> {
        if model.half_width > WIDEST {
            return None;
        }
        let resolution = options.resolution;
        let sight = footprint_reach(model, Sounding { range: f64::MAX, echo: false }) / resolution;
        let worth = |degree: f64| match options.calculus {
            Calculus::Bayes => ((1.0 + degree) / (1.0 - degree)).ln(),
            Calculus::Fuzzy | Calculus::DempsterShafer => nats(degree),
        };
        Some(Self {
            angular: Table::new(model.half_width.sin().powi(2), |square| model.angular(square.sqrt().asin())),
            visibility: Table::new(sight, |distance| model.visibility_at(distance * resolution)),
            units: Table::new(STRONGEST_EVIDENCE, |degree| worth(degree) * UNITS_PER_NAT),
            half_width: model.half_width.sin_cos(),
            model: model.clone(),
            calculus: options.calculus,
            resolution,
        })
    }

    /// Draws a scan.
    pub(crate) fn draw(
        &self,
        sums: &mut Sums,
        (swept, points, row): (&mut Window, &mut Window, &mut Row),
        (map_from_robot, scan): (&Isometry2<f64>, &Scan),
        direction: Direction,
    ) {
        for beam in scan.beams() {
            let Some(sounding) = self.model.sounding(scan.sensor(), beam.reading) else { continue };
            let cone = Cone::new(&(map_from_robot * beam.robot_from_sensor), self.half_width, self.resolution);
            let reach = cells(footprint_reach(&self.model, sounding), self.resolution);
            let rows = open(swept, &cone, (0.0, reach)).0;
            let inner = (cells(sounding.range - self.model.depth, self.resolution)).clamp(0.0, reach);
            open(points, &cone, (if sounding.echo { inner } else { reach }, reach));
            let profile = Profile::new(self, &cone, sounding);
            let mut first = rows.0;
            while first < rows.1 {
                for (line, span) in (first..rows.1).zip(cone.spans(first, reach)).filter(|(_, span)| span.0 < span.1) {
                    let occupied = profile.fill(row, &cone, line, span);
                    let at = (cone.cell.0 + line, cone.cell.1 + span.0);
                    swept.add_values(&mut sums.empty, at, &row.empty, direction);
                    if occupied {
                        add_points(&mut sums.occupied, points, at, &row.occupied, direction);
                    }
                }
                first += step();
            }
        }
    }
}

/// How far from the sensor's face a sounding says anything, in metres.
fn footprint_reach(model: &SonarCone, sounding: Sounding) -> f64 {
    let (local_grid::Footprint::Ray { reach } | local_grid::Footprint::Cone { reach, .. }) = model.footprint(sounding);
    reach
}

/// One reading's profile; lengths in cells.
struct Profile<'t> {
    tables: &'t ConeTables,
    axis: (f32, f32),
    range: f32,
    per_depth: f32,
    empty: f32,
    occupied: f32,
}

impl<'t> Profile<'t> {
    fn new(tables: &'t ConeTables, cone: &Cone, sounding: Sounding) -> Self {
        let model = &tables.model;
        Self {
            tables,
            axis: cone.axis(),
            range: cells(sounding.range, tables.resolution),
            per_depth: cells(model.depth, tables.resolution).recip(),
            empty: cells(model.empty, 1.0),
            occupied: if sounding.echo { cells(model.occupied, 1.0) } else { 0.0 },
        }
    }

    /// Works out what the cells of one row get, and says whether any of it is occupied evidence.
    fn fill(&self, row: &mut Row, cone: &Cone, line: i32, (first, last): (i32, i32)) -> bool {
        row.empty.clear();
        row.occupied.clear();
        let dy = cone.northing(line);
        let mut any = 0;
        for column in first..last {
            let dx = cone.easting(column);
            let square = dx * dx + dy * dy;
            let (distance, across) = (square.sqrt(), self.axis.0 * dy - self.axis.1 * dx);
            let sine_square = across * across / square.max(1e-12);
            let trust = self.tables.angular.at(sine_square) * self.tables.visibility.at(distance);
            let off = (self.range - distance) * self.per_depth;
            let near = off.clamp(0.0, 1.0);
            let empty = trust * self.empty * near * near;
            let occupied = trust * self.occupied * (1.0 - off * off).max(0.0);
            let (empty, occupied) = self.tables.step(empty, occupied);
            row.empty.push(empty);
            row.occupied.push(occupied);
            any |= occupied;
        }
        any > 0
    }
}

impl ConeTables {
    /// What degrees of evidence add to the sums of a cell, in units; see [`Calculus::step`].
    fn step(&self, empty: f32, occupied: f32) -> (u32, u32) {
        let units = |degree: f32| self.units.at(degree);
        let (empty, occupied) = match self.calculus {
            Calculus::Fuzzy => (units(empty), units(occupied)),
            Calculus::Bayes => {
                let log_odds = units((occupied - empty).abs());
                if occupied > empty { (0.0, log_odds) } else { (log_odds, 0.0) }
            }
            Calculus::DempsterShafer => {
                let both = units(empty + occupied); // ln(1 + e/(1 − e − o)) = ln(1 − o) − ln(1 − e − o)
                (both - units(occupied), both - units(empty))
            }
        };
        let whole = |units: f32| nearest(units.min(f32::from(u16::MAX))).unsigned_abs();
        (whole(empty), whole(occupied))
    }
}

/// A function on `[0, end]`, interpolated between equal steps.
#[derive(Debug, Clone)]
struct Table {
    /// Values, with one to spare behind the end.
    values: Vec<f32>,
    steps_per_unit: f32,
}

impl Table {
    #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, reason = "a table of f32 with few steps")]
    fn new(end: f64, of: impl Fn(f64) -> f64) -> Self {
        let value = |step: usize| of((step as f64 / STEPS as f64).min(1.0) * end) as f32;
        Self { values: (0..=STEPS + 1).map(value).collect(), steps_per_unit: (STEPS as f64 / end) as f32 }
    }

    /// The value at `x`; beyond the end that at the end, and below 0 that at 0.
    #[inline]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating by the language's rule")]
    fn at(&self, x: f32) -> f32 {
        let steps = x * self.steps_per_unit;
        let step = (steps as u32).min(STEPS as u32);
        #[expect(clippy::cast_precision_loss, reason = "a few thousand")]
        let share = (steps - step as f32).min(1.0);
        let (low, high) = (self.values[step as usize], self.values[step as usize + 1]);
        low + (high - low) * share
    }
}

/// Adds what a row of cells gets to a plane that holds sums as they are; `(row, column)` is the first of them.
fn add_points(plane: &mut Plane, window: &mut Window, (row, column): (i32, i32), units: &[u32], direction: Direction) {
    let mut left = units;
    let mut column = column;
    while let Some(skipped) = left.iter().position(|&units| units > 0) {
        column += count(skipped);
        let (now, later) = left[skipped..].split_at((left.len() - skipped).min(TILE - within(column)));
        let (slot, place) = window.cell(plane, row, column);
        for (sum, &units) in plane.tile_mut(slot)[place..].iter_mut().zip(now) {
            *sum = sum.wrapping_add(direction.signed(units));
        }
        column += count(now.len());
        left = later;
    }
}

fn count(cells: usize) -> i32 {
    i32::try_from(cells).expect("a row of a cone is a few thousand cells")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::sums::ALL_ROWS;
    use crate::plane::first_cell;
    use local_grid::{AngularProfile, GridFrame, RangeSensor, SensorKind};
    use nalgebra::{Point2, Vector2};
    use std::collections::BTreeMap;
    use std::sync::Arc;

    type Sum = BTreeMap<(i64, i64), (i64, i64)>;

    fn drawn(tables: &ConeTables, readings: &[(Isometry2<f64>, Scan)], directions: &[Direction]) -> Sum {
        let (mut sums, mut swept, mut points) = (Sums::default(), Window::default(), Window::default());
        for &direction in directions {
            for (pose, scan) in readings {
                let pens = (&mut swept, &mut points, &mut Row::default());
                tables.draw(&mut sums, pens, (pose, scan), direction);
            }
        }
        let mut found = Sum::new();
        sums.each_tile(None, ALL_ROWS, |key, tile| {
            for at in (0..TILE * TILE).filter(|&at| !tile.tally(at).is_unknown()) {
                let cell = |first: i32, offset: usize| first_cell(first) + i64::try_from(offset).unwrap();
                let tally = tile.tally(at);
                let sum = (i64::from(tally.empty), i64::from(tally.occupied));
                found.insert((cell(key.0, at / TILE), cell(key.1, at % TILE)), sum);
            }
        });
        found
    }

    /// The same readings by the model itself, cell by cell, in a frame of 400 × 400 cells about the origin.
    fn judged(model: &SonarCone, options: &GridOptions, readings: &[(Isometry2<f64>, Scan)]) -> Sum {
        let edge = -200.0 * options.resolution;
        let frame = GridFrame::new(Point2::new(edge, edge), options.resolution, 400, 400).unwrap();
        let mut found = Sum::new();
        for (pose, scan) in readings {
            for beam in scan.beams() {
                let Some(sounding) = model.sounding(scan.sensor(), beam.reading) else { continue };
                model.draw(&frame, &(pose * beam.robot_from_sensor), sounding, |index, evidence| {
                    let step = options.calculus.step(evidence);
                    let cell = |at: usize| i64::try_from(at).unwrap() - 200;
                    let sum = found.entry((cell(index / 400), cell(index % 400))).or_default();
                    *sum = (sum.0 + i64::from(step.empty), sum.1 + i64::from(step.occupied));
                });
            }
        }
        found
    }

    /// A ring of sonars at a few places, near a corner of tiles, with near and far echoes and silence.
    fn readings() -> Vec<(Isometry2<f64>, Scan)> {
        let ring = RangeSensor::ring("sonar", SensorKind::Sonar, 16, 0.225, 25f64.to_radians(), 0.1..=6.0).unwrap();
        let ring = Arc::new(ring);
        let scan = |k: u32| {
            let range = |beam: u32| 0.15 + f64::from((beam * 7 + k * 5) % 23) * 0.29; // up to 6.5 m, which is silence
            let pose = Isometry2::new(Vector2::new(0.317 * f64::from(k), -0.111), 0.07 + f64::from(k));
            (pose, Scan::from_ranges(ring.clone(), (0..16).map(range)).unwrap())
        };
        (0..8).map(scan).collect()
    }

    #[test]
    fn tables_say_what_the_model_says() {
        use AngularProfile::{CosineSquared, Flat, Parabola, PistonPower, PistonPressure};
        for profile in [PistonPower { ka: 17.38 }, PistonPressure { ka: 17.38 }, Parabola, CosineSquared, Flat] {
            for calculus in [Calculus::Fuzzy, Calculus::Bayes, Calculus::DempsterShafer] {
                let model = SonarCone { profile, ..SonarCone::default() };
                let options = GridOptions { calculus, ..GridOptions::default() };
                let tables = ConeTables::new(&model, &options).unwrap();
                for reading in readings() {
                    let reading = [reading];
                    let (drawn, judged) =
                        (drawn(&tables, &reading, &[Direction::In]), judged(&model, &options, &reading));
                    for cell in drawn.keys().chain(judged.keys()) {
                        let sum = |of: &Sum| of.get(cell).copied().unwrap_or_default();
                        let off = (sum(&drawn).0 - sum(&judged).0, sum(&drawn).1 - sum(&judged).1);
                        assert!(off.0.abs() <= 2 && off.1.abs() <= 2, "{profile:?} {calculus:?} {cell:?} {off:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn taking_out_undoes_putting_in() {
        let tables = ConeTables::new(&SonarCone::default(), &GridOptions::default()).unwrap();
        assert!(drawn(&tables, &readings(), &[Direction::In, Direction::Out]).is_empty());
        assert!(drawn(&tables, &readings(), &[Direction::In]).len() > 1000);
    }

    #[test]
    fn a_cone_wider_than_half_a_plane_is_left_to_the_model() {
        let wide = SonarCone { half_width: 1.6, ..SonarCone::default() };
        assert!(ConeTables::new(&wide, &GridOptions::default()).is_none());
    }
}

//! The quick ways of drawing say what the slow ones say.

use std::collections::BTreeMap;

use global_grid::local_grid::nalgebra::{Isometry2, Point2, Vector2};
use global_grid::local_grid::{Cell, FuzzyGrid, LaserRay, Reading, Scan, SensorModel, SonarCone, SonarRegions};
use global_grid::{Calculus, GridOptions, SharedEcho, SonarModel, assemble};

use crate::{dice, laser, pose, scan, sonars};

/// The plain union, so that cells can be compared with cells fused one by one.
fn plain() -> GridOptions {
    GridOptions { most_evidence: f64::INFINITY, ..GridOptions::default() }
}

/// Cells that the polygon of a laser scan must clear or spare, by looking at every cell of the plane.
fn cleared(
    options: &GridOptions,
    map_from_robot: &Isometry2<f64>,
    scan: &Scan,
    center: Point2<f64>,
    slack: f64,
) -> bool {
    let apex = map_from_robot * Point2::from(scan.sensor().mounts()[0].translation.vector);
    let to = center - apex;
    let nearest = scan.beams().min_by(|a, b| {
        let off = |beam: &global_grid::local_grid::Beam| {
            let axis = map_from_robot.rotation * beam.robot_from_sensor.rotation * Vector2::x();
            axis.angle(&to)
        };
        off(a).total_cmp(&off(b))
    });
    let beam = nearest.unwrap();
    let axis = map_from_robot.rotation * beam.robot_from_sensor.rotation * Vector2::x();
    let reach = match options.laser.sounding(scan.sensor(), beam.reading) {
        Some(sounding) if sounding.echo => sounding.range - 0.75 * options.resolution,
        Some(sounding) => sounding.range,
        None => 0.0,
    };
    // Half a step to either side; the chord of the sector is the border.
    axis.angle(&to) <= 0.5 * scan.sensor().beam_width() - slack / to.norm().max(0.1)
        && to.dot(&axis) <= reach * (0.5 * scan.sensor().beam_width()).cos() - slack
}

#[test]
fn a_fan_clears_each_cell_that_it_sees_through_once() {
    for seed in 0..6 {
        let mut random = dice(seed);
        let sensor = laser(if seed < 3 { 181 } else { 61 }, seed % 2 == 1);
        let (pose, scan) = (pose(&mut random), scan(&sensor, &mut random));
        let options = GridOptions {
            resolution: 0.05,
            laser: LaserRay { max_range: 5.0, no_echo_range: (seed == 0).then_some(2.0), ..LaserRay::default() },
            ..plain()
        };
        let grid = assemble([(&pose, &scan)], &options).unwrap().to_grid().unwrap();
        let (mut inside, mut wrong) = (0, 0);
        for (index, cell) in grid.cells().iter().enumerate() {
            let center = grid.frame().center(index / grid.frame().columns(), index % grid.frame().columns());
            // Between the two slacks rounding decides.
            let (surely, perhaps) =
                (cleared(&options, &pose, &scan, center, 1e-3), cleared(&options, &pose, &scan, center, -1e-3));
            inside += usize::from(surely);
            let is = cell.empty > 0.0;
            wrong += usize::from((surely && !is) || (!perhaps && is));
            assert!(!is || (cell.empty - 0.3).abs() < 1e-4, "a cell is cleared once, got {}", cell.empty);
        }
        assert!(inside > 300 && wrong == 0, "seed {seed}: {wrong} of {inside} cells differ");
    }
}

#[test]
fn a_fan_hits_the_cells_in_which_rays_end() {
    let mut random = dice(11);
    let sensor = laser(181, false);
    let (pose, scan) = (pose(&mut random), scan(&sensor, &mut random));
    let options = GridOptions { resolution: 0.05, ..plain() };
    let grid = assemble([(&pose, &scan)], &options).unwrap().to_grid().unwrap();
    let ends: Vec<Point2<f64>> = scan.echo_points().map(|end| pose * Point2::from(end)).collect();
    for end in &ends {
        assert!(grid.at(*end).unwrap().occupied >= 0.599, "{end}");
    }
    let cells: std::collections::BTreeSet<_> = ends.iter().map(|end| grid.frame().cell_at(*end).unwrap()).collect();
    assert_eq!(grid.cells().iter().filter(|cell| cell.occupied > 0.0).count(), cells.len());
}

#[test]
fn beams_that_stand_apart_are_drawn_as_rays() {
    let mut random = dice(3);
    let ring = global_grid::local_grid::RangeSensor::ring(
        "infrared",
        global_grid::local_grid::SensorKind::Infrared,
        12,
        0.1,
        0.02,
        0.05..=8.0,
    );
    let sensor = std::sync::Arc::new(ring.unwrap());
    let (pose, scan) = (pose(&mut random), scan(&sensor, &mut random));
    let grid = assemble([(&pose, &scan)], &plain()).unwrap().to_grid().unwrap();
    let mut exact = FuzzyGrid::new(*grid.frame());
    exact.integrate(&LaserRay::default(), &pose, &scan);
    assert_close(&grid, &exact, 2e-3);
}

fn assert_close(quick: &FuzzyGrid, exact: &FuzzyGrid, epsilon: f32) {
    for (quick, exact) in quick.cells().iter().zip(exact.cells()) {
        let (quick, exact) = (quick.known(), exact.known());
        approx::assert_abs_diff_eq!(quick.empty, exact.empty, epsilon = epsilon);
        approx::assert_abs_diff_eq!(quick.occupied, exact.occupied, epsilon = epsilon);
    }
}

#[test]
fn single_reading_models_agree_with_cells_fused_one_by_one() {
    let sensor = sonars();
    let mut random = dice(5);
    let posed: Vec<_> = (0..8).map(|_| (pose(&mut random), scan(&sensor, &mut random))).collect();
    for sonar in [SonarModel::Cone(SonarCone::default()), SonarModel::Regions(SonarRegions::default())] {
        let options = GridOptions { sonar: sonar.clone(), ..plain() };
        let grid = assemble(posed.iter().map(|(pose, scan)| (pose, scan)), &options).unwrap().to_grid().unwrap();
        let mut exact = FuzzyGrid::new(*grid.frame());
        for (pose, scan) in &posed {
            match &sonar {
                SonarModel::Cone(model) => exact.integrate(model, pose, scan),
                SonarModel::Regions(model) => exact.integrate(model, pose, scan),
                SonarModel::Shared(_) => unreachable!("not in the list"),
            }
        }
        assert_close(&grid, &exact, 4e-3);
    }
}

/// Shares echoes out as the equations stand there: cell by cell, in double precision, in a map of cells.
fn share_slowly(
    model: &SharedEcho,
    resolution: f64,
    posed: &[(Isometry2<f64>, Scan)],
) -> BTreeMap<(i64, i64), (f64, f64)> {
    let mut empty = BTreeMap::<(i64, i64), f64>::new();
    let mut arcs: Vec<Vec<((i64, i64), f64)>> = Vec::new();
    for (pose, scan) in posed {
        let half_width = 0.5 * scan.sensor().beam_width();
        for beam in scan.beams() {
            let Reading::Echo(range) = beam.reading else { continue };
            let (sensor, range) = (pose * beam.robot_from_sensor, f64::from(range));
            let reach = ((range + model.depth) / resolution).ceil();
            let at = sensor.translation.vector / resolution;
            let mut arc = Vec::new();
            let cells = |middle: f64| -> Vec<i64> {
                #[expect(clippy::cast_possible_truncation, reason = "a few cells")]
                let (low, high) = ((middle - reach) as i64 - 2, (middle + reach) as i64 + 2);
                (low..=high).collect()
            };
            for row in cells(at.y) {
                for column in cells(at.x) {
                    #[expect(clippy::cast_precision_loss, reason = "a few cells")]
                    let center = Point2::new(column as f64 + 0.5, row as f64 + 0.5) * resolution;
                    let point = sensor.inverse_transform_point(&center);
                    let (distance, bearing) = (point.coords.norm(), point.y.atan2(point.x).abs());
                    if bearing > half_width {
                        continue;
                    }
                    if distance < range - model.margin {
                        *empty.entry((row, column)).or_default() -= (1.0 - model.empty).ln();
                    }
                    let weight = 1.0 - ((distance - range) / model.depth).powi(2);
                    if weight > 0.0 {
                        arc.push(((row, column), weight));
                    }
                }
            }
            arcs.push(arc);
        }
    }
    let mut occupied = BTreeMap::<(i64, i64), f64>::new();
    for (cell, weight) in arcs.iter().flatten() {
        *occupied.entry(*cell).or_default() += model.occupied * weight;
    }
    for _ in 0..model.rounds {
        let pull = |cell: &(i64, i64)| {
            let (e, o) = (empty.get(cell).copied().unwrap_or(0.0), occupied[cell]);
            o * ((o + model.prior) / (o + e + model.prior)).powi(model.contrast.into())
        };
        let mut next = BTreeMap::new();
        for arc in &arcs {
            let total: f64 = arc.iter().map(|(cell, weight)| weight * pull(cell)).sum();
            for (cell, weight) in arc {
                let share = weight * pull(cell) / (total + model.doubt);
                let counts = share >= 1.0 / 256.0;
                *next.entry(*cell).or_default() += if counts { model.echo * share } else { 0.0 };
            }
        }
        occupied = next;
    }
    let mut cells = BTreeMap::<(i64, i64), (f64, f64)>::new();
    empty.into_iter().for_each(|(cell, nats)| cells.entry(cell).or_default().0 = nats);
    occupied.into_iter().for_each(|(cell, nats)| cells.entry(cell).or_default().1 = nats);
    cells
}

#[test]
fn echoes_are_shared_as_the_equations_say() {
    let sensor = sonars();
    let mut random = dice(8);
    let posed: Vec<_> = (0..12).map(|_| (pose(&mut random), scan(&sensor, &mut random))).collect();
    let model = SharedEcho::default();
    for calculus in [Calculus::Fuzzy, Calculus::DempsterShafer] {
        let options = GridOptions { calculus, ..plain() };
        let map = assemble(posed.iter().map(|(pose, scan)| (pose, scan)), &options).unwrap();
        let grid = map.read(|tally| (tally.empty_nats(), tally.occupied_nats())).unwrap();
        let slow = share_slowly(&model, options.resolution, &posed);
        let (mut compared, mut apart) = (0, 0);
        for (&(row, column), exact) in &slow {
            #[expect(clippy::cast_precision_loss, reason = "a few cells")]
            let center = Point2::new(column as f64 + 0.5, row as f64 + 0.5) * options.resolution;
            let quick = grid.at(center).copied().unwrap_or_default();
            compared += 1;
            apart += usize::from((quick.0 - exact.0).abs() > 2e-3 || (quick.1 - exact.1).abs() > 5e-3);
        }
        // Cells whose centres lie on an edge may fall to either side.
        assert!(compared > 5000 && apart * 1000 < compared, "{apart} of {compared} cells differ");
    }
}

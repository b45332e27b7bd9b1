//! A made-up office with a known true map: what the sonar model promises must hold on it.

use std::sync::Arc;

use global_grid::local_grid::nalgebra::{Isometry2, Point2, Vector2};
use global_grid::local_grid::{Grid, GridFrame, RangeSensor, Scan, SensorKind};
use global_grid::{Calculus, GridOptions, MapScore, Occupancy, SonarModel, assemble, score};
use rand::RngExt;

use crate::dice;

type Wall = (Point2<f64>, Point2<f64>);

/// Six rooms of 4 × 4 m along a corridor, each with a door.
fn walls() -> Vec<Wall> {
    let mut walls = Vec::new();
    let mut wall = |x0: f64, y0: f64, x1: f64, y1: f64| walls.push((Point2::new(x0, y0), Point2::new(x1, y1)));
    for side in [1.05, 7.45] {
        for x in [1.05, 5.05, 9.05] {
            let (low, high) = (side, side + 4.0);
            let corridor = if side < 5.0 { high } else { low };
            wall(x, low, x, high);
            wall(x, corridor, x + 1.5, corridor);
            wall(x + 2.5, corridor, x + 4.0, corridor);
            wall(x, low + high - corridor, x + 4.0, low + high - corridor);
        }
        wall(13.05, side, 13.05, side + 4.0);
    }
    wall(1.05, 5.05, 1.05, 7.45);
    wall(13.05, 5.05, 13.05, 7.45);
    walls
}

/// Distance along a ray, and the cosine of the angle between the ray and the wall's normal.
fn cast(from: Point2<f64>, direction: Vector2<f64>, walls: &[Wall]) -> Option<(f64, f64)> {
    let hit = |(a, b): &Wall| {
        let (along, to) = (b - a, a - from);
        let across = direction.perp(&along);
        let (range, share) = (to.perp(&along) / across, to.perp(&direction) / across);
        (range > 1e-9 && (0.0..=1.0).contains(&share)).then_some((range, (across / along.norm()).abs()))
    };
    walls.iter().filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// A reading as a sonar gives it: walls at a slant are lost but for rough spots, one in a hundred is an outlier.
fn hear(pose: &Isometry2<f64>, walls: &[Wall], random: &mut impl rand::Rng) -> f64 {
    let mut range = f64::INFINITY;
    for k in 0..25 {
        let bearing = (f64::from(k) / 24.0 - 0.5) * 25f64.to_radians();
        let direction = pose.rotation * Vector2::new(bearing.cos(), bearing.sin());
        if let Some((distance, normal)) = cast(pose.translation.vector.into(), direction, walls)
            && (normal > 35f64.to_radians().cos() || random.random::<f64>() < 0.15)
        {
            range = range.min(distance);
        }
    }
    if random.random::<f64>() < 0.01 {
        range = range.min(random.random_range(0.4..6.0));
    }
    (range * (1.0 + random.random_range(-0.017..0.017)) + random.random_range(-0.017..0.017)).max(0.15)
}

/// Readings from all over the office: `rounds` times 48 directions from each of 42 places.
fn readings(seed: u64, rounds: usize) -> Vec<(Isometry2<f64>, Scan)> {
    let (walls, mut random) = (walls(), dice(seed));
    let width = 25f64.to_radians();
    let cone = Arc::new(RangeSensor::ring("sonar", SensorKind::Sonar, 1, 0.0, width, 0.1..=6.0).unwrap());
    let mut places = Vec::new();
    for (x, y) in (0..7).flat_map(|x| (0..6).map(move |y| (x, y))) {
        let near = Point2::new(1.95 + 1.7 * f64::from(x), 1.9 + 1.75 * f64::from(y));
        let clear = |(a, b): &Wall| {
            let share = ((near - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
            (near - (a + (b - a) * share)).norm() > 0.4
        };
        places.extend(walls.iter().all(clear).then_some(near));
    }
    let mut readings = Vec::new();
    for round in 0..rounds {
        for (number, place) in places.iter().enumerate() {
            for k in 0..48 {
                let spread = if round > 0 { 0.15 } else { 0.0 };
                let shift = Vector2::new(random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)) * spread;
                #[expect(clippy::cast_precision_loss, reason = "a few places")]
                let heading = f64::from(k) * std::f64::consts::TAU / 48.0 + 0.01 * (number + round) as f64;
                let pose = Isometry2::new(place.coords + shift, heading);
                let range = hear(&pose, &walls, &mut random);
                let range = if range >= 6.0 { f64::INFINITY } else { range };
                readings.push((pose, Scan::from_ranges(cone.clone(), [range]).unwrap()));
            }
        }
    }
    readings
}

/// The cells that walls cross, and what lies between them; beyond the outer walls nothing is judged.
fn truth() -> Grid<Occupancy> {
    let frame = GridFrame::new(Point2::origin(), 0.1, 125, 142).unwrap();
    let mut truth = Grid::new(frame);
    for row in 11..115 {
        for column in 11..131 {
            *truth.get_mut(row, column).unwrap() = Occupancy::Free;
        }
    }
    for (a, b) in walls() {
        for step in 0..=400 {
            let point = a + (b - a) * (f64::from(step) / 400.0);
            let (row, column) = frame.cell_at(point).unwrap();
            *truth.get_mut(row, column).unwrap() = Occupancy::Occupied;
        }
    }
    truth
}

fn scored(readings: &[(Isometry2<f64>, Scan)], options: &GridOptions) -> MapScore {
    let map = assemble(readings.iter().map(|(pose, scan)| (pose, scan)), options).unwrap();
    let probability = map.read(|tally| options.probability(tally)).unwrap();
    score(|point| *probability.at(point).unwrap_or(&0.5), &truth(), 0.1)
}

#[test]
fn walls_are_found_and_more_readings_find_them_better() {
    for seed in [1, 2] {
        let (few, many) = (readings(seed, 1), readings(seed, 8));
        let (few, many) = (scored(&few, &GridOptions::default()), scored(&many, &GridOptions::default()));
        assert!(few.wall_f1 > 0.87 && few.auc > 0.96, "{few:?}");
        assert!(many.wall_f1 > few.wall_f1 && many.wall_f1 > 0.92, "{many:?}");
    }
}

#[test]
fn sharing_echoes_beats_judging_readings_one_by_one() {
    let readings = readings(3, 2);
    for calculus in [Calculus::Fuzzy, Calculus::Bayes, Calculus::DempsterShafer] {
        let shared = scored(&readings, &GridOptions { calculus, ..GridOptions::default() });
        for sonar in [SonarModel::Cone(Default::default()), SonarModel::Regions(Default::default())] {
            let single = scored(&readings, &GridOptions { calculus, sonar, ..GridOptions::default() });
            assert!(shared.wall_f1 > single.wall_f1 + 0.05, "{calculus:?}: {} {}", shared.wall_f1, single.wall_f1);
        }
    }
}

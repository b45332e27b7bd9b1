//! What one scan, one signature and one match cost.
#![expect(clippy::unwrap_used, reason = "a bench may panic")]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use local_grid::nalgebra::{Isometry2, Point2, Vector2};
use local_grid::{
    AlignOptions, Fuzzy, LaserRay, LocalMap, LocalMapOptions, MatchOptions, Prior, RangeSensor, Scan, SearchWindow,
    SensorKind, Signature, SignatureOptions, SonarCone, StructureOptions, WorkingGrid, WorkingGridOptions, align,
    echoes, refine, search, wall_direction_of_echoes,
};

/// A room of 8 × 6 m with a niche, a partition and a pillar.
const WALLS: [[f64; 4]; 13] = [
    [-4.0, -3.0, 4.0, -3.0],
    [4.0, -3.0, 4.0, 3.0],
    [4.0, 3.0, 1.5, 3.0],
    [1.5, 3.0, 1.5, 4.2],
    [1.5, 4.2, -0.3, 4.2],
    [-0.3, 4.2, -0.3, 3.0],
    [-0.3, 3.0, -4.0, 3.0],
    [-4.0, 3.0, -4.0, -3.0],
    [-1.6, -3.0, -1.6, -0.4],
    [2.0, 0.8, 2.3, 0.8],
    [2.3, 0.8, 2.3, 1.1],
    [2.3, 1.1, 2.0, 1.1],
    [2.0, 1.1, 2.0, 0.8],
];

fn seen(sensor: &Arc<RangeSensor>, world_from_robot: &Isometry2<f64>) -> Scan {
    let range = |mount: &Isometry2<f64>| {
        let beam = world_from_robot * mount;
        let (start, direction) = (beam.translation.vector, beam.rotation * Vector2::x());
        let hit = |wall: &[f64; 4]| {
            let (a, along) = (Vector2::new(wall[0], wall[1]), Vector2::new(wall[2] - wall[0], wall[3] - wall[1]));
            let cross = direction.perp(&along);
            let (range, share) = ((a - start).perp(&along) / cross, (a - start).perp(&direction) / cross);
            (range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
        };
        WALLS.iter().filter_map(hit).fold(f64::INFINITY, f64::min)
    };
    let ranges: Vec<f64> = sensor.mounts().iter().map(range).collect();
    Scan::from_ranges(sensor.clone(), ranges).unwrap()
}

fn sonar() -> Arc<RangeSensor> {
    let width = 25f64.to_radians();
    Arc::new(RangeSensor::ring("sonar", SensorKind::Sonar, 16, 0.225, width, 0.43..=6.48).unwrap())
}

fn laser() -> Arc<RangeSensor> {
    let (first, step) = (-90f64.to_radians(), 1f64.to_radians());
    Arc::new(RangeSensor::fan("laser", Isometry2::identity(), first, step, 180, 0.05..=40.0).unwrap())
}

fn pose(x: f64, y: f64, degrees: f64) -> Isometry2<f64> {
    Isometry2::new(Vector2::new(x, y), degrees.to_radians())
}

fn window() -> WorkingGrid<Fuzzy> {
    WorkingGrid::new(&WorkingGridOptions::default(), Point2::origin()).unwrap()
}

/// The signature of the place at `(x, y)`, seen all round, its frame turned by so many degrees.
fn signature(x: f64, y: f64, degrees: f64) -> Signature {
    let (laser, mut window) = (laser(), window());
    for turn in [0.0, 120.0, 240.0] {
        let pose = pose(x, y, turn);
        let scan = seen(&laser, &pose);
        for _ in 0..3 {
            window
                .integrate(&LaserRay::default(), &(Isometry2::rotation(-degrees.to_radians()) * pose), &scan)
                .unwrap();
        }
    }
    let place = Isometry2::rotation(-degrees.to_radians()) * Point2::new(x, y);
    window.signature(place, &SignatureOptions::default())
}

fn integrate(c: &mut Criterion) {
    let (sonar, laser) = (seen(&sonar(), &pose(0.2, 0.1, 10.0)), seen(&laser(), &pose(0.2, 0.1, 10.0)));
    let mut grid = window();
    c.bench_function("integrate/16 sonars", |b| {
        b.iter(|| grid.integrate(&SonarCone::default(), &pose(0.2, 0.1, 10.0), black_box(&sonar)).unwrap());
    });
    c.bench_function("integrate/180 beams", |b| {
        b.iter(|| grid.integrate(&LaserRay::default(), &pose(0.2, 0.1, 10.0), black_box(&laser)).unwrap());
    });
    let mut map = LocalMap::new(LocalMapOptions::default()).unwrap();
    c.bench_function("local map/insert 180 beams", |b| {
        b.iter(|| map.insert(&pose(0.2, 0.1, 10.0), black_box(&laser)).unwrap());
    });
}

fn places(c: &mut Criterion) {
    let (a, same, turned) = (signature(0.0, 0.0, 0.0), signature(0.3, -0.2, 0.0), signature(0.3, -0.2, 8.0));
    c.bench_function("align/compass", |b| b.iter(|| align(black_box(&a), &same, &AlignOptions::default())));
    let unsure = AlignOptions { turn_window: 15f64.to_radians(), ..AlignOptions::default() };
    c.bench_function("align/within 15 degrees", |b| b.iter(|| align(black_box(&a), &turned, &unsure)));
    let lost = AlignOptions { turn_window: std::f64::consts::PI, ..AlignOptions::default() };
    c.bench_function("align/any heading", |b| b.iter(|| align(black_box(&a), &turned, &lost)));
    c.bench_function("align/histograms", |b| b.iter(|| black_box(&a).histogram_match(&same, 0.8)));
    c.bench_function("signature/descriptor", |b| b.iter(|| black_box(&a).turn_invariant_descriptor()));
    let grid = window();
    c.bench_function("signature/cut", |b| {
        b.iter(|| black_box(&grid).signature(Point2::new(0.1, 0.2), &SignatureOptions::default()));
    });
}

fn scans(c: &mut Criterion) {
    let laser = laser();
    let mut map = LocalMap::new(LocalMapOptions::default()).unwrap();
    for pose in [pose(0.0, 0.0, 0.0), pose(0.3, 0.2, 90.0), pose(0.5, 0.0, 180.0), pose(0.2, 0.0, 270.0)] {
        map.insert(&pose, &seen(&laser, &pose)).unwrap();
    }
    let truth = pose(0.4, -0.3, 30.0);
    let scan = seen(&laser, &truth);
    let (found, options) = (echoes(&scan, 30.0), MatchOptions::default());
    c.bench_function("scan/echoes", |b| b.iter(|| echoes(black_box(&scan), 30.0)));
    let prior = Prior::start(truth * pose(0.1, -0.05, 4.0));
    c.bench_function("scan/refine", |b| b.iter(|| refine(&map, black_box(&found), &prior, &options)));
    let far = truth * pose(1.5, -1.0, 20.0);
    c.bench_function("scan/search 4 m and 30 degrees", |b| {
        b.iter(|| search(&map, black_box(&found), &far, &SearchWindow::default(), &options));
    });
    let structure = StructureOptions::default();
    c.bench_function("structure/echoes", |b| b.iter(|| wall_direction_of_echoes(black_box(&found), &structure)));
}

criterion_group!(benches, integrate, places, scans);
criterion_main!(benches);

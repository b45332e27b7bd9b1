//! How long readings at known poses take to become a map.
#![expect(clippy::unwrap_used, reason = "a bench that cannot set itself up must fail")]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use global_grid::local_grid::nalgebra::{Isometry2, Vector2};
use global_grid::local_grid::{RangeSensor, Scan, SensorKind, SonarCone};
use global_grid::{GridOptions, SonarModel, assemble};
use rand::{RngExt, SeedableRng};

/// The paper's load: 6,600 cones over 45 × 35 m.
fn sonar(readings: usize) -> Vec<(Isometry2<f64>, Scan)> {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(2000);
    let cone = RangeSensor::ring("sonar", SensorKind::Sonar, 1, 0.0, 25f64.to_radians(), 0.1..=6.0).unwrap();
    let cone = Arc::new(cone);
    let reading = |k: usize| {
        let place = Vector2::new(
            2.0 + 41.0 * ((k / 48) as f64 * 0.618).fract(),
            2.0 + 31.0 * ((k / 48) as f64 * 0.414).fract(),
        );
        let heading = (k % 48) as f64 * std::f64::consts::TAU / 48.0;
        let range = random.random_range(0.4f64..6.0).min(random.random_range(0.4..6.0));
        (Isometry2::new(place, heading), Scan::from_ranges(cone.clone(), [range]).unwrap())
    };
    (0..readings).map(reading).collect()
}

/// Half circles of 360 beams in rooms of a few metres.
fn laser(scans: usize) -> Vec<(Isometry2<f64>, Scan)> {
    let step = std::f64::consts::PI / 360.0;
    let fan = RangeSensor::fan("laser", Isometry2::identity(), -std::f64::consts::FRAC_PI_2, step, 360, 0.05..=50.0);
    let fan = Arc::new(fan.unwrap());
    let scan = |k: usize| {
        let pose = Isometry2::new(Vector2::new(0.1 * k as f64, 0.0), 0.05 * k as f64);
        let range = |beam: usize| {
            2.0 + 1.5 * (beam as f64 * 0.05 + k as f64).sin() + f64::from(u8::from(beam.is_multiple_of(90)))
        };
        (pose, Scan::from_ranges(fan.clone(), (0..360).map(range)).unwrap())
    };
    (0..scans).map(scan).collect()
}

fn fusion(criterion: &mut Criterion) {
    let readings = sonar(6600);
    let mut group = criterion.benchmark_group("sonar, 6600 cones at 0.10 m");
    group.throughput(Throughput::Elements(6600));
    let models =
        [("echoes shared out", SonarModel::default()), ("oriolo's cone", SonarModel::Cone(SonarCone::default()))];
    for (name, sonar) in models {
        let options = GridOptions { sonar, ..GridOptions::default() };
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let map = assemble(readings.iter().map(|(pose, scan)| (pose, scan)), &options).unwrap();
                map.settle();
                black_box(map)
            });
        });
    }
    group.finish();
    let scans = laser(500);
    let mut group = criterion.benchmark_group("laser, 180,000 beams at 0.05 m");
    group.throughput(Throughput::Elements(180_000));
    let options = GridOptions { resolution: 0.05, ..GridOptions::default() };
    group.bench_function("as areas", |bencher| {
        bencher.iter(|| black_box(assemble(scans.iter().map(|(pose, scan)| (pose, scan)), &options).unwrap()));
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = fusion
}
criterion_main!(benches);

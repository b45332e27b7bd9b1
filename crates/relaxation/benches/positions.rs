//! One sweep and the direct solution on maps of 137, 10⁴ and 10⁵ places: the claims of `docs/results/relaxation.md`.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use relaxation::{Covariance, Direct, Network, Solver, Spring, optimum, sweep};

const SIZES: [usize; 3] = [137, 10_000, 100_000];

/// Corridors up and down a building, 16 places each, with doors to the next one: 1.06 springs per place.
fn map(places: usize) -> (usize, Vec<Spring>) {
    let mut rng = Pcg64Mcg::seed_from_u64(2000);
    let row = 16;
    let at = |i: usize| {
        let (x, y) = (i % row, i / row);
        Vector2::new(if y.is_multiple_of(2) { x as f64 } else { (row - 1 - x) as f64 }, 2.0 * y as f64)
    };
    let doors = (0..places).filter(|i| i % 17 == 3).map(|i| (i, i + 2 * (row - i % row) - 1));
    let pairs = (1..places).map(|i| (i - 1, i)).chain(doors.filter(|&(_, j)| j < places));
    let springs = pairs.map(|(i, j)| {
        let error = Vector2::new(rng.random_range(-0.1..0.1), rng.random_range(-0.1..0.1));
        Spring::isotropic(i, j, at(j) - at(i) + error, rng.random_range(1e-3..1e-2))
    });
    (places, springs.collect())
}

fn sweeps(c: &mut Criterion) {
    let mut group = c.benchmark_group("one sweep");
    for (places, springs) in SIZES.map(map) {
        let network = Network::new(places, &springs).expect("the map is sound");
        let mut positions = network.dead_reckoning();
        group.throughput(Throughput::Elements(2 * springs.len() as u64)); // spring visits
        group.bench_function(BenchmarkId::from_parameter(places), |b| {
            b.iter(|| sweep(&network, black_box(&mut positions)))
        });
    }
}

fn solutions(c: &mut Criterion) {
    let mut group = c.benchmark_group("set up and solve");
    group.sample_size(20);
    for (places, springs) in SIZES.map(map) {
        let network = || Network::new(places, &springs).expect("the map is sound");
        group.bench_function(BenchmarkId::new("elimination", places), |b| b.iter(|| optimum(&network())));
        group.bench_function(BenchmarkId::new("faer", places), |b| {
            b.iter(|| {
                let network = network();
                Direct.solve(&network, &network.dead_reckoning())
            });
        });
        group.bench_function(BenchmarkId::new("all covariances", places), |b| b.iter(|| Covariance::new(&network())));
    }
}

criterion_group!(benches, sweeps, solutions);
criterion_main!(benches);

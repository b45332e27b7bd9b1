//! One query of the signature index among 10³ to 10⁵ places; the claim is under 1 ms at 10⁵.
#![expect(clippy::unwrap_used, reason = "a benchmark, made by criterion's macros")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use topo_map::{PlaceId, SignatureIndex};

/// As many numbers as a descriptor of `local-grid` has.
const DIMENSIONS: usize = 32;

/// A descriptor as rooms make them: a walk around a few sorts of places rather than white noise.
fn descriptor(rng: &mut impl Rng) -> Vec<f32> {
    let sort: f32 = rng.random_range(0..12_u8).into();
    (0..DIMENSIONS).map(|k| ((sort * 0.7 + k as f32 * 0.3).sin() * 0.3 + 0.5) + rng.random_range(-0.15..0.15)).collect()
}

fn query(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("signature_index/nearest_10");
    for count in [1_000_u32, 10_000, 100_000] {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let mut index = SignatureIndex::new(DIMENSIONS, 0.0..=1.0).unwrap();
        for place in 0..count {
            index.insert(PlaceId(place), &descriptor(&mut rng)).unwrap();
        }
        let asked = descriptor(&mut rng);
        group.bench_with_input(BenchmarkId::from_parameter(count), &count, |bencher, _| {
            bencher.iter(|| index.nearest(&asked, 10, |_| true).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, query);
criterion_main!(benches);

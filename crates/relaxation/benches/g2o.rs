//! How fast graphs are read, in bytes a second: plain g2o text with six decimals, as programs of the field write it.

use std::fmt::Write;
use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// 10⁵ poses and 2·10⁵ edges, about 28 MB.
fn text() -> String {
    let mut random = Pcg64Mcg::new(7);
    let mut text = String::new();
    let mut value = |text: &mut String, size: f64| {
        write!(text, " {:.6}", size * (2.0 * random.random::<f64>() - 1.0)).expect("a string takes all");
    };
    for id in 0..100_000 {
        write!(text, "VERTEX_SE2 {id}").expect("a string takes all");
        for size in [100.0, 100.0, 3.0] {
            value(&mut text, size);
        }
        text.push('\n');
    }
    for id in 0..200_000 {
        write!(text, "EDGE_SE2 {} {}", id / 2, (id * 7) % 100_000).expect("a string takes all");
        for size in [1.0, 1.0, 3.0, 500.0, 0.0, 0.0, 500.0, 0.0, 10_000.0] {
            value(&mut text, size);
        }
        text.push('\n');
    }
    text
}

fn reading(c: &mut Criterion) {
    let text = text();
    let mut group = c.benchmark_group("g2o");
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.sample_size(10);
    group
        .bench_function("read", |b| b.iter(|| relaxation::g2o::read(black_box(text.as_bytes())).expect("well-formed")));
    group.finish();
}

criterion_group!(benches, reading);
criterion_main!(benches);

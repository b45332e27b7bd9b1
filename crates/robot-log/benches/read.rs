//! How fast logs are read: a log of the size of the Intel recording, made here, and the recording itself where it is present.

use std::hint::black_box;
use std::io::Write;
use std::path::PathBuf;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use robot_log::{CarmenOptions, CarmenReader};

/// `scans` scans of 180 beams that wander about.
fn log(scans: u32) -> String {
    let mut text = String::new();
    for k in 0..scans {
        text += "FLASER 180";
        for beam in 0..180 {
            text += &format!(" {:.2}", 1.0 + f64::from((k * 37 + beam * 91) % 2000) / 100.0);
        }
        let at = format!("{:.6} {:.6} {:.6}", f64::from(k) * 0.2, f64::from(k % 100), f64::from(k) * 0.01);
        text += &format!(" {at} {at} {k}.5 host {k}.5\n");
    }
    text
}

fn gzip(text: &[u8]) -> Vec<u8> {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(text).and_then(|()| packed.finish()).unwrap_or_default()
}

fn count(bytes: &[u8]) -> usize {
    CarmenReader::new("bench.log", bytes, CarmenOptions::default()).into_iter().flatten().filter(Result::is_ok).count()
}

fn read(c: &mut Criterion) {
    let mut group = c.benchmark_group("read");
    for scans in [2_726, 27_260] {
        let text = log(scans);
        group.throughput(Throughput::Bytes(text.len() as u64));
        group.sample_size(if scans > 10_000 { 10 } else { 50 });
        group.bench_function(format!("carmen, {scans} scans"), |b| b.iter(|| count(black_box(text.as_bytes()))));
        let packed = gzip(text.as_bytes());
        group.bench_function(format!("carmen gzip, {scans} scans"), |b| b.iter(|| count(black_box(&packed))));
    }
    let intel = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/laser/intel/intel_raw.clf.gz");
    match std::fs::read(intel) {
        Ok(bytes) => {
            group.throughput(Throughput::Bytes(bytes.len() as u64));
            group.bench_function("intel_raw.clf.gz", |b| b.iter(|| count(black_box(&bytes))));
        }
        Err(_) => eprintln!("skipped: laser/intel/intel_raw.clf.gz not present"),
    }
    group.finish();
}

criterion_group!(benches, read);
criterion_main!(benches);

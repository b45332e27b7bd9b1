//! Times one Gauss-Seidel sweep on linear position graphs: `sweep_speed FILE.xy.g2o…`.
//!
//! Prints the median and the least of many batches in microseconds of CPU time per sweep, and the spring visits per second of
//! the median.
#![expect(clippy::print_stdout, reason = "the table is the output")]

use std::error::Error;
use std::fs;

use nalgebra::{Point2, Vector2};
use relaxation::{Network, Spring, sweep};
use rustix::time::{ClockId, clock_gettime};

fn main() -> Result<(), Box<dyn Error>> {
    println!("{:>9} {:>9} {:>12} {:>12} {:>14}", "places", "springs", "median µs", "least µs", "visits/s");
    for file in std::env::args().skip(1) {
        let network = read(&fs::read_to_string(file)?)?;
        let mut positions: Vec<Point2<f64>> = network.dead_reckoning();
        sweep(&network, &mut positions);
        let repeats = 1_000_000 / network.springs().len() + 1;
        let mut micros: Vec<f64> = (0..101)
            .map(|_| {
                let begin = cpu_micros();
                (0..repeats).for_each(|_| sweep(&network, std::hint::black_box(&mut positions)));
                (cpu_micros() - begin) / repeats as f64
            })
            .collect();
        micros.sort_by(f64::total_cmp);
        let visits = 2.0 * network.springs().len() as f64 / (micros[50] * 1e-6);
        let (places, springs) = (network.len(), network.springs().len());
        println!("{places:>9} {springs:>9} {:>12.3} {:>12.3} {visits:>14.3e}", micros[50], micros[0]);
    }
    Ok(())
}

/// CPU time of this process: other programs' share of the processor does not count.
#[expect(clippy::cast_precision_loss, reason = "a time")]
fn cpu_micros() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
}

fn read(text: &str) -> Result<Network, Box<dyn Error>> {
    let (mut nodes, mut springs) = (0, Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words.as_slice() {
            ["VERTEX_XY", ..] => nodes += 1,
            ["EDGE_POINTXY", from, to, x, y, weight, ..] => {
                let rest = Vector2::new(x.parse()?, y.parse()?);
                springs.push(Spring::isotropic(from.parse()?, to.parse()?, rest, weight.parse::<f64>()?.recip()));
            }
            _ => {}
        }
    }
    Ok(Network::from_vec(nodes, springs)?)
}

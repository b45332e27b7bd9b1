//! The optimum of a map of millions of places: `large_map PLACES [FAMILY]`, FAMILY `grid` (the default) or `office`.
//!
//! The map is made here, a square lattice with one corridor in five missing; a `grid` has no place between junctions, an
//! `office` three. Prints what it took: seconds of CPU time, and memory above the springs.
#![expect(clippy::print_stdout, reason = "the result is the output")]

use std::error::Error;
use std::fs;

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use relaxation::{Network, Spring, certify, optimum};
use rustix::time::{ClockId, clock_gettime};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let places: usize = arguments.first().ok_or("usage: large_map PLACES [grid|office]")?.parse()?;
    let between = match arguments.get(1).map_or("grid", String::as_str) {
        "grid" => 0,
        "office" => 3,
        other => return Err(format!("unknown family {other}").into()),
    };
    let (nodes, springs) = lattice(places, between);
    let (count, input) = (springs.len(), resident_mb("VmHWM:"));
    println!("{nodes} places, {count} springs, {input:.0} MB");

    let begin = cpu_seconds();
    let network = Network::from_vec(nodes, springs)?;
    let positions = optimum(&network)?;
    println!("optimum: {:.2} s, {:.0} MB above the springs", cpu_seconds() - begin, resident_mb("VmHWM:") - input);

    let begin = cpu_seconds();
    let certificate = certify(&network, &positions, 1);
    println!("certificate: {:.2} s", cpu_seconds() - begin);
    println!("energy {:.6e}, gap {:.1e}, components {}", certificate.energy, certificate.gap, certificate.components);
    Ok(())
}

/// Junctions one metre (times `between + 1`) apart, about so many places in all.
fn lattice(places: usize, between: usize) -> (usize, Vec<Spring>) {
    let mut rng = Pcg64Mcg::seed_from_u64(2000);
    #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a size")]
    let side = (places as f64 / (1.0 + 1.6 * between as f64)).sqrt() as usize;
    let mut springs = Vec::with_capacity(side * side * 2 * (between + 1));
    let mut nodes = side * side;
    for junction in 0..side * side {
        let right = (junction % side + 1 < side).then_some((junction + 1, Vector2::x()));
        let up = (junction / side + 1 < side).then_some((junction + side, Vector2::y()));
        for (far, step) in [right, up].into_iter().flatten() {
            if rng.random_range(0..5) == 0 {
                continue;
            }
            let mut here = junction;
            for leg in 0..=between {
                let next = if leg == between { far } else { nodes };
                nodes += usize::from(leg < between);
                let sigma = rng.random_range(0.03..0.10);
                let error = Vector2::new(rng.random_range(-sigma..sigma), rng.random_range(-sigma..sigma));
                springs.push(Spring::isotropic(here, next, step + error, sigma * sigma));
                here = next;
            }
        }
    }
    (nodes, springs)
}

fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    #[expect(clippy::cast_precision_loss, reason = "a time")]
    let seconds = time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9;
    seconds
}

/// A line of what the system says of this process's memory, in MiB.
fn resident_mb(line: &str) -> f64 {
    let text = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let value = text.lines().find_map(|l| l.strip_prefix(line));
    value.and_then(|l| l.trim().trim_end_matches(" kB").parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0)
}

//! Times a solver on a linear position graph: `linear_bench FILE.xy.g2o REPEATS REFERENCE.bin [SOLVER]`.
//!
//! Prints one JSON line: the median of set-up and solution together in milliseconds of CPU time (loading is not
//! counted), the relative energy above the reference positions (pairs of little-endian doubles), and the peak memory
//! before and after. SOLVER is `elimination` (the default), `auto`, `direct`, `multilevel` or `gradients`.
#![expect(clippy::print_stdout, reason = "the result is the output")]

use std::error::Error;
use std::fs;

use nalgebra::{Point2, Vector2};
use relaxation::{Auto, ConjugateGradient, Direct, Multilevel, Network, Solver, Spring, optimum};
use rustix::time::{ClockId, clock_gettime};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, repeats, reference, ..] = arguments.as_slice() else {
        return Err("usage: linear_bench FILE.xy.g2o REPEATS REFERENCE.bin [SOLVER]".into());
    };
    let solver = arguments.get(3).map_or("elimination", String::as_str);
    let (nodes, mut springs) = read(&fs::read_to_string(file)?)?;
    let base = peak_mb();
    let (mut build, mut solve) = (Vec::new(), Vec::new());
    let mut positions = Vec::new();
    for _ in 0..repeats.parse::<usize>()? {
        let begin = cpu_ms();
        let network = Network::from_vec(nodes, springs)?;
        let built = cpu_ms();
        positions = match solver {
            "elimination" => optimum(&network)?,
            "auto" => Auto.solve(&network, &network.dead_reckoning()).positions,
            "direct" => Direct.solve(&network, &network.dead_reckoning()).positions,
            "multilevel" => Multilevel::default().solve(&network, &network.dead_reckoning()).positions,
            "gradients" => ConjugateGradient::default().solve(&network, &network.dead_reckoning()).positions,
            other => return Err(format!("unknown solver {other}").into()),
        };
        build.push(built - begin);
        solve.push(cpu_ms() - built);
        springs = network.into_springs();
    }
    let mut total: Vec<f64> = build.iter().zip(&solve).map(|(b, s)| b + s).collect();
    let peak = peak_mb();
    let expected: Vec<f64> =
        fs::read(reference)?.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let expected: Vec<Point2<f64>> = expected.as_chunks::<2>().0.iter().map(|&[x, y]| Point2::new(x, y)).collect();
    let edges = springs.len();
    let network = Network::from_vec(nodes, springs)?;
    let (energy, least) = (network.energy(&positions), network.energy(&expected));
    let off = positions.iter().zip(&expected).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
    println!(
        "{{\"peer\":\"{solver}\",\"file\":\"{file}\",\"n\":{nodes},\"edges\":{},\"build_ms\":{:.4},\"solve_ms\":{:.4},\
         \"total_ms\":{:.4},\"E\":{energy:.15e},\"dE_rel\":{:.3e},\"max_err_m\":{off:.3e},\"base_mb\":{base:.1},\"peak_mb\":{peak:.1}}}",
        edges,
        median(&mut build),
        median(&mut solve),
        median(&mut total),
        (energy - least) / least,
    );
    Ok(())
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn read(text: &str) -> Result<(usize, Vec<Spring>), Box<dyn Error>> {
    let (mut nodes, mut springs) = (0, Vec::new());
    for line in text.lines() {
        let mut words = line.split_ascii_whitespace();
        let tag = words.next();
        let mut number = || -> Result<f64, Box<dyn Error>> { Ok(words.next().ok_or("line too short")?.parse()?) };
        match tag {
            Some("VERTEX_XY") => nodes += 1,
            Some("EDGE_POINTXY") => {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "node numbers of the generator"
                )]
                let (from, to) = (number()? as usize, number()? as usize);
                let rest = Vector2::new(number()?, number()?);
                springs.push(Spring::isotropic(from, to, rest, number()?.recip()));
            }
            _ => {}
        }
    }
    Ok((nodes, springs))
}

/// CPU time of this process in milliseconds: other programs' share of the processor does not count.
#[expect(clippy::cast_precision_loss, reason = "a time")]
fn cpu_ms() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

/// The largest resident set so far, in MiB.
fn peak_mb() -> f64 {
    let text = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches(" kB").parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0)
}

//! Relaxes a g2o or TORO file again and again and prints one JSON line with the mean CPU time, for comparison with other programs:
//! `pose_graph_bench FILE REPEATS OUT`; `OUT` gets `id x y heading` lines. Only the springs are used, never the file's poses.
#![expect(clippy::print_stdout, reason = "the line is the program's result")]

use std::fmt::Write as _;
use std::fs::File;
use std::io::BufReader;
use std::time::Instant;

use relaxation::{PoseGraph, PoseOptions, PoseSpring, g2o, relax_poses};

/// CPU time of this thread in seconds where Linux tells it, else wall time: the machine may be shared.
fn seconds(since: Instant) -> f64 {
    let cpu = || -> Option<f64> {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
    };
    cpu().unwrap_or_else(|| since.elapsed().as_secs_f64())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, file, repeats, out] = &arguments[..] else {
        return Err("usage: pose_graph_bench FILE REPEATS OUT".into());
    };
    let origin = Instant::now();
    let before = seconds(origin);
    let graph = g2o::read(BufReader::new(File::open(file)?))?;
    let load = seconds(origin) - before;
    let mut ids: Vec<u64> = graph.pose_edges.iter().flat_map(|e| [e.from, e.to]).collect();
    ids.sort_unstable();
    ids.dedup();
    let index = |id: u64| ids.binary_search(&id).expect("every id is there");
    let springs: Vec<PoseSpring> = graph
        .pose_edges
        .iter()
        .map(|e| PoseSpring {
            from: index(e.from),
            to: index(e.to),
            from_to: e.from_to,
            information: e.information_matrix(),
        })
        .collect();
    let mut times = Vec::new();
    let mut result = None;
    for _ in 0..repeats.parse()? {
        let before = seconds(origin);
        let problem = PoseGraph::new(ids.len(), &springs)?;
        let relaxed = relax_poses(&problem, &PoseOptions::default())?;
        times.push(seconds(origin) - before);
        result = Some(relaxed);
    }
    // The clock advances in steps of some milliseconds: the mean of many runs is finer than any one of them.
    let mean = times.iter().sum::<f64>() / times.len() as f64;
    let result = result.ok_or("repeats must be at least 1")?;
    let mut text = String::new();
    for (id, pose) in ids.iter().zip(&result.poses) {
        writeln!(text, "{id} {:?} {:?} {:?}", pose.x, pose.y, pose.heading)?;
    }
    std::fs::write(out, text)?;
    println!(
        "{{\"peer\": \"topogrid\", \"file\": \"{file}\", \"load_ms\": {:.3}, \"ms\": {:.3}, \"note\": \"iters={} chi2={} start={}\"}}",
        load * 1e3,
        mean * 1e3,
        result.iterations,
        result.chi2,
        result.chi2_start
    );
    Ok(())
}

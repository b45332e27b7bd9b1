//! Relaxes a g2o or TORO file again and again and prints one JSON line with the median time, for comparison with other programs:
//! `pose_graph_bench FILE REPEATS OUT`; `OUT` gets `id x y heading` lines. Only the springs are used, never the file's poses.

use std::fmt::Write as _;
use std::fs::File;
use std::io::BufReader;
use std::time::Instant;

use relaxation::{PoseGraph, PoseOptions, PoseSpring, g2o, relax_poses};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, file, repeats, out] = &arguments[..] else {
        return Err("usage: pose_graph_bench FILE REPEATS OUT".into());
    };
    let before = Instant::now();
    let graph = g2o::read(BufReader::new(File::open(file)?))?;
    let load = before.elapsed().as_secs_f64();
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
        let before = Instant::now();
        let problem = PoseGraph::new(ids.len(), &springs)?;
        let relaxed = relax_poses(&problem, &PoseOptions::default())?;
        times.push(before.elapsed().as_secs_f64());
        result = Some(relaxed);
    }
    times.sort_by(f64::total_cmp);
    let result = result.ok_or("repeats must be at least 1")?;
    let mut text = String::new();
    for (id, pose) in ids.iter().zip(&result.poses) {
        writeln!(text, "{id} {:?} {:?} {:?}", pose.x, pose.y, pose.heading)?;
    }
    std::fs::write(out, text)?;
    println!(
        "{{\"peer\": \"topogrid\", \"file\": \"{file}\", \"load_ms\": {:.3}, \"ms\": {:.3}, \"note\": \"iters={} chi2={} start={}\"}}",
        load * 1e3,
        times[times.len() / 2] * 1e3,
        result.iterations,
        result.chi2,
        result.chi2_start
    );
    Ok(())
}

//! How well false closures are found: a Markdown table of recall and precision of the rejection and of what is left of the map.
//!
//! `false_closures FOLDER` wants a folder with `M3500.g2o`, `manhattanOlson3500.g2o`, `ring.g2o` and, if there, `bicocca/`.
//! False closures join two nodes drawn evenly at least 20 apart, claim a pose within 2 m and any heading, and have the information of
//! the graph's own closures in turn, so that nothing but contradiction tells them.
#![expect(clippy::print_stdout, reason = "the table is the program's result")]

use std::error::Error;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::time::Instant;

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use relaxation::nalgebra::Matrix3;
use relaxation::{
    Kernel, Pose, PoseGraph, PoseOptions, PoseSpring, RobustMethod, RobustOptions, g2o, relax_poses,
    relax_poses_robustly,
};

const SEED: u128 = 2000;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: false_closures FOLDER")?;
    let folder = Path::new(&folder);
    println!("| graph | false | method | recall | precision | true kept | RMSE to clean optimum, m | s |");
    println!("|---|---|---|---|---|---|---|---|");
    for name in ["ring.g2o", "M3500.g2o", "manhattanOlson3500.g2o"] {
        let clean = g2o::read(BufReader::new(File::open(folder.join(name))?))?.pose_problem()?.graph;
        let optimum = relax_poses(&clean, &PoseOptions::default())?.poses;
        for count in [10, 100, 1000] {
            let graph = with_false_closures(&clean, count)?;
            for (label, method) in methods() {
                row(name, &graph, clean.springs().len(), &optimum, label, method)?;
            }
        }
    }
    println!();
    bicocca(&folder.join("bicocca"))
}

fn methods() -> Vec<(&'static str, RobustMethod)> {
    vec![
        ("GNC, truncated", RobustMethod::TruncatedLeastSquares { bound: 11.345 }),
        ("GNC, Geman-McClure", RobustMethod::GemanMcClure { bound: 11.345 }),
        ("DCS, Φ = 1", RobustMethod::Kernel(Kernel::Dcs { phi: 1.0 })),
        ("Cauchy, δ = 1", RobustMethod::Kernel(Kernel::Cauchy { delta: 1.0 })),
        ("Huber, δ = 1.345", RobustMethod::Kernel(Kernel::Huber { delta: 1.345 })),
    ]
}

fn with_false_closures(clean: &PoseGraph, count: usize) -> Result<PoseGraph, Box<dyn Error>> {
    let mut random = Pcg64Mcg::new(SEED);
    let mut springs = clean.springs().to_vec();
    let information: Vec<Matrix3<f64>> = springs.iter().filter(|s| !is_odometry(s)).map(|s| s.information).collect();
    while springs.len() < clean.springs().len() + count {
        let (from, to) = (random.random_range(0..clean.len()), random.random_range(0..clean.len()));
        if from + 20 <= to {
            let mut within = |size: f64| random.random_range(-size..size);
            let from_to = Pose::new(within(2.0), within(2.0), within(std::f64::consts::PI));
            springs.push(PoseSpring { from, to, from_to, information: information[springs.len() % information.len()] });
        }
    }
    Ok(PoseGraph::new(clean.len(), &springs)?)
}

fn is_odometry(spring: &PoseSpring) -> bool {
    spring.from.abs_diff(spring.to) == 1
}

fn row(
    name: &str,
    graph: &PoseGraph,
    true_springs: usize,
    optimum: &[Pose],
    label: &str,
    method: RobustMethod,
) -> Result<(), Box<dyn Error>> {
    let trusted: Vec<bool> = graph.springs().iter().map(is_odometry).collect();
    let before = Instant::now();
    let robust = relax_poses_robustly(
        graph,
        &trusted,
        &RobustOptions { method, ..Default::default() },
        &PoseOptions::default(),
    )?;
    let seconds = before.elapsed().as_secs_f64();
    let false_count = graph.springs().len() - true_springs;
    let found = robust.rejected.iter().filter(|k| **k >= true_springs).count();
    let closures = trusted[..true_springs].iter().filter(|trusted| !**trusted).count();
    let lost = robust.rejected.len() - found;
    println!(
        "| {name} | {false_count} | {label} | {:.4} | {:.4} | {}/{closures} | {:.4} | {seconds:.2} |",
        found as f64 / false_count as f64,
        if robust.rejected.is_empty() { 1.0 } else { found as f64 / robust.rejected.len() as f64 },
        closures - lost,
        aligned_error(&robust.poses.iter().zip(optimum).map(|(a, b)| (*a, *b)).collect::<Vec<_>>()),
    );
    Ok(())
}

/// Root mean square distance of positions after the best rigid motion.
fn aligned_error(pairs: &[(Pose, Pose)]) -> f64 {
    let n = pairs.len() as f64;
    let mean = |f: fn(&(Pose, Pose)) -> f64| pairs.iter().map(f).sum::<f64>() / n;
    let (ax, ay, bx, by) = (mean(|p| p.0.x), mean(|p| p.0.y), mean(|p| p.1.x), mean(|p| p.1.y));
    let (mut cos, mut sin) = (0.0, 0.0);
    for (a, b) in pairs {
        let (u, v, x, y) = (a.x - ax, a.y - ay, b.x - bx, b.y - by);
        cos += u * x + v * y;
        sin += u * y - v * x;
    }
    let (s, c) = sin.atan2(cos).sin_cos();
    let square = |(a, b): &(Pose, Pose)| {
        let (u, v) = (a.x - ax, a.y - ay);
        (c * u - s * v - (b.x - bx)).powi(2) + (s * u + c * v - (b.y - by)).powi(2)
    };
    (pairs.iter().map(square).sum::<f64>() / n).sqrt()
}

/// A real graph with wrong closures and true poses: the map must not get worse than its odometry.
fn bicocca(folder: &Path) -> Result<(), Box<dyn Error>> {
    let Ok(truth) = Truth::read(folder) else {
        println!("skipped: {} not present", folder.display());
        return Ok(());
    };
    println!("| graph | method | suspects | rejected | RMSE to the truth, m | s |");
    println!("|---|---|---|---|---|---|");
    for name in ["B25b_lc-44-type-random-n-1.g2o.gz", "B25b_lc-178-type-local-n-1.g2o.gz"] {
        let mut file = g2o::read(BufReader::new(File::open(folder.join(name))?))?;
        let indefinite = file.take_indefinite().len();
        let graph = file.pose_problem()?.graph;
        let trusted: Vec<bool> = graph.springs().iter().map(is_odometry).collect();
        let suspects = trusted.iter().filter(|t| !**t).count();
        println!(
            "| {name} ({indefinite} indefinite left out) | odometry | {suspects} | {suspects} | {:.3} | |",
            aligned_error(&truth.pairs(&graph.odometry()))
        );
        for (label, method) in methods() {
            let before = Instant::now();
            let options = RobustOptions { method, ..Default::default() };
            let robust = relax_poses_robustly(&graph, &trusted, &options, &PoseOptions::default())?;
            println!(
                "| {name} | {label} | {suspects} | {} | {:.3} | {:.2} |",
                robust.rejected.len(),
                aligned_error(&truth.pairs(&robust.poses)),
                before.elapsed().as_secs_f64()
            );
        }
    }
    Ok(())
}

/// True poses at instants, and the instants of the nodes.
struct Truth {
    nodes: Vec<f64>,
    poses: Vec<(f64, Pose)>,
}

impl Truth {
    fn read(folder: &Path) -> Result<Self, Box<dyn Error>> {
        let numbers = |name: &str| -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
            let text = std::fs::read_to_string(folder.join(name))?;
            Ok(text
                .lines()
                .map(|line| line.split_whitespace().filter_map(|word| word.parse().ok()).collect())
                .collect())
        };
        let nodes = numbers("B25b_pose_timestamps.txt")?.iter().filter_map(|row| row.last().copied()).collect();
        let stamps = numbers("groundtruth_timestamps.txt")?;
        let rows = numbers("groundtruth_vertices.txt")?;
        let poses = stamps
            .iter()
            .zip(&rows)
            .filter_map(|(stamp, row)| Some((*stamp.last()?, Pose::new(*row.get(1)?, *row.get(2)?, *row.get(3)?))))
            .collect();
        Ok(Self { nodes, poses })
    }

    /// Estimated and true poses of the nodes recorded within 50 ms of a true pose.
    fn pairs(&self, estimated: &[Pose]) -> Vec<(Pose, Pose)> {
        let mut pairs = Vec::new();
        for (pose, stamp) in estimated.iter().zip(&self.nodes) {
            let after = self.poses.partition_point(|(t, _)| t < stamp);
            let near = self.poses[after.saturating_sub(1)..self.poses.len().min(after + 1)].iter();
            let nearest = near.min_by(|a, b| (a.0 - stamp).abs().total_cmp(&(b.0 - stamp).abs()));
            if let Some((_, truth)) = nearest.filter(|(t, _)| (t - stamp).abs() <= 0.05) {
                pairs.push((*pose, *truth));
            }
        }
        pairs
    }
}

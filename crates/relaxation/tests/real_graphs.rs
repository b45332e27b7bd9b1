//! Public pose graphs of the field, to the optimum from their springs alone. Their files are not part of the project: without them the tests say so.

#![expect(clippy::print_stdout, reason = "a skipped test says so")]

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use relaxation::{PoseOptions, g2o, relax_poses};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/posegraph")
}

fn read(name: &str) -> Option<g2o::Graph> {
    let path = folder().join(name);
    match File::open(&path) {
        Ok(file) => Some(g2o::read(BufReader::new(file)).unwrap()),
        Err(_) => {
            println!("skipped: {} not present", path.display());
            None
        }
    }
}

/// Optimal χ² as an independent program found it from the best of several starts.
const OPTIMA: [(&str, f64); 9] = [
    ("M3500.g2o", 137.913),
    ("M3500a_toro.graph", 912.115),
    ("M3500b.g2o", 2054.716),
    ("manhattanOlson3500.g2o", 146.077),
    ("city10000.g2o", 511.985),
    ("ring.g2o", 11.1631),
    ("w100_toro.graph", 1.13783),
    ("FRH_toro.graph", 1.93137e-4),
    ("kitti_05.g2o", 157.104),
];

#[test]
fn every_graph_reaches_its_optimum_from_its_springs_alone() {
    for (name, optimum) in OPTIMA {
        let Some(graph) = read(name) else { continue };
        let problem = graph.pose_problem().unwrap();
        let relaxed = relax_poses(&problem.graph, &PoseOptions::default()).unwrap();
        assert!(relaxed.converged, "{name}");
        // Six digits: half a unit of the last one printed, and the tolerance of the descent.
        let unit = 10f64.powf(optimum.log10().floor() - 5.0);
        let chi2 = problem.graph.chi2(&relaxed.poses);
        assert!((chi2 - optimum).abs() < 0.51 * unit, "{name}: {chi2} instead of {optimum}");
    }
}

#[test]
fn files_read_back_as_they_were_written() {
    for (name, _) in OPTIMA {
        let Some(mut graph) = read(name) else { continue };
        let mut text = Vec::new();
        g2o::write_gzip(&graph, &mut text).unwrap();
        graph.skipped.clear();
        assert_eq!(g2o::read(&text[..]).unwrap(), graph, "{name}");
    }
}

#[test]
fn chi2_of_the_files_own_poses_is_what_other_programs_compute() {
    for (name, expected) in
        [("M3500.g2o", 2.5667e6), ("M3500b.g2o", 4.133e7), ("city10000.g2o", 6.5416e8), ("w100_toro.graph", 76.95)]
    {
        let Some(graph) = read(name) else { continue };
        let problem = graph.pose_problem().unwrap();
        let chi2 = problem.graph.chi2(&problem.start);
        assert!((chi2 / expected - 1.0).abs() < 1e-4, "{name}: {chi2}");
    }
}

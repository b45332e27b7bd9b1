//! False closures among true ones on public graphs. Their files are not part of the project: without them the tests say so.
#![expect(clippy::print_stdout, reason = "a skipped test says so")]

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use relaxation::{Pose, PoseGraph, PoseOptions, PoseSpring, RobustOptions, g2o, relax_poses, relax_poses_robustly};

fn read(name: &str) -> Option<PoseGraph> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/posegraph").join(name);
    match File::open(&path) {
        Ok(file) => Some(g2o::read(BufReader::new(file)).unwrap().pose_problem().unwrap().graph),
        Err(_) => {
            println!("skipped: {} not present", path.display());
            None
        }
    }
}

#[test]
fn random_false_closures_are_all_found_and_no_true_one_is_lost() {
    for (name, count, seed) in [("ring.g2o", 200, 1), ("ring.g2o", 20, 2), ("M3500.g2o", 100, 3)] {
        let Some(clean) = read(name) else { continue };
        let mut random = Pcg64Mcg::new(seed);
        let mut springs = clean.springs().to_vec();
        let information = springs[springs.len() - 1].information;
        while springs.len() < clean.springs().len() + count {
            let (from, to) = (random.random_range(0..clean.len()), random.random_range(0..clean.len()));
            if from + 20 <= to {
                let mut within = |size: f64| random.random_range(-size..size);
                springs.push(PoseSpring {
                    from,
                    to,
                    from_to: Pose::new(within(2.0), within(2.0), within(3.1)),
                    information,
                });
            }
        }
        let graph = PoseGraph::new(clean.len(), &springs).unwrap();
        let trusted: Vec<bool> = springs.iter().map(|s| s.from.abs_diff(s.to) == 1).collect();
        let options = PoseOptions::default();
        let robust = relax_poses_robustly(&graph, &trusted, &RobustOptions::default(), &options).unwrap();
        let false_ones: Vec<usize> = (clean.springs().len()..springs.len()).collect();
        assert_eq!(robust.rejected, false_ones, "{name}");
        let optimum = relax_poses(&clean, &options).unwrap();
        let worst = robust
            .poses
            .iter()
            .zip(&optimum.poses)
            .map(|(a, b)| (a.translation() - b.translation()).norm())
            .fold(0.0, f64::max);
        assert!(worst < 1e-3, "{name}: {worst} m");
    }
}

use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::descend::system;
use super::*;
use crate::solver::Solver;

fn random_information(random: &mut Pcg64Mcg) -> Matrix3<f64> {
    let a = Matrix3::from_fn(|_, _| random.random_range(-1.0..1.0));
    let m = a * a.transpose() + Matrix3::identity() * 0.3;
    (m + m.transpose()) * 0.5
}

fn random_pose(random: &mut Pcg64Mcg) -> Pose {
    Pose::new(random.random_range(-3.0..3.0), random.random_range(-3.0..3.0), random.random_range(-3.0..3.0))
}

/// A connected graph with noise and full information matrices, and poses near the truth.
fn random_graph(nodes: usize, extra: usize, noise: f64, seed: u128) -> (PoseGraph, Vec<Pose>) {
    let mut random = Pcg64Mcg::new(seed);
    let truth: Vec<Pose> = (0..nodes).map(|_| random_pose(&mut random)).collect();
    let mut springs = Vec::new();
    for k in 0..nodes - 1 + extra {
        let (from, to) =
            if k < nodes - 1 { (k, k + 1) } else { (random.random_range(0..nodes), random.random_range(0..nodes)) };
        let z = truth[from].between(truth[to]);
        let mut off = || noise * random.random_range(-1.0..1.0);
        let from_to = Pose::new(z.x + off(), z.y + off(), z.heading + off());
        springs.push(PoseSpring { from, to, from_to, information: random_information(&mut random) });
    }
    (PoseGraph::new(nodes, &springs).unwrap(), truth)
}

fn moved(poses: &[Pose], by: &DVector<f64>) -> Vec<Pose> {
    let step = |(k, p): (usize, &Pose)| Pose::new(p.x + by[3 * k], p.y + by[3 * k + 1], p.heading + by[3 * k + 2]);
    poses.iter().enumerate().map(step).collect()
}

/// JᵀIJ and −JᵀIe with Jacobians by central differences of the plain definition of the error.
fn by_differences(graph: &PoseGraph, poses: &[Pose]) -> (DMatrix<f64>, DVector<f64>) {
    let size = 3 * graph.len();
    let (mut hessian, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
    let h = 1e-6;
    for spring in graph.springs() {
        let e = spring.error(poses[spring.from], poses[spring.to]);
        let mut jacobian = DMatrix::zeros(3, size);
        for k in [spring.from, spring.to].into_iter().flat_map(|node| 3 * node..3 * node + 3) {
            let mut by = DVector::zeros(size);
            by[k] = h;
            let (plus, minus) = (moved(poses, &by), moved(poses, &-by));
            let difference: Vector3<f64> =
                spring.error(plus[spring.from], plus[spring.to]) - spring.error(minus[spring.from], minus[spring.to]);
            jacobian.set_column(k, &DVector::from_column_slice((difference / (2.0 * h)).as_slice()));
        }
        hessian += jacobian.transpose() * spring.information * &jacobian;
        right -= jacobian.transpose() * spring.information * e;
    }
    (hessian, right)
}

#[test]
fn analytic_jacobians_equal_differences() {
    let (graph, _) = random_graph(6, 7, 0.5, 11);
    let mut random = Pcg64Mcg::new(12);
    let poses: Vec<Pose> =
        (0..graph.len()).map(|k| graph.held(k).unwrap_or_else(|| random_pose(&mut random))).collect();
    let (hessian, right) = by_differences(&graph, &poses);
    let (hessian, right) = (hessian.remove_rows(0, 3).remove_columns(0, 3), right.remove_rows(0, 3));
    let mut system = system(&graph);
    let mut matrix = system.unknowns.matrix(3);
    let mut got = vec![0.0; right.len()];
    let chi2 = system.linearize(&poses, &mut matrix, &mut got);
    assert_relative_eq!(chi2, graph.chi2(&poses), max_relative = 1e-12);
    assert_relative_eq!(DVector::from_column_slice(&got), right, max_relative = 1e-6, epsilon = 1e-6);
    matrix.factorize().unwrap();
    // The matrix is compared through its inverse, column by column.
    let inverse = hessian.try_inverse().unwrap();
    for k in 0..right.len() {
        let mut unit = vec![0.0; right.len()];
        unit[k] = 1.0;
        matrix.solve(&mut unit);
        assert_relative_eq!(
            DVector::from_vec(unit),
            inverse.column(k).into_owned(),
            max_relative = 1e-5,
            epsilon = 1e-6
        );
    }
}

#[test]
fn consistent_springs_are_satisfied_exactly() {
    let (graph, truth) = random_graph(40, 30, 0.0, 3);
    let relaxed = relax_poses(&graph, &PoseOptions::default()).unwrap();
    assert!(relaxed.converged && relaxed.chi2 < 1e-20, "{relaxed:?}");
    let map_from_truth = relaxed.poses[0].compose(truth[0].inverse());
    for (pose, truth) in relaxed.poses.iter().zip(&truth) {
        let off = pose.between(map_from_truth.compose(*truth));
        assert!(off.x.abs() + off.y.abs() + off.heading.abs() < 1e-9);
    }
}

#[test]
fn the_minimum_has_no_force_left() {
    let (graph, _) = random_graph(30, 40, 0.1, 4);
    let relaxed = relax_poses(&graph, &PoseOptions { tolerance: 1e-14, ..PoseOptions::default() }).unwrap();
    let (_, right) = by_differences(&graph, &relaxed.poses);
    assert!(right.rows(3, right.len() - 3).amax() < 1e-5, "{}", right.amax());
}

#[test]
fn where_the_first_node_is_held_moves_the_whole_map_and_nothing_else() {
    let (graph, _) = random_graph(20, 15, 0.1, 5);
    let here = relax_poses(&graph, &PoseOptions::default()).unwrap();
    let elsewhere = Pose::new(100.0, -50.0, 2.0);
    let moved = relax_poses(&graph.clone().with_held(&[(0, elsewhere)]).unwrap(), &PoseOptions::default()).unwrap();
    assert_relative_eq!(here.chi2, moved.chi2, max_relative = 1e-9);
    for (a, b) in here.poses.iter().zip(&moved.poses) {
        let off = elsewhere.compose(*a).between(*b);
        assert!(off.x.abs() + off.y.abs() + off.heading.abs() < 1e-6);
    }
    let far = graph.with_held(&[(7, Pose::default())]).unwrap();
    assert_relative_eq!(relax_poses(&far, &PoseOptions::default()).unwrap().chi2, here.chi2, max_relative = 1e-9);
}

#[test]
fn reversing_a_spring_changes_nothing() {
    let (graph, _) = random_graph(12, 10, 0.1, 6);
    let mut springs = graph.springs().to_vec();
    for spring in springs.iter_mut().step_by(2) {
        // e' = −Ad e: the error as seen from the other side, so the information turns with it.
        let z = spring.from_to;
        let back = z.inverse();
        let (s, c) = z.heading.sin_cos();
        // First order of e ↦ z (exp(e))⁻¹ z⁻¹.
        let adjoint = Matrix3::new(-c, s, -z.y, -s, -c, z.x, 0.0, 0.0, -1.0);
        let inverse = adjoint.try_inverse().unwrap();
        let information = inverse.transpose() * spring.information * inverse;
        let information = (information + information.transpose()) * 0.5;
        *spring = PoseSpring { from: spring.to, to: spring.from, from_to: back, information };
    }
    let reversed = PoseGraph::new(12, &springs).unwrap();
    let (a, b) = (
        relax_poses(&graph, &PoseOptions::default()).unwrap(),
        relax_poses(&reversed, &PoseOptions::default()).unwrap(),
    );
    // Equal to first order in the errors, which are a tenth.
    assert_relative_eq!(a.chi2, b.chi2, max_relative = 0.1);
}

#[test]
fn known_headings_make_it_the_linear_problem_of_the_paper() {
    let (graph, truth) = random_graph(25, 20, 0.2, 8);
    let mut poses: Vec<Pose> = truth.clone();
    poses[0] = Pose::default();
    let headings: Vec<f64> = poses.iter().map(|pose| pose.heading).collect();
    positions::place(&graph, &system(&graph), &mut poses).unwrap();
    let network = graph.network(&headings).unwrap();
    let relaxed = crate::Direct.solve(&network, &network.dead_reckoning());
    for (pose, position) in poses.iter().zip(&relaxed.positions) {
        assert_relative_eq!(pose.translation(), position.coords, epsilon = 1e-9);
    }
    // No other positions with these headings have a lower χ².
    let least = graph.chi2(&poses);
    let mut random = Pcg64Mcg::new(9);
    for _ in 0..20 {
        let mut other = poses.clone();
        other[random.random_range(1..25)].x += random.random_range(-0.1..0.1);
        assert!(graph.chi2(&other) >= least);
    }
}

#[test]
fn components_empty_graphs_single_nodes_loops_and_parallel_springs_are_no_problem() {
    let empty = PoseGraph::new(0, &[]).unwrap();
    assert!(relax_poses(&empty, &PoseOptions::default()).unwrap().poses.is_empty());
    let one = PoseGraph::new(1, &[]).unwrap();
    assert_eq!(relax_poses(&one, &PoseOptions::default()).unwrap().poses, [Pose::default()]);
    let spring =
        |from, to, x| PoseSpring { from, to, from_to: Pose::new(x, 0.0, 0.0), information: Matrix3::identity() };
    let graph =
        PoseGraph::new(5, &[spring(0, 1, 1.0), spring(1, 0, -1.2), spring(2, 2, 0.5), spring(3, 4, 2.0)]).unwrap();
    assert_eq!(graph.components(), 3);
    let relaxed = relax_poses(&graph, &PoseOptions::default()).unwrap();
    assert_relative_eq!(relaxed.poses[1].x, 1.1, epsilon = 1e-9);
    assert_relative_eq!(relaxed.poses[4].x, 2.0, epsilon = 1e-9);
    assert_relative_eq!(relaxed.chi2, 0.02 + 0.25, epsilon = 1e-9);
}

#[test]
fn wrong_input_is_an_error_that_names_it() {
    let good = PoseSpring { from: 0, to: 1, from_to: Pose::default(), information: Matrix3::identity() };
    let error = |spring: PoseSpring| PoseGraph::new(2, &[good, spring]).unwrap_err().to_string();
    assert_eq!(
        error(PoseSpring { to: 2, ..good }),
        "spring 1: node 2 does not exist, there are 2 nodes (numbered from 0)"
    );
    assert!(error(PoseSpring { from_to: Pose::new(f64::NAN, 0.0, 0.0), ..good }).contains("must be finite"));
    for wrong in [
        Matrix3::zeros(),
        -Matrix3::identity(),
        Matrix3::from_diagonal(&Vector3::new(1.0, f64::NAN, 1.0)),
        Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, f64::INFINITY)),
        Matrix3::new(1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        Matrix3::new(1.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    ] {
        assert!(
            error(PoseSpring { information: wrong, ..good }).contains("symmetric and positive definite"),
            "{wrong}"
        );
    }
    let graph = PoseGraph::new(2, &[good]).unwrap();
    assert!(graph.reweighted(&[1.0, 1.0]).is_err() && graph.reweighted(&[-1.0]).is_err());
    assert!(graph.clone().with_held(&[(5, Pose::default())]).is_err());
    let short = descend(&graph, &[Pose::default()], &PoseOptions::default()).unwrap_err();
    assert_eq!(short.to_string(), "start: expected 2 finite poses, got 1 (first that is wrong: 1)");
}

#[test]
fn far_coordinates_and_uneven_weights_still_converge() {
    let (graph, _) = random_graph(20, 15, 0.1, 10);
    let mut springs = graph.springs().to_vec();
    for (spring, power) in springs.iter_mut().zip((-6..=6).cycle()) {
        spring.information *= 10f64.powi(power);
    }
    let graph = PoseGraph::new(20, &springs).unwrap();
    let relaxed = relax_poses(&graph, &PoseOptions::default()).unwrap();
    assert!(relaxed.converged, "{relaxed:?}");
    let far = graph.with_held(&[(0, Pose::new(1e12, -1e12, 0.3))]).unwrap();
    let there = relax_poses(&far, &PoseOptions::default()).unwrap();
    assert!(there.poses.iter().all(|pose| pose.is_finite()));
}

#[test]
fn springs_of_weight_zero_are_as_if_they_were_not_there() {
    let (graph, _) = random_graph(20, 15, 0.3, 13);
    let mut springs = graph.springs().to_vec();
    let off = PoseSpring { from: 3, to: 17, from_to: Pose::new(50.0, 0.0, 3.0), information: Matrix3::identity() };
    springs.push(off);
    let mut weights = vec![1.0; springs.len()];
    weights[springs.len() - 1] = 0.0;
    let with = PoseGraph::new(20, &springs).unwrap().reweighted(&weights).unwrap();
    let options = PoseOptions::default();
    assert_relative_eq!(
        relax_poses(&with, &options).unwrap().chi2,
        relax_poses(&graph, &options).unwrap().chi2,
        max_relative = 1e-9
    );
}

/// A long walk in a city of blocks, with few closures and headings so noisy that no single start is safe.
fn noisy_walk(nodes: usize, closures: usize, sh: f64, seed: u128) -> PoseGraph {
    let st = 0.05;
    let random = &mut Pcg64Mcg::new(seed);
    let mut gauss = {
        let mut r = Pcg64Mcg::new(random.random());
        move || (-2.0 * r.random::<f64>().max(1e-300).ln()).sqrt() * (std::f64::consts::TAU * r.random::<f64>()).cos()
    };
    let mut truth = vec![Pose::default()];
    for k in 1..nodes {
        let corner = [-1.0, 0.0, 0.0, 1.0][random.random_range(0..4)] * std::f64::consts::FRAC_PI_2;
        let turn = if k % 3 == 0 { corner } else { 0.0 };
        truth.push(truth[k - 1].compose(Pose::new(1.0, 0.0, turn)));
    }
    let mut springs = vec![];
    let mut add = |from: usize, to: usize| {
        let z = truth[from].between(truth[to]);
        let (sx, sy) = (st, 0.3 * st);
        let n = Pose::new(z.x + sx * gauss(), z.y + sy * gauss(), z.heading + sh * gauss());
        // Noise along the axes of the first node, as seen from the measured pose.
        let r = nalgebra::Rotation2::new(-n.heading).into_inner();
        let it = r * Matrix2::new(1.0 / (sx * sx), 0.0, 0.0, 1.0 / (sy * sy)) * r.transpose();
        let m = it[(0, 1)];
        springs.push(PoseSpring {
            from,
            to,
            from_to: n,
            information: Matrix3::new(it[(0, 0)], m, 0.0, m, it[(1, 1)], 0.0, 0.0, 0.0, 1.0 / (sh * sh)),
        });
    };
    for k in 1..nodes {
        add(k - 1, k);
    }
    let mut tries = 0;
    let mut done = 0;
    while done < closures && tries < 1_000_000 {
        tries += 1;
        let (a, b) = (random.random_range(0..nodes), random.random_range(0..nodes));
        if a + 20 < b && (truth[a].translation() - truth[b].translation()).norm() < 2.0 {
            add(a, b);
            done += 1;
        }
    }
    PoseGraph::new(nodes, &springs).unwrap()
}

#[test]
fn where_one_start_fails_the_search_goes_lower() {
    let options = PoseOptions::default();
    let mut helped = 0;
    for seed in [5, 82, 159, 236, 313] {
        let graph = noisy_walk(600, 15, 0.15, seed);
        let alone = descend(&graph, &starts::chordal_start(&graph, &system(&graph)).unwrap(), &options).unwrap();
        let best = relax_poses(&graph, &options).unwrap();
        assert!(best.converged && best.chi2 <= alone.chi2 * (1.0 + 1e-9));
        assert_relative_eq!(best.chi2, graph.chi2(&best.poses), max_relative = 1e-9);
        helped += usize::from(best.chi2 < 0.9999 * alone.chi2);
    }
    assert!(helped > 0, "every first start was the best one: these graphs are too easy to test anything");
}

#[test]
fn no_minimum_is_accepted_that_dead_reckoning_is_below() {
    // A square with a spring that claims two opposite corners to be one place: the headings' start is led astray.
    let spring = |from, to, x, heading: f64| PoseSpring {
        from,
        to,
        from_to: Pose::new(x, 0.0, heading),
        information: Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 400.0)),
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let sides = [spring(0, 1, 1.0, quarter), spring(1, 2, 1.0, quarter), spring(2, 3, 1.0, quarter)];
    let closures = [spring(3, 0, 1.2, quarter), spring(0, 2, 0.0, 0.0)];
    let graph = PoseGraph::new(4, &[&sides[..], &closures].concat()).unwrap();
    let relaxed = relax_poses(&graph, &PoseOptions::default()).unwrap();
    assert!(relaxed.converged && relaxed.chi2 < graph.chi2(&graph.odometry()), "{}", relaxed.chi2);
}

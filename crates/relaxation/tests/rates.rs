//! How fast the iterations converge, where the rate is known.

use std::f64::consts::PI;

use nalgebra::{Point2, Vector2};
use relaxation::{
    Elimination, GaussSeidel, Multilevel, Network, NodeVariances, RelaxOptions, Solver, Sor, Spring, SweepOrder, sweep,
    sweep_with_variances,
};

use crate::problems::grid;

/// A loop of unit springs that does not close by a metre.
fn ring(nodes: usize) -> Network {
    let springs: Vec<_> = (0..nodes)
        .map(|i| {
            let angle = 2.0 * PI * (i as f64 + 0.5) / nodes as f64;
            let gap = if i == 0 { 1.0 } else { 0.0 };
            Spring::isotropic(i, (i + 1) % nodes, Vector2::new(angle.cos() + gap, angle.sin()), 1.0)
        })
        .collect();
    Network::from_vec(nodes, springs).unwrap()
}

fn distance(a: &[Point2<f64>], b: &[Point2<f64>]) -> f64 {
    a.iter().zip(b).map(|(p, q)| (p - q).norm_squared()).sum::<f64>().sqrt()
}

#[test]
fn gauss_seidel_on_a_ring_of_116_shrinks_the_error_by_cos_squared() {
    let network = ring(116);
    let best = Elimination.solve(&network, &network.dead_reckoning()).positions;
    // Dead reckoning goes round both sides, so the slowest error, which has one sign all round, must be put in.
    let mut positions = best.clone();
    positions[1..].iter_mut().for_each(|p| p.x += 1.0);
    (0..4000).for_each(|_| sweep(&network, &mut positions));
    let before = distance(&positions, &best);
    (0..1000).for_each(|_| sweep(&network, &mut positions));
    let rate = (distance(&positions, &best) / before).powf(1e-3);
    let expected = (PI / 116.0).cos().powi(2);
    assert!((rate - expected).abs() < 1e-5, "{rate} against {expected}");
}

/// The factor by which a V-cycle shrinks the error, measured over the last of several.
fn multilevel_factor(network: &Network) -> f64 {
    let best = Elimination.solve(network, &network.dead_reckoning()).positions;
    let after = |cycles| {
        let options = RelaxOptions { max_sweeps: cycles, tolerance: 0.0 };
        distance(&Multilevel { options }.solve(network, &vec![Point2::origin(); network.len()]).positions, &best)
    };
    (after(9) / after(5)).powf(0.25)
}

#[test]
fn multilevel_cycles_shrink_the_error_on_rings_of_any_length() {
    for nodes in [116, 1024] {
        let factor = multilevel_factor(&ring(nodes));
        assert!(factor < 0.3, "ring of {nodes}: {factor}");
    }
}

#[test]
fn multilevel_cycles_shrink_the_error_on_grids() {
    let springs: Vec<_> =
        grid(40, 40).into_iter().map(|(i, j)| Spring::isotropic(i, j, Vector2::new(1.0, 0.5), 1.0)).collect();
    let factor = multilevel_factor(&Network::from_vec(1600, springs).unwrap());
    assert!(factor < 0.8, "{factor}");
}

#[test]
fn over_relaxation_needs_far_fewer_sweeps_on_a_ring() {
    let network = ring(116);
    let start = network.dead_reckoning();
    let plain = GaussSeidel { order: SweepOrder::Forward, ..GaussSeidel::default() }.solve(&network, &start);
    let over = Sor::for_loop_of(116).solve(&network, &start);
    assert!(plain.converged && over.converged);
    assert!(over.sweeps * 15 < plain.sweeps, "{} against {}", over.sweeps, plain.sweeps);
    assert!(Sor::new(2.0).is_err() && Sor::new(0.0).is_err() && Sor::new(f64::NAN).is_err());
}

#[test]
fn node_variances_count_evidence_twice_and_miss_the_optimum() {
    let unit = |from, to, x, y| Spring::isotropic(from, to, Vector2::new(x, y), 1.0);
    let path = Network::new(3, &[unit(0, 1, 1.0, 0.0), unit(1, 2, 1.0, 0.0)]).unwrap();
    let (mut positions, mut variances) = (path.dead_reckoning(), vec![0.0; 3]);
    (0..100).for_each(|_| sweep_with_variances(&path, &mut positions, &mut variances));
    assert!((variances[1] - (3_f64.sqrt() - 1.0)).abs() < 1e-12 && (variances[2] - 3_f64.sqrt()).abs() < 1e-12);
    assert_eq!(positions, path.dead_reckoning());

    let square = [unit(0, 1, 1.0, 0.0), unit(1, 2, 0.0, 1.0), unit(2, 3, -1.0, 0.0), unit(3, 0, 0.4, -1.0)];
    let square = Network::new(4, &square).unwrap();
    let options = RelaxOptions { max_sweeps: 1000, ..RelaxOptions::default() };
    let stopped = NodeVariances { options }.solve(&square, &square.dead_reckoning());
    assert!(!stopped.converged);
    assert!((stopped.energy - 0.0434).abs() < 5e-5, "{}", stopped.energy);
}

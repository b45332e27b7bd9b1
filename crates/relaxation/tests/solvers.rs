//! All solvers on all problems, with the direct solution as oracle.

use approx::assert_relative_eq;
use nalgebra::{Point2, Rotation2, Vector2};
use proptest::prelude::*;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use relaxation::{
    Anchor, Auto, ConjugateGradient, Direct, DirectFactor, Elimination, GaussSeidel, Multilevel, Network,
    Preconditioner, RelaxOptions, Relaxed, Solver, Sor, Spring, SweepOrder, gap_bound, optimum, sweep,
};

use crate::problems;

fn solvers() -> Vec<Box<dyn Solver>> {
    let options = RelaxOptions { max_sweeps: 400_000, tolerance: 1e-9 };
    let mut sor = Sor::for_loop_of(60);
    sor.options = options;
    vec![
        Box::new(Auto),
        Box::new(Elimination),
        Box::new(GaussSeidel { options, order: SweepOrder::Forward }),
        Box::new(GaussSeidel { options, order: SweepOrder::Symmetric }),
        Box::new(sor),
        Box::new(ConjugateGradient { options, preconditioner: Preconditioner::Diagonal }),
        Box::new(ConjugateGradient { options, preconditioner: Preconditioner::Multilevel }),
        Box::new(Multilevel { options }),
    ]
}

#[test]
fn every_solver_finds_what_the_direct_solution_finds() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for problem in problems::all() {
        let network = &problem.network;
        let start: Vec<_> =
            (0..network.len()).map(|_| Point2::new(rng.random_range(-9.0..9.0), rng.random_range(-9.0..9.0))).collect();
        let oracle = Direct.solve(network, &start);
        assert!(oracle.converged, "{}: {} above the optimum", problem.name, oracle.gap);
        for solver in solvers() {
            let found = solver.solve(network, &start);
            let what = format!("{} on {}", solver.name(), problem.name);
            assert!(found.converged, "{what}: {} sweeps, energy {}, gap {}", found.sweeps, found.energy, found.gap);
            // The proof must hold: the energy is above the optimum by no more than the gap says (but for rounding).
            let rounding = 1e-12 * (1.0 + oracle.energy);
            assert!(found.energy - oracle.energy <= found.gap + rounding, "{what}");
            assert!(found.energy >= oracle.energy - rounding, "{what} is better than the oracle");
            assert_close(&found, &oracle, &what);
        }
    }
}

fn assert_close(found: &Relaxed, oracle: &Relaxed, what: &str) {
    for (node, (p, q)) in found.positions.iter().zip(&oracle.positions).enumerate() {
        // An energy within 1e-9 of the optimum leaves positions within its square root, times their standard deviation.
        assert!((p - q).norm() < 1e-4, "{what}: node {node} at {p}, the direct solution has {q}");
    }
}

#[test]
fn the_exact_solvers_agree_to_the_last_digits() {
    for problem in problems::all() {
        let start = problem.network.dead_reckoning();
        let (a, b) = (Direct.solve(&problem.network, &start), Elimination.solve(&problem.network, &start));
        for (p, q) in a.positions.iter().zip(&b.positions) {
            assert_relative_eq!(p, q, epsilon = 1e-11, max_relative = 1e-11);
        }
    }
}

#[test]
fn a_kept_factor_serves_other_weights_and_refuses_other_shapes() {
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let springs = problems::random(&mut rng, 50, 90);
    let network = Network::new(50, &springs).unwrap();
    let mut factor = DirectFactor::new(&network).unwrap();
    let weights: Vec<f64> = springs.iter().map(|_| rng.random_range(0.1..2.0)).collect();
    let soft = network.reweighted(&weights).unwrap();
    factor.refactor(&soft).unwrap();
    let found = factor.solve(&soft, &soft.dead_reckoning());
    for (p, q) in found.positions.iter().zip(optimum(&soft).unwrap()) {
        assert_relative_eq!(p, &q, epsilon = 1e-11);
    }
    let other = Network::new(50, &springs[..80]).unwrap();
    assert!(factor.refactor(&other).is_err());
}

#[test]
fn stiffnesses_twelve_orders_apart_are_solved_right() {
    // A loop of soft springs in which two stiff ones contradict each other: the stiff ones have the say.
    let spring = |from, to, x, variance| Spring::isotropic(from, to, Vector2::new(x, 0.0), variance);
    let springs = [
        spring(0, 1, 1.0, 1e-6),
        spring(1, 2, 1.0, 1e6),
        spring(2, 3, 1.0, 1e-6),
        spring(0, 3, 3.5, 1e-6),
        spring(0, 2, 2.2, 1e6),
    ];
    let network = Network::new(4, &springs).unwrap();
    let found = optimum(&network).unwrap();
    // Node 3 hangs from 0 at 3.5, node 2 from 3 at 2.5; nothing soft pulls against that by more than 1e-12.
    for (p, x) in found.iter().zip([0.0, 1.0, 2.5, 3.5]) {
        assert_relative_eq!(p.x, x, epsilon = 1e-11);
    }
    let relaxed = Elimination.solve(&network, &network.dead_reckoning());
    assert!(relaxed.converged && relaxed.gap <= 1e-12 * relaxed.energy, "{relaxed:?}");

    let mut rng = Pcg64Mcg::seed_from_u64(12);
    let mut springs = problems::random(&mut rng, 300, 700);
    for s in &mut springs {
        *s = Spring::isotropic(s.from, s.to, s.rest, 10_f64.powf(rng.random_range(-6.0..6.0)));
    }
    let network = Network::from_vec(300, springs).unwrap();
    let relaxed = Elimination.solve(&network, &network.dead_reckoning());
    assert!(relaxed.gap <= 1e-10 * relaxed.energy, "gap {} of {}", relaxed.gap, relaxed.energy);
}

#[test]
fn coordinates_of_a_million_kilometres_and_more_keep_their_shape() {
    let network = Network::new(60, &problems::random(&mut Pcg64Mcg::seed_from_u64(3), 60, 100)).unwrap();
    let near = optimum(&network).unwrap();
    let away = Vector2::new(1e12, -3e12);
    let anchor = Anchor { node: 0, position: Point2::origin() + away };
    let far = optimum(&network.with_anchors(&[anchor]).unwrap()).unwrap();
    for (p, q) in near.iter().zip(&far) {
        // A coordinate of 1e12 is a multiple of 1e-4 in 64 bits, one of 3e12 of 5e-4.
        assert!((q - away - p).norm() < 2e-3, "{p} {q}");
    }
    let long = Spring::isotropic(0, 1, Vector2::new(1e12, 1e12), 1.0);
    let network = Network::new(2, &[long, long, Spring { rest: Vector2::new(1e12 + 1.0, 1e12), ..long }]).unwrap();
    assert_relative_eq!(optimum(&network).unwrap()[1].x, 1e12 + 1.0 / 3.0, epsilon = 1e-3);
}

/// A connected network of a few places.
fn networks() -> impl Strategy<Value = (Vec<Spring>, usize, u64)> {
    (2_usize..40, 0_usize..60, any::<u64>()).prop_map(|(nodes, extra, seed)| {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        (problems::random(&mut rng, nodes, nodes - 1 + extra), nodes, seed)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn energy_never_rises_in_a_sweep((springs, nodes, seed) in networks()) {
        let network = Network::new(nodes, &springs).unwrap();
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut positions: Vec<_> =
            (0..nodes).map(|_| Point2::new(rng.random_range(-9.0..9.0), rng.random_range(-9.0..9.0))).collect();
        let mut before = network.energy(&positions);
        for _ in 0..20 {
            sweep(&network, &mut positions);
            let after = network.energy(&positions);
            prop_assert!(after <= before * (1.0 + 1e-13), "{before} -> {after}");
            before = after;
        }
    }

    #[test]
    fn the_answer_knows_no_numbering_order_or_direction((springs, nodes, seed) in networks()) {
        let expected = optimum(&Network::new(nodes, &springs).unwrap()).unwrap();
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut number: Vec<usize> = (0..nodes).collect();
        number.shuffle(&mut rng);
        let mut shuffled: Vec<Spring> = springs
            .iter()
            .map(|s| Spring { from: number[s.from], to: number[s.to], ..*s })
            .map(|s| if rng.random() { Spring { from: s.to, to: s.from, rest: -s.rest, ..s } } else { s })
            .collect();
        shuffled.shuffle(&mut rng);
        let anchor = Anchor { node: number[0], position: Point2::origin() };
        let found = optimum(&Network::from_vec(nodes, shuffled).unwrap().with_anchors(&[anchor]).unwrap()).unwrap();
        for (node, p) in expected.iter().enumerate() {
            prop_assert!((found[number[node]] - p).norm() < 1e-10);
        }
    }

    #[test]
    fn moving_and_turning_commute_with_solving((springs, nodes, _) in networks(), angle in -3.0..3.0_f64) {
        let turn = Rotation2::new(angle);
        let network = Network::new(nodes, &springs).unwrap();
        let turned: Vec<_> = springs.iter().map(|s| Spring { rest: turn * s.rest, ..*s }).collect();
        let away = Point2::new(100.0, -50.0);
        let turned = Network::from_vec(nodes, turned).unwrap();
        let turned = turned.with_anchors(&[Anchor { node: 0, position: away }]).unwrap();
        for (p, q) in optimum(&network).unwrap().iter().zip(optimum(&turned).unwrap()) {
            prop_assert!((away + turn * p.coords - q).norm() < 1e-10);
        }
    }

    #[test]
    fn the_gap_is_never_less_than_the_excess((springs, nodes, seed) in networks()) {
        let network = Network::new(nodes, &springs).unwrap();
        let best = network.energy(&optimum(&network).unwrap());
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut positions = network.dead_reckoning();
        for p in &mut positions[1..] {
            *p += Vector2::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
        }
        let excess = network.energy(&positions) - best;
        prop_assert!(gap_bound(&network, &positions) >= excess * (1.0 - 1e-9));
    }
}

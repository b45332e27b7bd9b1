//! Maps that grow and shrink stay at the optimum of what they are.

use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use relaxation::{Incremental, Network, Spring, optimum};

use crate::problems;

/// Compares with the direct solution of the same springs.
fn assert_optimal(map: &mut Incremental, what: &str) {
    let network = map.to_network();
    let expected = optimum(&network).unwrap();
    for (node, p) in expected.iter().enumerate().step_by(7) {
        let q = map.position(node);
        assert!((q - p).norm() < 1e-8 * (1.0 + p.coords.norm()), "{what}: node {node} alone at {q}, expected {p}");
    }
    for (node, (q, p)) in map.positions().iter().zip(&expected).enumerate() {
        assert!((q - p).norm() < 1e-8 * (1.0 + p.coords.norm()), "{what}: node {node} at {q}, expected {p}");
    }
}

#[test]
fn every_problem_grown_spring_by_spring_ends_at_its_optimum() {
    for problem in problems::all() {
        let mut map = Incremental::new();
        (0..problem.network.len()).for_each(|_| _ = map.add_node());
        for (index, &spring) in problem.network.springs().iter().enumerate() {
            assert_eq!(map.add_spring(spring).unwrap(), index);
            if index % 23 == 0 {
                assert_optimal(&mut map, &format!("{} after spring {index}", problem.name));
            }
        }
        assert_optimal(&mut map, &problem.name);
    }
}

#[test]
fn every_problem_taken_apart_stays_at_its_optimum() {
    for problem in problems::all() {
        let mut map = Incremental::from_network(&problem.network);
        let springs = problem.network.springs().len();
        for spring in (0..springs).step_by(5) {
            map.remove_spring(spring).unwrap();
            assert!(map.remove_spring(spring).is_err());
            if spring % 4 == 0 {
                assert_optimal(&mut map, &format!("{} without spring {spring}", problem.name));
            }
        }
        assert_optimal(&mut map, &problem.name);
    }
}

#[test]
fn a_tree_needs_no_factorisation() {
    let mut map = Incremental::new();
    map.add_node();
    for i in 1..1000 {
        let node = map.add_node();
        map.add_spring(Spring::isotropic(i / 2, node, Vector2::new(1.0, 0.5), 0.01)).unwrap();
    }
    assert_eq!(map.factorizations(), 0);
    assert_eq!(map.position(999), Point2::new(10.0, 5.0)); // ten springs from the root
    map.add_spring(Spring::isotropic(0, 999, Vector2::new(9.1, 4.5), 0.01)).unwrap();
    assert_eq!(map.factorizations(), 0);
    assert_optimal(&mut map, "tree with a closure");
}

#[test]
fn what_falls_off_stays_where_it_is() {
    let spring = |from, to| Spring::isotropic(from, to, Vector2::new(1.0, 0.0), 0.01);
    let mut map = Incremental::from_network(&Network::new(4, &[spring(0, 1), spring(1, 2), spring(2, 3)]).unwrap());
    map.remove_spring(1).unwrap();
    assert_eq!(map.positions().iter().map(|p| p.x).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0]);
    map.add_spring(Spring { rest: Vector2::new(5.0, 0.0), ..spring(1, 2) }).unwrap();
    assert_eq!(map.positions().iter().map(|p| p.x).collect::<Vec<_>>(), [0.0, 1.0, 6.0, 7.0]);
}

#[test]
fn a_bad_spring_leaves_the_map_as_it_was() {
    let mut map = Incremental::new();
    map.add_node();
    let error = map.add_spring(Spring::isotropic(0, 1, Vector2::zeros(), 1.0)).unwrap_err();
    assert!(error.to_string().starts_with("spring 0: node 1 does not exist"));
    assert_eq!(map.to_network().springs().len(), 0);
    assert_eq!(
        map.remove_spring(0).unwrap_err().to_string(),
        "there is no spring 0 (it never was, or is gone already)"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_sequence_of_changes_ends_at_the_optimum(seed in any::<u64>(), steps in 5_usize..120) {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut map = Incremental::new();
        map.add_node();
        let mut springs = 0;
        for _ in 0..steps {
            let nodes = map.len();
            match rng.random_range(0..10) {
                0..4 => {
                    let node = map.add_node();
                    map.add_spring(problems::measured(&mut rng, node, node - 1)).unwrap();
                    springs += 1;
                }
                4 => _ = map.add_node(),
                5..8 => {
                    let (a, b) = (rng.random_range(0..nodes), rng.random_range(0..nodes));
                    map.add_spring(problems::measured(&mut rng, a, b)).unwrap();
                    springs += 1;
                }
                _ if springs > 0 => _ = map.remove_spring(rng.random_range(0..springs)),
                _ => {}
            }
        }
        let network = map.to_network();
        for (p, q) in optimum(&network).unwrap().iter().zip(map.positions()) {
            prop_assert!((p - q).norm() < 1e-8, "{p} {q}");
        }
    }
}

//! Networks small enough to be solved by hand.

use approx::assert_relative_eq;
use nalgebra::{Matrix2, Point2, Vector2};
use relaxation::{Anchor, Network, RelaxOptions, Spring, gap_bound, optimum, relax, sweep};

fn unit(from: usize, to: usize, x: f64, y: f64) -> Spring {
    Spring::isotropic(from, to, Vector2::new(x, y), 1.0)
}

/// A square whose last side is 0.4 m off; `last` is the variance of that side.
fn square(last: f64) -> Network {
    let springs = [
        unit(0, 1, 1.0, 0.0),
        unit(1, 2, 0.0, 1.0),
        unit(2, 3, -1.0, 0.0),
        Spring::isotropic(3, 0, Vector2::new(0.4, -1.0), last),
    ];
    Network::new(4, &springs).unwrap()
}

fn assert_positions(found: &[Point2<f64>], expected: &[(f64, f64)], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (p, &(x, y)) in found.iter().zip(expected) {
        assert_relative_eq!(p, &Point2::new(x, y), epsilon = tolerance);
    }
}

#[test]
fn the_second_place_lies_where_the_first_link_leads() {
    let network = Network::new(2, &[unit(0, 1, 1.0, 0.0)]).unwrap();
    assert_positions(&optimum(&network).unwrap(), &[(0.0, 0.0), (1.0, 0.0)], 0.0);
    assert_eq!(network.energy(&optimum(&network).unwrap()), 0.0);
}

#[test]
fn the_double_sum_of_the_paper_is_twice_the_energy() {
    let network = square(1.0);
    let positions = [(0.3, 0.1), (1.2, -0.4), (0.0, 2.0), (-1.0, 0.5)].map(|(x, y)| Point2::new(x, y));
    let mut double = 0.0;
    for s in network.springs() {
        let (i, j) = (positions[s.from], positions[s.to]);
        double += (i - j + s.rest).norm_squared() + (j - i - s.rest).norm_squared();
    }
    assert_relative_eq!(double, 2.0 * network.energy(&positions), max_relative = 1e-14);
}

#[test]
fn four_equal_sides_share_the_closure_error_equally() {
    let network = square(1.0);
    let found = optimum(&network).unwrap();
    assert_positions(&found, &[(0.0, 0.0), (0.9, 0.0), (0.8, 1.0), (-0.3, 1.0)], 1e-14);
    assert_relative_eq!(network.energy(&found), 0.04, max_relative = 1e-13);
}

#[test]
fn a_side_takes_closure_error_in_proportion_to_its_variance() {
    let network = square(3.0);
    let found = optimum(&network).unwrap();
    assert_positions(&found, &[(0.0, 0.0), (14.0 / 15.0, 0.0), (13.0 / 15.0, 1.0), (-0.2, 1.0)], 1e-14);
    assert_relative_eq!(network.energy(&found), 0.16 / 6.0, max_relative = 1e-13);
}

#[test]
fn sweeps_reach_what_the_direct_solution_computes() {
    for last in [1.0, 3.0, 1e-3] {
        let network = square(last);
        let relaxed = relax(&network, &[Point2::origin(); 4], &RelaxOptions { tolerance: 1e-13, ..Default::default() });
        assert!(relaxed.converged, "{relaxed:?}");
        let expected: Vec<_> = optimum(&network).unwrap().iter().map(|p| (p.x, p.y)).collect();
        assert_positions(&relaxed.positions, &expected, 1e-6);
    }
}

#[test]
fn one_sweep_outward_makes_a_tree_exact() {
    // Numbered from the anchor outward, so index order is breadth-first order; a leaf pulls its parent, hence relax to the end.
    let springs = [unit(0, 1, 1.0, 0.0), unit(0, 2, 0.0, 1.0), unit(1, 3, 2.0, 0.5), unit(2, 4, -1.0, 1.0)];
    let network = Network::new(5, &springs).unwrap();
    let reckoned = network.dead_reckoning();
    assert_eq!(network.energy(&reckoned), 0.0);
    let mut swept = reckoned.clone();
    sweep(&network, &mut swept);
    assert_eq!(swept, reckoned);
}

#[test]
fn parallel_springs_act_as_their_inverse_variance_mean() {
    let springs =
        [Spring::isotropic(0, 1, Vector2::new(1.0, 0.0), 1.0), Spring::isotropic(1, 0, Vector2::new(-2.0, 0.0), 3.0)];
    let network = Network::new(2, &springs).unwrap();
    assert_positions(&optimum(&network).unwrap(), &[(0.0, 0.0), (1.25, 0.0)], 1e-15);
}

#[test]
fn a_self_spring_moves_nothing_and_adds_its_constant() {
    let network = Network::new(2, &[unit(0, 1, 1.0, 0.0), unit(1, 1, 0.5, 0.0)]).unwrap();
    let found = optimum(&network).unwrap();
    assert_positions(&found, &[(0.0, 0.0), (1.0, 0.0)], 0.0);
    assert_eq!(network.energy(&found), 0.25);
}

#[test]
fn each_component_hangs_from_its_own_anchor() {
    let network = Network::new(5, &[unit(0, 3, 1.0, 0.0), unit(4, 1, 0.0, 2.0)]).unwrap();
    assert_eq!(network.components(), 3);
    assert_eq!((network.component(3), network.component(4), network.component(2)), (0, 1, 2));
    let anchors = [Anchor { node: 4, position: Point2::new(10.0, 10.0) }];
    let network = network.with_anchors(&anchors).unwrap();
    let found = optimum(&network).unwrap();
    assert_positions(&found, &[(0.0, 0.0), (10.0, 12.0), (0.0, 0.0), (1.0, 0.0), (10.0, 10.0)], 1e-14);
}

#[test]
fn directional_certainty_bends_the_map_where_it_is_unsure() {
    // Sure along x, unsure along y, and the other way round: each measurement rules in its own direction.
    let sure_x = Matrix2::new(1e-4, 0.0, 0.0, 1.0);
    let sure_y = Matrix2::new(1.0, 0.0, 0.0, 1e-4);
    let springs = [
        Spring { from: 0, to: 1, rest: Vector2::new(1.0, 5.0), covariance: sure_x },
        Spring { from: 0, to: 1, rest: Vector2::new(3.0, 2.0), covariance: sure_y },
    ];
    let network = Network::new(2, &springs).unwrap();
    let expected = [(0.0, 0.0), ((1e4 + 3.0) / (1e4 + 1.0), (5.0 + 2e4) / (1e4 + 1.0))];
    assert_positions(&optimum(&network).unwrap(), &expected, 1e-12);
    let relaxed = relax(&network, &network.dead_reckoning(), &RelaxOptions::default());
    assert_positions(&relaxed.positions, &expected, 1e-12);
}

#[test]
fn a_weight_of_zero_takes_a_spring_out_and_may_split_the_map() {
    let network = square(1.0);
    let without_last = network.reweighted(&[1.0, 1.0, 1.0, 0.0]).unwrap();
    assert_eq!(without_last.energy(&optimum(&without_last).unwrap()), 0.0);
    let split = network.reweighted(&[1.0, 0.0, 1.0, 0.0]).unwrap();
    assert_eq!(split.components(), 2);
    assert_eq!(split.reweighted(&[1.0; 4]).unwrap().components(), 1);
}

#[test]
fn the_gap_is_exact_on_one_loop_cut_open() {
    // Dead reckoning leaves the whole closure error in one spring; the optimum spreads it.
    let network = square(1.0);
    let relaxed = relax(&network, &network.dead_reckoning(), &RelaxOptions { max_sweeps: 3, ..Default::default() });
    let excess = relaxed.energy - 0.04;
    let bound = gap_bound(&network, &relaxed.positions);
    assert!(excess > 0.0 && bound >= excess, "excess {excess}, bound {bound}");
    assert!(bound <= 4.0 * excess, "excess {excess}, bound {bound}");
}

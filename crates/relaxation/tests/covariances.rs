//! Marginal covariances against dense inversion and against samples; the certificate.

use approx::assert_relative_eq;
use nalgebra::{DMatrix, Matrix2, Point2, Vector2};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use relaxation::{Covariance, Network, Spring, bridges, certify, joint_covariance, optimum};

use crate::problems;

/// The inverse of the whole normal matrix, anchors left as zero rows and columns.
fn dense_covariance(network: &Network) -> DMatrix<f64> {
    let n = network.len();
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    for s in network.springs() {
        let w = s.information();
        for (i, j, sign) in [(s.from, s.from, 1.0), (s.to, s.to, 1.0), (s.from, s.to, -1.0), (s.to, s.from, -1.0)] {
            let mut block = a.fixed_view_mut::<2, 2>(2 * i, 2 * j);
            block += w * sign;
        }
    }
    for anchor in network.anchors() {
        for k in [2 * anchor.node, 2 * anchor.node + 1] {
            a.row_mut(k).fill(0.0);
            a.column_mut(k).fill(0.0);
            a[(k, k)] = 1.0;
        }
    }
    let mut inverse = a.try_inverse().unwrap();
    for anchor in network.anchors() {
        for k in [2 * anchor.node, 2 * anchor.node + 1] {
            inverse[(k, k)] = 0.0;
        }
    }
    inverse
}

#[test]
fn marginals_are_the_blocks_of_the_dense_inverse() {
    for problem in problems::all() {
        let network = &problem.network;
        let dense = dense_covariance(network);
        let block = |i: usize, j: usize| -> Matrix2<f64> { dense.fixed_view::<2, 2>(2 * i, 2 * j).into() };
        let covariance = Covariance::new(network);
        let close = |found: Matrix2<f64>, expected: Matrix2<f64>, what: String| {
            assert!(
                (found - expected).norm() <= 1e-10 * (1e-3 + expected.norm()),
                "{what}: {found} against {expected}"
            );
        };
        for node in 0..network.len() {
            close(covariance.node(node), block(node, node), format!("{}, node {node}", problem.name));
        }
        for (index, s) in network.springs().iter().enumerate() {
            let found = covariance.spring(index);
            close(found.cross, block(s.from, s.to), format!("{}, spring {index}", problem.name));
            close(found.from, block(s.from, s.from), format!("{}, start of spring {index}", problem.name));
        }
        let chosen: Vec<usize> = (0..network.len()).step_by(network.len() / 5 + 1).collect();
        let joint = joint_covariance(network, &chosen).unwrap();
        for (r, &i) in chosen.iter().enumerate() {
            for (c, &j) in chosen.iter().enumerate() {
                close(joint.block(r, c), block(i, j), format!("{}, nodes {i} and {j}", problem.name));
            }
        }
    }
}

#[test]
fn samples_scatter_as_the_covariance_says() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let springs = problems::random(&mut rng, 12, 18);
    let covariance = Covariance::new(&Network::new(12, &springs).unwrap());
    let mut normal = || -> f64 { (0..12).map(|_| rng.random_range(-0.5..0.5)).sum() };
    let truth = optimum(&Network::new(12, &springs).unwrap()).unwrap();
    let mut scatter = [0.0; 12];
    const SAMPLES: usize = 4000;
    for _ in 0..SAMPLES {
        let noisy = springs.iter().map(|s| {
            let sigma = s.covariance.m11.sqrt();
            let rest = truth[s.to] - truth[s.from] + Vector2::new(normal(), normal()) * sigma;
            Spring { rest, ..*s }
        });
        let found = optimum(&Network::from_vec(12, noisy.collect()).unwrap()).unwrap();
        for (sum, (p, q)) in scatter.iter_mut().zip(found.iter().zip(&truth)) {
            *sum += (p - q).norm_squared() / (2 * SAMPLES) as f64;
        }
    }
    for (node, sum) in scatter.iter().enumerate().skip(1) {
        // Of 8000 draws the variance is known to 1/√4000 = 1.6 %; allow four times that.
        assert_relative_eq!(*sum, covariance.node(node).m11, max_relative = 0.065);
    }
}

#[test]
fn the_true_variances_of_a_path_are_one_and_two() {
    let unit = |from, to| Spring::isotropic(from, to, Vector2::new(1.0, 0.0), 1.0);
    let covariance = Covariance::new(&Network::new(3, &[unit(0, 1), unit(1, 2)]).unwrap());
    assert_eq!([0, 1, 2].map(|i| covariance.node(i).m11), [0.0, 1.0, 2.0]);
}

#[test]
fn bridges_are_the_springs_whose_loss_parts_the_map() {
    for problem in problems::all() {
        let network = &problem.network;
        let springs = network.springs().len();
        let expected: Vec<usize> = (0..springs)
            .filter(|&lost| {
                let weights: Vec<f64> = (0..springs).map(|spring| if spring == lost { 0.0 } else { 1.0 }).collect();
                network.reweighted(&weights).unwrap().components() > network.components()
            })
            .collect();
        assert_eq!(bridges(network), expected, "{}", problem.name);
    }
}

#[test]
fn the_certificate_bounds_every_shift() {
    let mut rng = Pcg64Mcg::seed_from_u64(8);
    let network = Network::new(80, &problems::random(&mut rng, 80, 130)).unwrap();
    let best = optimum(&network).unwrap();
    let certificate = certify(&network, &best, 3);
    assert!(certificate.relative_gap < 1e-20 && certificate.max_shift < 1e-10, "{certificate:?}");
    assert_eq!(certificate.degrees_of_freedom, 2 * (130 - 79));
    let worst = certificate.strained[0];
    assert!((0..130).all(|spring| network.spring_energy(spring, &best).sqrt() <= worst.sigmas));

    let mut moved = best.clone();
    moved[40] += Vector2::new(0.01, 0.0);
    let certificate = certify(&network, &moved, 1);
    assert!(certificate.max_shift >= 0.01, "{certificate:?}");
    assert!(certificate.gap >= certificate.energy - network.energy(&best));
    assert_eq!(certify(&Network::new(0, &[]).unwrap(), &[] as &[Point2<f64>], 5).degrees_of_freedom, 0);
}

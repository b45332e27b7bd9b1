//! What is refused, and with which words; what looks bad and is legal.

use nalgebra::{Matrix2, Point2, Vector2};
use relaxation::{Anchor, Network, NetworkError, RelaxOptions, Spring, optimum, relax};

fn refused(nodes: usize, springs: &[Spring]) -> String {
    Network::new(nodes, springs).unwrap_err().to_string()
}

fn spring(x: f64, variance: f64) -> Spring {
    Spring::isotropic(0, 1, Vector2::new(x, 0.0), variance)
}

#[test]
fn errors_name_the_spring_and_the_value() {
    let good = spring(1.0, 1.0);
    assert_eq!(refused(1, &[good]), "spring 0: node 1 does not exist, the network has 1 nodes (numbered from 0)");
    assert_eq!(
        refused(2, &[good, spring(f64::NAN, 1.0)]),
        "spring 1: displacement must be finite and its energy too, got (NaN, 0) m"
    );
    assert_eq!(
        refused(2, &[good, good, spring(1.0, -0.5)]),
        "spring 2: covariance must be symmetric and positive definite, got [[-0.5, 0], [0, -0.5]] m²"
    );
}

#[test]
fn covariances_that_are_none_are_refused() {
    let with = |covariance| Spring { from: 0, to: 1, rest: Vector2::new(1.0, 0.0), covariance };
    for covariance in [
        Matrix2::zeros(),
        Matrix2::new(1.0, 0.0, 0.0, 0.0),
        Matrix2::new(1.0, 2.0, 2.0, 1.0),
        Matrix2::new(1.0, 0.5, -0.5, 1.0),
        Matrix2::new(1.0, 1.0, 1.0, 1.0),
        Matrix2::from_element(f64::NAN),
        Matrix2::from_diagonal_element(f64::INFINITY),
        Matrix2::from_diagonal_element(1e-320),
    ] {
        let error = Network::new(2, &[with(covariance)]).unwrap_err();
        assert!(
            matches!(error, NetworkError::CovarianceNotPositiveDefinite { spring: 0, .. }),
            "{covariance}: {error}"
        );
    }
}

#[test]
fn anchors_and_weights_are_checked() {
    let network = Network::new(3, &[spring(1.0, 1.0)]).unwrap();
    let anchor = |node, x| Anchor { node, position: Point2::new(x, 0.0) };
    let refused = |anchors: &[Anchor]| network.clone().with_anchors(anchors).unwrap_err().to_string();
    assert!(refused(&[anchor(3, 0.0)]).starts_with("anchor 3 does not exist"));
    assert!(refused(&[anchor(1, f64::INFINITY)]).starts_with("anchor 1: position must be finite, got (inf"));
    assert!(refused(&[anchor(0, 0.0), anchor(1, 0.0)]).starts_with("anchors 0 and 1 are in one component"));
    assert_eq!(network.reweighted(&[]).unwrap_err(), NetworkError::WeightCount { springs: 1, weights: 0 });
    let text = network.reweighted(&[-1.0]).unwrap_err().to_string();
    assert_eq!(text, "spring 0: weight must be finite and not negative, got -1");
}

#[test]
fn nothing_at_all_is_solved() {
    for nodes in [0, 1, 3] {
        let network = Network::new(nodes, &[]).unwrap();
        assert_eq!(network.components(), nodes);
        assert_eq!(optimum(&network).unwrap(), vec![Point2::origin(); nodes]);
        assert!(relax(&network, &network.dead_reckoning(), &RelaxOptions::default()).converged);
    }
}

#[test]
fn a_start_that_is_nowhere_is_replaced_by_dead_reckoning() {
    let network = Network::new(2, &[spring(2.0, 1.0)]).unwrap();
    let start = [Point2::origin(), Point2::new(f64::NAN, 0.0)];
    assert_eq!(relax(&network, &start, &RelaxOptions::default()).positions[1], Point2::new(2.0, 0.0));
}

#[test]
fn more_nodes_than_can_be_numbered_are_refused_before_any_memory_is_asked_for() {
    let error = Network::new(usize::MAX, &[]).unwrap_err();
    assert!(matches!(error, NetworkError::TooLarge { .. }), "{error}");
}

#[test]
fn a_loop_of_a_million_places_shares_its_error_evenly() {
    let nodes = 1_000_000;
    let step =
        |i: usize| Spring::isotropic(i, (i + 1) % nodes, Vector2::new(if i + 1 < nodes { 1.0 } else { 0.0 }, 0.5), 1.0);
    let springs: Vec<Spring> = (0..nodes).map(step).collect();
    let error = springs.iter().fold(Vector2::zeros(), |sum, s| sum + s.rest);
    let positions = optimum(&Network::from_vec(nodes, springs).unwrap()).unwrap();
    for (i, p) in positions.iter().enumerate().step_by(999) {
        let expected = Vector2::new(i as f64, 0.5 * i as f64) - error * (i as f64 / nodes as f64);
        assert!((p.coords - expected).norm() < 1e-6, "place {i} at {p} instead of {expected}");
    }
}

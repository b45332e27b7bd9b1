//! Robust positions: headings are known, so every reweighting is one exact linear solution.

use nalgebra::{Matrix2, Point2, Vector2};

use super::graduate::{check, reweight};
use super::{RobustError, RobustOptions, suspects};
use crate::network::Network;
use crate::unknowns::Unknowns;

/// Positions, and what was believed on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustPositions {
    /// One for each node.
    pub positions: Vec<Point2<f64>>,
    /// One for each spring: what its information was multiplied by. Trusted springs and bridges have 1.
    pub weights: Vec<f64>,
    /// Springs with a weight below one half.
    pub rejected: Vec<usize>,
    /// The weighted energy.
    pub energy: f64,
    /// How many times the network was solved.
    pub iterations: usize,
}

/// Positions when some springs may be false. `trusted` says of each spring that it is not (a travelled link);
/// bridges need no such word. Weights the network has already are multiplied by the robust ones.
///
/// # Errors
/// Not one flag for each spring, a scale that is not positive, stiffnesses too far apart.
///
/// ```
/// use relaxation::nalgebra::Vector2;
/// use relaxation::{Network, RobustMethod, RobustOptions, Spring, relax_robustly};
///
/// let link = |from, to, x, y| Spring::isotropic(from, to, Vector2::new(x, y), 0.01);
/// // A square walked around; the true closure 3 → 0, and a false one that takes node 2 for node 0.
/// let springs = [link(0, 1, 1.0, 0.0), link(1, 2, 0.0, 1.0), link(2, 3, -1.0, 0.0), link(3, 0, 0.02, -1.0), link(2, 0, 0.0, 0.0)];
/// let network = Network::new(4, &springs)?;
/// let options = RobustOptions { method: RobustMethod::TruncatedLeastSquares { bound: 9.21 }, ..RobustOptions::default() };
/// let robust = relax_robustly(&network, &[true, true, true, false, false], &options)?;
/// assert_eq!(robust.rejected, [4]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn relax_robustly(
    network: &Network,
    trusted: &[bool],
    options: &RobustOptions,
) -> Result<RobustPositions, RobustError> {
    check(options.method)?;
    let ends: Vec<(usize, usize)> = network.springs().iter().map(|s| (s.from, s.to)).collect();
    let suspects = suspects(network.len(), &ends, trusted)?;
    let mut weights = vec![1.0; ends.len()];
    let mut linear = Linear::new(network);
    let mut e2 = linear.solve(&weights)?;
    let mut iterations = 1;
    if !suspects.is_empty() {
        let kept = spanning(network.len(), &ends, &suspects);
        iterations += reweight(options, &suspects, &mut weights, e2, |weights| {
            // A spring that alone holds a part of the map must keep some stiffness, however small, or the part floats away.
            let floored: Vec<f64> =
                weights.iter().zip(&kept).map(|(w, kept)| if *kept { w.max(FLOOR) } else { *w }).collect();
            linear.solve(&floored)
        })?;
        e2 = linear.solve(
            &weights.iter().zip(&kept).map(|(w, kept)| if *kept { w.max(FLOOR) } else { *w }).collect::<Vec<_>>(),
        )?;
    }
    let energy = weights.iter().zip(&e2).map(|(w, e2)| w * e2).sum();
    let rejected = (0..weights.len()).filter(|k| weights[*k] < 0.5).collect();
    Ok(RobustPositions { positions: linear.positions, weights, rejected, energy, iterations })
}

/// Weight under which no spring of the spanning forest falls.
pub(super) const FLOOR: f64 = 1e-6;

/// Springs of a spanning forest that prefers what is not suspected.
pub(super) fn spanning(nodes: usize, ends: &[(usize, usize)], suspects: &[usize]) -> Vec<bool> {
    let joints: Vec<_> = ends.iter().map(|(from, to)| crate::headings::Joint::new(*from, *to)).collect();
    let mut suspected = vec![false; ends.len()];
    suspects.iter().for_each(|k| suspected[*k] = true);
    let forest = crate::headings::Forest::preferring(nodes, &joints, 2, |edge| usize::from(suspected[edge]), |_| false);
    let mut kept = vec![false; ends.len()];
    forest.steps().iter().for_each(|step| kept[step.edge] = true);
    kept
}

/// The normal equations, whose pattern is analysed once.
struct Linear<'a> {
    network: &'a Network,
    information: Vec<Matrix2<f64>>,
    unknowns: Unknowns,
    positions: Vec<Point2<f64>>,
}

impl<'a> Linear<'a> {
    fn new(network: &'a Network) -> Self {
        let springs = network.springs();
        let unknowns =
            Unknowns::new(network.len(), |node| network.is_anchor(node), springs.iter().map(|s| (s.from, s.to)));
        let information = springs.iter().enumerate().map(|(k, s)| s.information() * network.weight(k)).collect();
        let mut positions = vec![Point2::origin(); network.len()];
        for anchor in network.anchors() {
            positions[anchor.node] = anchor.position;
        }
        Self { network, information, unknowns, positions }
    }

    fn residual(&self, spring: usize) -> Vector2<f64> {
        let s = &self.network.springs()[spring];
        self.positions[s.to] - self.positions[s.from] - s.rest
    }

    /// Solves with these weights; every spring's squared residual without its robust weight.
    fn solve(&mut self, weights: &[f64]) -> Result<Vec<f64>, RobustError> {
        let mut matrix = self.unknowns.matrix(2);
        let mut right = vec![0.0; 2 * self.unknowns.count()];
        // Corrections of the positions as they are: only small numbers are rounded.
        for (k, spring) in self.network.springs().iter().enumerate().filter(|(_, s)| s.from != s.to) {
            let information = self.information[k] * weights[k];
            let pull = information * self.residual(k);
            let block = [[information.m11, information.m12], [information.m21, information.m22]];
            for (node, sign) in [(spring.from, 1.0), (spring.to, -1.0)] {
                if let Some(unknown) = self.unknowns.of(node) {
                    matrix.add(self.unknowns.diagonal(unknown), &block);
                    right[2 * unknown] += sign * pull.x;
                    right[2 * unknown + 1] += sign * pull.y;
                }
            }
            if let Some(slot) = self.unknowns.pair(k) {
                matrix.add(slot, &block.map(|row| row.map(|entry| -entry)));
            }
        }
        matrix.factorize().map_err(|error| RobustError::TooFarApart { node: error.node })?;
        matrix.solve(&mut right);
        for (node, position) in self.positions.iter_mut().enumerate() {
            if let Some(unknown) = self.unknowns.of(node) {
                *position += Vector2::new(right[2 * unknown], right[2 * unknown + 1]);
            }
        }
        let one = |k: usize| {
            let residual = self.residual(k);
            residual.dot(&(self.information[k] * residual))
        };
        Ok((0..weights.len()).map(one).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::{Kernel, RobustMethod};
    use crate::spring::Spring;
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    fn gauss(random: &mut Pcg64Mcg) -> f64 {
        let radius = (-2.0 * random.random::<f64>().max(1e-300).ln()).sqrt();
        radius * (std::f64::consts::TAU * random.random::<f64>()).cos()
    }

    /// A circle of 40 places, one true closure, three false ones between places more than 3 m apart.
    fn circle(seed: u128) -> (Vec<Spring>, Vec<bool>) {
        let mut random = Pcg64Mcg::new(seed);
        let radius = 40.0 / std::f64::consts::TAU;
        let place = |k: usize| {
            let (sin, cos) = (k as f64 / radius).sin_cos();
            Vector2::new(radius * cos, radius * sin)
        };
        let mut springs = Vec::new();
        for k in 0..39 {
            let noise = Vector2::new(gauss(&mut random), gauss(&mut random)) * 0.05;
            springs.push(Spring::isotropic(k, k + 1, place(k + 1) - place(k) + noise, 0.05 * 0.05));
        }
        let noise = Vector2::new(gauss(&mut random), gauss(&mut random)) * 0.1;
        springs.push(Spring::isotropic(39, 0, place(0) - place(39) + noise, 0.01));
        while springs.len() < 43 {
            let (a, b) = (random.random_range(0..40), random.random_range(0..40));
            if (place(a) - place(b)).norm() > 3.0 {
                springs.push(Spring::isotropic(a, b, Vector2::zeros(), 0.01));
            }
        }
        let trusted = (0..43).map(|k| k < 39).collect();
        (springs, trusted)
    }

    fn options(method: RobustMethod) -> RobustOptions {
        RobustOptions { method, ..RobustOptions::default() }
    }

    #[test]
    fn three_false_closures_of_a_circle_are_let_go_and_the_true_one_is_kept() {
        let mut right = 0;
        for seed in 0..40 {
            let (springs, trusted) = circle(seed);
            let network = Network::new(40, &springs).unwrap();
            let robust =
                relax_robustly(&network, &trusted, &options(RobustMethod::TruncatedLeastSquares { bound: 9.21 }))
                    .unwrap();
            assert!([40, 41, 42].iter().all(|k| robust.rejected.contains(k)), "seed {seed}: {:?}", robust.weights);
            if robust.rejected == [40, 41, 42] {
                right += 1;
                let clean = crate::optimum(&Network::new(40, &springs[..40]).unwrap()).unwrap();
                for (got, expected) in robust.positions.iter().zip(&clean) {
                    assert!((got - expected).norm() < 1e-9);
                }
            }
        }
        assert!(right >= 38, "{right} of 40");
    }

    #[test]
    fn without_false_springs_it_is_plain_least_squares() {
        let (springs, trusted) = circle(1);
        let network = Network::new(40, &springs[..40]).unwrap();
        let clean = crate::optimum(&network).unwrap();
        let robust =
            relax_robustly(&network, &trusted[..40], &options(RobustMethod::TruncatedLeastSquares { bound: 50.0 }))
                .unwrap();
        assert!(robust.rejected.is_empty());
        for (got, expected) in robust.positions.iter().zip(&clean) {
            assert!((got - expected).norm() < 1e-9);
        }
    }

    #[test]
    fn every_kernel_lowers_the_error_that_false_springs_make() {
        let (springs, trusted) = circle(3);
        let network = Network::new(40, &springs).unwrap();
        let clean = crate::optimum(&Network::new(40, &springs[..40]).unwrap()).unwrap();
        let off =
            |positions: &[Point2<f64>]| positions.iter().zip(&clean).map(|(a, b)| (a - b).norm_squared()).sum::<f64>();
        let plain = off(&crate::optimum(&network).unwrap());
        for method in [
            RobustMethod::Kernel(Kernel::Huber { delta: 1.345 }),
            RobustMethod::Kernel(Kernel::Cauchy { delta: 1.0 }),
            RobustMethod::Kernel(Kernel::Dcs { phi: 1.0 }),
            RobustMethod::GemanMcClure { bound: 9.21 },
        ] {
            let robust = relax_robustly(&network, &trusted, &options(method)).unwrap();
            assert!(off(&robust.positions) < 0.3 * plain, "{method:?}: {} of {plain}", off(&robust.positions));
            assert!(robust.weights[..39].iter().all(|w| *w == 1.0));
        }
    }

    #[test]
    fn a_false_spring_that_is_the_only_connection_is_kept() {
        let springs = [
            Spring::isotropic(0, 1, Vector2::new(1.0, 0.0), 0.01),
            Spring::isotropic(1, 2, Vector2::new(500.0, 0.0), 0.01),
        ];
        let network = Network::new(3, &springs).unwrap();
        let robust = relax_robustly(&network, &[false, false], &RobustOptions::default()).unwrap();
        assert_eq!(robust.weights, [1.0, 1.0]);
        assert!((robust.positions[2].x - 501.0).abs() < 1e-9);
    }

    #[test]
    fn wrong_input_is_an_error() {
        let (springs, trusted) = circle(1);
        let network = Network::new(40, &springs).unwrap();
        let error = relax_robustly(&network, &trusted[1..], &RobustOptions::default()).unwrap_err();
        assert_eq!(error.to_string(), "42 flags of trust for 43 springs");
        let method = RobustMethod::Kernel(Kernel::Cauchy { delta: f64::NAN });
        assert!(matches!(
            relax_robustly(&network, &trusted, &options(method)),
            Err(RobustError::ScaleNotPositive { .. })
        ));
    }
}

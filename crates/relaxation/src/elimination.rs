//! The exact answer for maps: leaves and chains out, the core by nested dissection, everything back.

mod compliance;
mod dense;
mod dissection;
mod entries;
mod factor;
mod front;
mod graph;
mod inverse;
mod minimum_degree;
mod once;
mod reduction;
mod separator;
mod stars;
mod substitution;
mod symbolic;

use nalgebra::{Matrix2, Point2};

use crate::network::Network;
use crate::solver::{RelaxOptions, Relaxed, Solver};
pub(crate) use compliance::Compliance;
pub(crate) use dissection::dissect;
use entries::Entries;
pub(crate) use factor::Factor;
pub(crate) use graph::{Graph, Springs};
use once::Once;
pub(crate) use reduction::{Level, steps};
use reduction::{Reduction, expanded};
use symbolic::Symbolic;

/// The direct solution made for topological maps.
///
/// 1. Places with one neighbour and the places along corridors (85 of 100 in office maps) are eliminated exactly in one pass
///    over the springs, as springs in series and in parallel; what that makes new leaves and corridors of, too.
/// 2. What remains, the core, is ordered by nested dissection along its own dead-reckoned coordinates.
/// 3. A multifrontal Cholesky factorisation solves for the way from dead reckoning to the optimum.
/// 4. Corridors and leaves come back by interpolation.
///
/// With isotropic springs x and y share one scalar matrix, and nothing is ever subtracted from something nearly equal: the
/// answer is right to rounding whatever the spread of the stiffnesses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Elimination;

impl Solver for Elimination {
    fn name(&self) -> &'static str {
        "elimination"
    }

    fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        let start = network.usable_start(start);
        let anchored: Vec<Point2<f64>> = network.anchors().iter().map(|anchor| start[anchor.node]).collect();
        Relaxed::judged(network, eliminate(network, &anchored), 0, RelaxOptions::default().tolerance)
    }
}

/// The optimum, the anchors held at the given positions.
pub(crate) fn eliminate(network: &Network, anchored: &[Point2<f64>]) -> Vec<Point2<f64>> {
    eliminate_within(network, anchored, f64::INFINITY).expect("no limit was set")
}

/// The optimum, unless the factorisation takes more multiplications than `limit`.
pub(crate) fn eliminate_within(network: &Network, anchored: &[Point2<f64>], limit: f64) -> Option<Vec<Point2<f64>>> {
    if network.is_isotropic() {
        solve::<f64, 1, 2>(network, anchored, limit)
    } else {
        solve::<Matrix2<f64>, 2, 1>(network, anchored, limit)
    }
}

/// `WIDTH` unknowns per node with `SIDES` right-hand sides each: 1 and 2 where x and y share the matrix, else 2 and 1.
fn solve<C: Compliance, const WIDTH: usize, const SIDES: usize>(
    network: &Network,
    anchored: &[Point2<f64>],
    limit: f64,
) -> Option<Vec<Point2<f64>>> {
    let Reduction { levels, core } = Reduction::<C>::new(&network.passing());
    let mut positions = core.reckoned(anchored);
    if WIDTH == 1 && core.nodes <= stars::LARGEST {
        stars::settle(&core, &mut positions);
        return Some(expanded(&levels, positions));
    }
    let order = dissect(&core, &positions);
    let symbolic = Symbolic::new(&core, &order);
    if symbolic.work::<WIDTH>() > limit {
        return None;
    }
    let forces = core.forces(&positions);
    let mut x = vec![[0.0; SIDES]; order.node.len() * WIDTH];
    for (chunk, &node) in x.chunks_exact_mut(WIDTH).zip(&order.node) {
        chunk.as_flattened_mut().copy_from_slice(&forces[node as usize]);
    }
    let entries = Entries::new::<WIDTH>(&core, &order);
    drop((forces, core));
    Once::<C, WIDTH>::planned(&entries, &symbolic).solve(&mut x);
    for (chunk, &node) in x.chunks_exact(WIDTH).zip(&order.node) {
        let step = chunk.as_flattened();
        positions[node as usize].x += step[0];
        positions[node as usize].y += step[1];
    }
    Some(expanded(&levels, positions))
}

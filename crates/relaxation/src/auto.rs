//! The solver for those who do not want to choose.

use nalgebra::Point2;

use crate::conjugate_gradient::ConjugateGradient;
use crate::elimination::eliminate_within;
use crate::network::Network;
use crate::solver::{RelaxOptions, Relaxed, Solver};

/// Chooses by the size and shape of the network.
///
/// [`Elimination`](crate::Elimination) answers exactly and is the quickest on everything that looks like a map: what it will cost
/// is known once the order of elimination is, before any number has been computed. Graphs of which every part is joined to
/// every other at random (no map is like that, broken data are) have no small separators; when a factorisation would take
/// longer than multilevel conjugate gradients, those take over. The two rates compared were measured, see
/// `docs/results/relaxation.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Auto;

/// Multiplications of a factorisation that take as long as conjugate gradients take per spring: about 6 µs.
const MULTIPLICATIONS_PER_SPRING: f64 = 6e4;

/// Multiplications that are quicker done than thought about.
const FREE: f64 = 1e9;

impl Solver for Auto {
    fn name(&self) -> &'static str {
        "auto"
    }

    #[expect(clippy::cast_precision_loss, reason = "an estimate")]
    fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        let start = network.usable_start(start);
        let anchored: Vec<Point2<f64>> = network.anchors().iter().map(|anchor| start[anchor.node]).collect();
        let limit = FREE.max(network.springs().len() as f64 * MULTIPLICATIONS_PER_SPRING);
        match eliminate_within(network, &anchored, limit) {
            Some(positions) => Relaxed::judged(network, positions, 0, RelaxOptions::default().tolerance),
            None => {
                tracing::debug!(limit, "no small separators: conjugate gradients take over");
                ConjugateGradient::default().solve(network, &start)
            }
        }
    }
}

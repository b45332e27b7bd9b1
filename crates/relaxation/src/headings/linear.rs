//! Angles, after whole turns have been rounded away: one scalar Laplacian.

use std::f64::consts::TAU;

use super::{Compass, Forest, HeadingError, Headings, Turn};
use crate::pose::wrap;
use crate::unknowns::Unknowns;

/// Solves for the angles themselves; `held` nodes keep their heading. Whole turns are counted against dead reckoning along `forest`.
pub(crate) fn linear(
    unknowns: &Unknowns,
    turns: &[Turn],
    compass: &[Compass],
    held: &[Option<f64>],
    forest: &Forest,
) -> Result<Headings, HeadingError> {
    let reckoned = reckon(turns, compass, held, forest);
    let mut matrix = unknowns.matrix(1);
    let mut right = vec![0.0; unknowns.count()];
    // Unknowns are corrections of the reckoned headings: every whole turn is then in the small residuals.
    for (edge, turn) in turns.iter().enumerate().filter(|(_, turn)| turn.from != turn.to) {
        let weight = 1.0 / turn.variance;
        let residual = wrap(turn.angle - (reckoned[turn.to] - reckoned[turn.from]));
        let (i, j) = (unknowns.of(turn.from), unknowns.of(turn.to));
        if let Some(i) = i {
            matrix.add(unknowns.diagonal(i), &[[weight]]);
            right[i] -= weight * residual;
        }
        if let Some(j) = j {
            matrix.add(unknowns.diagonal(j), &[[weight]]);
            right[j] += weight * residual;
        }
        if let Some(slot) = unknowns.pair(edge) {
            matrix.add(slot, &[[-weight]]);
        }
    }
    for reading in compass {
        if let Some(unknown) = unknowns.of(reading.node) {
            let weight = 1.0 / reading.variance;
            matrix.add(unknowns.diagonal(unknown), &[[weight]]);
            right[unknown] += weight * wrap(reading.heading - reckoned[reading.node]);
        }
    }
    matrix.factorize().map_err(|error| HeadingError::TooFarApart { node: error.node })?;
    matrix.solve(&mut right);
    let headings = reckoned
        .iter()
        .enumerate()
        .map(|(node, reckoned)| wrap(reckoned + unknowns.of(node).map_or(0.0, |k| right[k])))
        .collect();
    Ok(Headings { headings, agreement: vec![1.0; held.len()] })
}

/// Headings along the forest; a tree without a held node is turned as a whole to its compass readings.
fn reckon(turns: &[Turn], compass: &[Compass], held: &[Option<f64>], forest: &Forest) -> Vec<f64> {
    let mut headings: Vec<f64> = held.iter().map(|held| held.unwrap_or(0.0)).collect();
    let walk = |headings: &mut [f64]| {
        for step in forest.steps() {
            let angle = turns[step.edge].angle;
            let heading = headings[step.parent] + if step.forward { angle } else { -angle };
            if held[step.child].is_none() {
                headings[step.child] = heading;
            }
        }
    };
    walk(&mut headings);
    let mut mean = vec![(0.0, 0.0); held.len()];
    for reading in compass {
        let root = forest.root_of(reading.node);
        let (sin, cos) = (reading.heading - headings[reading.node]).sin_cos();
        mean[root].0 += cos / reading.variance;
        mean[root].1 += sin / reading.variance;
    }
    for root in forest.roots().filter(|root| held[*root].is_none()) {
        headings[root] = mean[root].1.atan2(mean[root].0);
    }
    walk(&mut headings);
    // Many turns gather along a path; what they sum to in whole turns is of no interest and would cost digits.
    headings.iter_mut().for_each(|heading| *heading %= TAU);
    headings
}

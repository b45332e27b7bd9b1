//! Direction vectors instead of angles: least squares without rounding.

use super::{Compass, HeadingError, Headings, Turn};
use crate::unknowns::Unknowns;

/// Solves for `z_i = (c_i, s_i)`; `held` nodes keep their heading.
pub(crate) fn chordal(
    unknowns: &Unknowns,
    turns: &[Turn],
    compass: &[Compass],
    held: &[Option<f64>],
) -> Result<Headings, HeadingError> {
    let mut matrix = unknowns.matrix(2);
    let mut right = vec![0.0; 2 * unknowns.count()];
    for (edge, turn) in turns.iter().enumerate().filter(|(_, turn)| turn.from != turn.to) {
        let weight = 1.0 / turn.variance;
        let (sin, cos) = turn.angle.sin_cos();
        let (i, j) = (unknowns.of(turn.from), unknowns.of(turn.to));
        for unknown in [i, j].into_iter().flatten() {
            matrix.add(unknowns.diagonal(unknown), &[[weight, 0.0], [0.0, weight]]);
        }
        if let Some(slot) = unknowns.pair(edge) {
            // z_j = R z_i: the block of row i, column j is −w Rᵀ.
            let (c, s) = (weight * cos, weight * sin);
            matrix.add(slot, &[[-c, -s], [s, -c]]);
        }
        if let (None, Some(j)) = (i, j) {
            pull(&mut right, j, weight, held[turn.from].unwrap_or(0.0) + turn.angle);
        }
        if let (Some(i), None) = (i, j) {
            pull(&mut right, i, weight, held[turn.to].unwrap_or(0.0) - turn.angle);
        }
    }
    for reading in compass {
        if let Some(unknown) = unknowns.of(reading.node) {
            let weight = 1.0 / reading.variance;
            matrix.add(unknowns.diagonal(unknown), &[[weight, 0.0], [0.0, weight]]);
            pull(&mut right, unknown, weight, reading.heading);
        }
    }
    matrix.factorize().map_err(|error| HeadingError::TooFarApart { node: error.node })?;
    matrix.solve(&mut right);
    let mut result = Headings { headings: Vec::with_capacity(held.len()), agreement: Vec::with_capacity(held.len()) };
    for (node, held) in held.iter().enumerate() {
        let (heading, length) = match unknowns.of(node) {
            Some(k) => (right[2 * k + 1].atan2(right[2 * k]), right[2 * k].hypot(right[2 * k + 1])),
            None => (held.unwrap_or(0.0), 1.0),
        };
        result.headings.push(heading);
        result.agreement.push(length);
    }
    Ok(result)
}

fn pull(right: &mut [f64], unknown: usize, weight: f64, heading: f64) {
    let (sin, cos) = heading.sin_cos();
    right[2 * unknown] += weight * cos;
    right[2 * unknown + 1] += weight * sin;
}

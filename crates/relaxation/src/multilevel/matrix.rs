//! The normal matrix in compressed rows, of numbers or of 2×2 blocks, for the iterations that need more than one level.

use nalgebra::{Matrix2, Vector2};

use crate::gauss_seidel::inverse;
use crate::network::Network;

/// An entry of the matrix: a number where x and y are alike, a block where not.
pub(crate) trait Entry: Copy + std::fmt::Debug {
    const ZERO: Self;
    const ONE: Self;
    fn of(network: &Network, spring: usize) -> Self;
    fn plus(self, other: Self) -> Self;
    fn negated(self) -> Self;
    fn product(self, other: Self) -> Self;
    fn transposed(self) -> Self;
    fn inverted(self) -> Self;
    fn is_positive(self) -> bool;
    /// The entry times a vector.
    fn multiply(self, v: Vector2<f64>) -> Vector2<f64>;
    fn is_zero(self) -> bool;
    fn trace(self) -> f64;
    /// A multiple of one.
    fn scalar(value: f64) -> Self;
}

impl Entry for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    fn of(network: &Network, spring: usize) -> Self {
        network.stiffness(spring)
    }
    #[inline]
    fn plus(self, other: Self) -> Self {
        self + other
    }
    fn negated(self) -> Self {
        -self
    }
    #[inline]
    fn product(self, other: Self) -> Self {
        self * other
    }
    fn transposed(self) -> Self {
        self
    }
    fn inverted(self) -> Self {
        self.recip()
    }
    fn is_positive(self) -> bool {
        self > 0.0
    }
    #[inline]
    fn multiply(self, v: Vector2<f64>) -> Vector2<f64> {
        v * self
    }
    fn is_zero(self) -> bool {
        self == 0.0
    }
    fn trace(self) -> f64 {
        self
    }
    fn scalar(value: f64) -> Self {
        value
    }
}

impl Entry for Matrix2<f64> {
    const ZERO: Self = Matrix2::new(0.0, 0.0, 0.0, 0.0);
    const ONE: Self = Matrix2::new(1.0, 0.0, 0.0, 1.0);
    fn of(network: &Network, spring: usize) -> Self {
        network.information(spring)
    }
    fn plus(self, other: Self) -> Self {
        self + other
    }
    fn negated(self) -> Self {
        -self
    }
    fn product(self, other: Self) -> Self {
        self * other
    }
    fn transposed(self) -> Self {
        self.transpose()
    }
    fn inverted(self) -> Self {
        inverse(&self)
    }
    fn is_positive(self) -> bool {
        self.m11 > 0.0 && self.m22 > 0.0 && self.determinant() > 1e-12 * self.m11 * self.m22
    }
    fn multiply(self, v: Vector2<f64>) -> Vector2<f64> {
        self * v
    }
    fn is_zero(self) -> bool {
        self == Self::ZERO
    }
    fn trace(self) -> f64 {
        self.m11 + self.m22
    }
    fn scalar(value: f64) -> Self {
        Self::new(value, 0.0, 0.0, value)
    }
}

/// A symmetric matrix: its diagonal, and what is beside it in compressed rows.
#[derive(Debug, Clone)]
pub(crate) struct Matrix<E> {
    pub(super) start: Vec<u32>,
    pub(super) columns: Vec<u32>,
    pub(super) values: Vec<E>,
    pub(super) diagonal: Vec<E>,
    pub(super) inverse_diagonal: Vec<E>,
}

impl<E: Entry> Matrix<E> {
    /// The normal matrix over the free nodes, which `unknown` numbers (`u32::MAX` for anchors).
    pub(crate) fn of(network: &Network, unknown: &[u32], free: &[u32]) -> Self {
        let mut builder = Builder::new(free.len());
        for &node in free {
            for end in network.adjacency().ends(node as usize) {
                let stiffness = E::of(network, end.spring as usize);
                builder.add_diagonal(stiffness);
                if unknown[end.node as usize] != u32::MAX {
                    builder.add(unknown[end.node as usize], stiffness.negated());
                }
            }
            builder.finish_row();
        }
        builder.finish()
    }

    pub(crate) fn len(&self) -> usize {
        self.diagonal.len()
    }

    /// The entries beside the diagonal of a row.
    #[inline]
    pub(super) fn row(&self, i: usize) -> impl Iterator<Item = (usize, E)> + '_ {
        let range = self.start[i] as usize..self.start[i + 1] as usize;
        self.columns[range.clone()].iter().zip(&self.values[range]).map(|(&j, &value)| (j as usize, value))
    }

    /// `A x`, one row.
    #[inline]
    fn row_times(&self, i: usize, x: &[Vector2<f64>]) -> Vector2<f64> {
        self.row(i).fold(self.diagonal[i].multiply(x[i]), |sum, (j, value)| sum + value.multiply(x[j]))
    }

    /// `A x`.
    pub(crate) fn times(&self, x: &[Vector2<f64>], into: &mut Vec<Vector2<f64>>) {
        into.clear();
        into.extend((0..self.len()).map(|i| self.row_times(i, x)));
    }

    /// `D⁻¹ b`, with `D` the diagonal.
    pub(crate) fn divided_by_diagonal(&self, b: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        self.inverse_diagonal.iter().zip(b).map(|(inverse, &b)| inverse.multiply(b)).collect()
    }

    /// `b − A x`.
    pub(super) fn residual(&self, b: &[Vector2<f64>], x: &[Vector2<f64>], into: &mut Vec<Vector2<f64>>) {
        into.clear();
        into.extend((0..self.len()).map(|i| b[i] - self.row_times(i, x)));
    }

    /// One Gauss-Seidel sweep over `rows` in that order.
    pub(super) fn sweep(&self, rows: impl Iterator<Item = usize>, b: &[Vector2<f64>], x: &mut [Vector2<f64>]) {
        for i in rows {
            let rest = self.row(i).fold(b[i], |sum, (j, value)| sum - value.multiply(x[j]));
            x[i] = self.inverse_diagonal[i].multiply(rest);
        }
    }

    /// The entries stored.
    pub(super) fn entries(&self) -> usize {
        self.values.len() + self.diagonal.len()
    }
}

/// Builds a matrix row by row, summing entries of one place.
pub(super) struct Builder<E> {
    matrix: Matrix<E>,
    /// For each column, where in the row at hand it is.
    seen: Vec<u32>,
    diagonal: E,
}

impl<E: Entry> Builder<E> {
    pub(super) fn new(size: usize) -> Self {
        let matrix = Matrix {
            start: vec![0],
            columns: Vec::new(),
            values: Vec::new(),
            diagonal: Vec::with_capacity(size),
            inverse_diagonal: Vec::with_capacity(size),
        };
        Self { matrix, seen: vec![u32::MAX; size], diagonal: E::ZERO }
    }

    pub(super) fn add_diagonal(&mut self, value: E) {
        self.diagonal = self.diagonal.plus(value);
    }

    #[expect(clippy::cast_possible_truncation, reason = "coarse matrices have no more entries than 32 bits can count")]
    pub(super) fn add(&mut self, column: u32, value: E) {
        let (first, at) = (self.matrix.start[self.matrix.start.len() - 1], self.seen[column as usize]);
        if at != u32::MAX && at >= first && self.matrix.columns.get(at as usize) == Some(&column) {
            let entry = &mut self.matrix.values[at as usize];
            *entry = entry.plus(value);
        } else {
            self.seen[column as usize] = self.matrix.columns.len() as u32;
            self.matrix.columns.push(column);
            self.matrix.values.push(value);
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "coarse matrices have no more entries than 32 bits can count")]
    pub(super) fn finish_row(&mut self) {
        let diagonal = std::mem::replace(&mut self.diagonal, E::ZERO);
        self.matrix.diagonal.push(diagonal);
        self.matrix.inverse_diagonal.push(diagonal.inverted());
        self.matrix.start.push(self.matrix.columns.len() as u32);
    }

    pub(super) fn finish(self) -> Matrix<E> {
        self.matrix
    }
}

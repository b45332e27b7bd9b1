//! The levels: which nodes stay on the next coarser one, how the others follow them, and the V-cycle over all.

use nalgebra::Vector2;

use super::matrix::{Builder, Entry, Matrix};

/// A level and the way to the next.
#[derive(Debug)]
struct Level<E> {
    matrix: Matrix<E>,
    /// Interpolation from the next level: row `i` gives node `i` as a mean of coarse nodes.
    interpolation: Interpolation<E>,
}

/// A sparse matrix with a row per fine node.
#[derive(Debug)]
struct Interpolation<E> {
    start: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<E>,
    coarse: usize,
}

/// All levels, finest first; the last has no interpolation and is solved by sweeps.
#[derive(Debug)]
pub(crate) struct Hierarchy<E> {
    levels: Vec<Level<E>>,
    coarsest: Matrix<E>,
}

/// Levels stop when so few unknowns are left: sweeps then solve them outright.
const COARSEST: usize = 8;

/// Sweeps over the coarsest level, to and fro: enough for eight unknowns.
const COARSEST_SWEEPS: usize = 60;

/// A node that has not been given a part.
const OPEN: u32 = u32::MAX;
/// A node that follows its coarse neighbours.
const FINE: u32 = u32::MAX - 1;

impl<E: Entry> Hierarchy<E> {
    /// Coarsens until little is left, or nothing is gained.
    pub(crate) fn new(finest: Matrix<E>) -> Self {
        let mut levels = Vec::new();
        let mut matrix = finest;
        while matrix.len() > COARSEST {
            let interpolation = Interpolation::new(&matrix);
            // A graph without springs between its free nodes, or one where coarsening only makes rows longer.
            if interpolation.coarse * 10 > matrix.len() * 9 {
                break;
            }
            let coarse = interpolation.galerkin(&matrix);
            if coarse.entries() * 10 > matrix.entries() * 9 {
                break;
            }
            levels.push(Level { matrix, interpolation });
            matrix = coarse;
        }
        Self { levels, coarsest: matrix }
    }

    /// The finest matrix.
    pub(crate) fn finest(&self) -> &Matrix<E> {
        self.levels.first().map_or(&self.coarsest, |level| &level.matrix)
    }

    /// Entries of all levels over those of the finest: how much more a cycle costs than the sweeps of its finest level.
    #[expect(clippy::cast_precision_loss, reason = "a figure for reports")]
    pub(crate) fn operator_complexity(&self) -> f64 {
        let all: usize = self.levels.iter().map(|level| level.matrix.entries()).sum();
        (all + self.coarsest.entries()) as f64 / self.finest().entries().max(1) as f64
    }

    /// One V-cycle with one sweep down and one, in reverse order, up: a symmetric approximation of `A⁻¹ b` if `x` is zero.
    pub(crate) fn cycle(&self, b: &[Vector2<f64>], x: &mut [Vector2<f64>]) {
        self.cycle_at(0, b, x);
    }

    fn cycle_at(&self, depth: usize, b: &[Vector2<f64>], x: &mut [Vector2<f64>]) {
        let Some(Level { matrix, interpolation }) = self.levels.get(depth) else {
            for _ in 0..COARSEST_SWEEPS {
                self.coarsest.sweep(0..b.len(), b, x);
                self.coarsest.sweep((0..b.len()).rev(), b, x);
            }
            return;
        };
        matrix.sweep(0..b.len(), b, x);
        let mut residual = Vec::new();
        matrix.residual(b, x, &mut residual);
        let coarse_b = interpolation.restrict(&residual);
        let mut coarse_x = vec![Vector2::zeros(); coarse_b.len()];
        self.cycle_at(depth + 1, &coarse_b, &mut coarse_x);
        interpolation.add_to(&coarse_x, x);
        matrix.sweep((0..b.len()).rev(), b, x);
    }
}

impl<E: Entry> Interpolation<E> {
    /// Walks the nodes in the order of their numbers: a node not yet spoken for stays, its neighbours follow.
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    fn new(matrix: &Matrix<E>) -> Self {
        let mut part = vec![OPEN; matrix.len()];
        let mut coarse = 0;
        for i in 0..matrix.len() {
            if part[i] == OPEN {
                part[i] = coarse;
                coarse += 1;
                for (j, _) in matrix.row(i) {
                    if part[j] == OPEN {
                        part[j] = FINE;
                    }
                }
            }
        }
        let mut this = Self { start: vec![0], columns: Vec::new(), values: Vec::new(), coarse: coarse as usize };
        for i in 0..matrix.len() {
            if part[i] == FINE {
                // Springs to other followers are lumped on the diagonal; the anchors, which do not move, are in it already.
                let followers = matrix.row(i).filter(|&(j, _)| part[j] == FINE);
                let lumped = followers.fold(matrix.diagonal[i], |sum, (_, value)| sum.plus(value));
                let inverse = if lumped.is_positive() { lumped.inverted() } else { matrix.inverse_diagonal[i] };
                for (j, value) in matrix.row(i).filter(|&(j, _)| part[j] != FINE) {
                    this.columns.push(part[j]);
                    this.values.push(inverse.product(value.negated()));
                }
            } else {
                this.columns.push(part[i]);
                this.values.push(E::ONE);
            }
            this.start.push(this.columns.len() as u32);
        }
        this
    }

    fn row(&self, i: usize) -> impl Iterator<Item = (usize, E)> + '_ {
        let range = self.start[i] as usize..self.start[i + 1] as usize;
        self.columns[range.clone()].iter().zip(&self.values[range]).map(|(&j, &value)| (j as usize, value))
    }

    /// `Pᵀ r`.
    fn restrict(&self, fine: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        let mut coarse = vec![Vector2::zeros(); self.coarse];
        for (i, &r) in fine.iter().enumerate() {
            for (j, value) in self.row(i) {
                coarse[j] += value.transposed().multiply(r);
            }
        }
        coarse
    }

    /// `x + P y`.
    fn add_to(&self, coarse: &[Vector2<f64>], x: &mut [Vector2<f64>]) {
        for (i, x) in x.iter_mut().enumerate() {
            for (j, value) in self.row(i) {
                *x += value.multiply(coarse[j]);
            }
        }
    }

    /// The coarse matrix `Pᵀ A P`.
    fn galerkin(&self, fine: &Matrix<E>) -> Matrix<E> {
        let transposed = self.transposed();
        let mut builder = Builder::new(self.coarse);
        for (row, sources) in transposed.iter().enumerate() {
            for &(i, weight) in sources {
                let beside = fine.row(i as usize);
                for (k, value) in std::iter::once((i as usize, fine.diagonal[i as usize])).chain(beside) {
                    let left = weight.transposed().product(value);
                    for (column, right) in self.row(k) {
                        let value = left.product(right);
                        if column == row {
                            builder.add_diagonal(value);
                        } else {
                            builder.add(self.columns_number(column), value);
                        }
                    }
                }
            }
            builder.finish_row();
        }
        builder.finish()
    }

    #[expect(clippy::cast_possible_truncation, reason = "coarse nodes are fewer than fine ones")]
    fn columns_number(&self, column: usize) -> u32 {
        debug_assert!(column < self.coarse);
        column as u32
    }

    /// For each coarse node, the fine ones that follow it and how much.
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    fn transposed(&self) -> Vec<Vec<(u32, E)>> {
        let mut rows = vec![Vec::new(); self.coarse];
        for i in 0..self.start.len() - 1 {
            for (j, value) in self.row(i) {
                rows[j].push((i as u32, value));
            }
        }
        rows
    }
}

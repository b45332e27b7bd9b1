//! The network as a sweep wants it: every node's update is one row of shares and one constant.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::network::{End, Network};

/// Rows of the update `p_i ← c_i + Σ_j S_ij p_j`, with `S_ij = (Σ_k W_ik)⁻¹ W_ij` and `c_i = Σ_j S_ij t_ji`.
///
/// The shares of a row sum to one. An anchor's row is `p ← 1 · p`, so that a sweep is one plain loop without a branch.
#[derive(Debug, Clone)]
pub(crate) enum SweepRows {
    /// All springs isotropic: the shares are numbers, the same for x and y.
    Scalar(Rows<f64>),
    /// The shares are 2×2 matrices.
    Block(Rows<Matrix2<f64>>),
}

/// Compressed rows, and beside them what most places of a map have for neighbours: the ones numbered next to them.
///
/// A sweep waits for nothing but the place it has just moved. Kept apart, that place's share is added last, from a register,
/// and everything else is summed meanwhile.
#[derive(Debug, Clone)]
pub(crate) struct Rows<S> {
    /// The shares of the nodes numbered one less; zero where they are no neighbours.
    before: Vec<S>,
    /// The shares of the nodes numbered one more.
    after: Vec<S>,
    start: Vec<u32>,
    columns: Vec<u32>,
    shares: Vec<S>,
    constants: Vec<Vector2<f64>>,
}

/// A share of a position: a number or a matrix.
pub(crate) trait Share: Copy + std::ops::AddAssign {
    /// None of it.
    const NOTHING: Self;

    /// `sum + self · p`.
    fn add_to(self, sum: Vector2<f64>, p: &Point2<f64>) -> Vector2<f64>;
}

impl Share for f64 {
    const NOTHING: Self = 0.0;

    #[inline(always)]
    fn add_to(self, sum: Vector2<f64>, p: &Point2<f64>) -> Vector2<f64> {
        Vector2::new(sum.x + self * p.x, sum.y + self * p.y)
    }
}

impl Share for Matrix2<f64> {
    const NOTHING: Self = Matrix2::new(0.0, 0.0, 0.0, 0.0);

    #[inline(always)]
    fn add_to(self, sum: Vector2<f64>, p: &Point2<f64>) -> Vector2<f64> {
        sum + self * p.coords
    }
}

impl SweepRows {
    pub(crate) fn new(network: &Network) -> Self {
        if network.is_isotropic() {
            Self::Scalar(Rows::collect(network, 1.0, |ends| {
                let total: f64 = ends.iter().map(|e| network.stiffness(e.spring as usize)).sum();
                move |spring| network.stiffness(spring) / total
            }))
        } else {
            Self::Block(Rows::collect(network, Matrix2::identity(), |ends| {
                let total: Matrix2<f64> = ends.iter().map(|e| network.information(e.spring as usize)).sum();
                let inverse = inverse(&total);
                move |spring| inverse * network.information(spring)
            }))
        }
    }

    /// All nodes in the order of their numbers.
    pub(crate) fn sweep_forward(&self, positions: &mut [Point2<f64>]) {
        match self {
            Self::Scalar(rows) => rows.sweep_forward(positions),
            Self::Block(rows) => rows.sweep_forward(positions),
        }
    }

    /// All nodes from the last to the first.
    pub(crate) fn sweep_backward(&self, positions: &mut [Point2<f64>]) {
        match self {
            Self::Scalar(rows) => rows.sweep_backward(positions),
            Self::Block(rows) => rows.sweep_backward(positions),
        }
    }

    /// All nodes in the order of their numbers, each going `factor` times as far as its neighbours ask.
    pub(crate) fn sweep_over(&self, factor: f64, positions: &mut [Point2<f64>]) {
        for i in 0..positions.len() {
            let target = match self {
                Self::Scalar(rows) => rows.target(i, positions),
                Self::Block(rows) => rows.target(i, positions),
            };
            let step = target - positions[i];
            positions[i] += step * factor;
        }
    }
}

/// The inverse of a symmetric positive definite matrix that may be far from 1 in size.
pub(crate) fn inverse(m: &Matrix2<f64>) -> Matrix2<f64> {
    let scale = m.m11.max(m.m22);
    let unit = m / scale;
    let determinant = unit.m11 * unit.m22 - unit.m12 * unit.m21;
    Matrix2::new(unit.m22, -unit.m12, -unit.m21, unit.m11) / (determinant * scale)
}

impl<S: Share> Rows<S> {
    /// Builds the rows; `shares_of(ends)` gives the function from a spring to its share at that node.
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    fn collect<F: Fn(usize) -> S>(network: &Network, one: S, shares_of: impl Fn(&[End]) -> F) -> Self {
        let adjacency = network.adjacency();
        let nodes = network.len();
        let mut rows = Self {
            before: vec![S::NOTHING; nodes],
            after: vec![S::NOTHING; nodes],
            start: vec![0],
            columns: Vec::new(),
            shares: Vec::new(),
            constants: Vec::with_capacity(nodes),
        };
        for node in 0..nodes {
            let mut constant = Vector2::zeros();
            if network.is_anchor(node) {
                rows.columns.push(node as u32);
                rows.shares.push(one);
            } else {
                let ends = adjacency.ends(node);
                let share = shares_of(ends);
                for end in ends {
                    let share = share(end.spring as usize);
                    constant = share.add_to(constant, &(-network.rest_from(node as u32, end.spring)).into());
                    if end.node as usize + 1 == node {
                        rows.before[node] += share;
                    } else if end.node as usize == node + 1 {
                        rows.after[node] += share;
                    } else {
                        rows.columns.push(end.node);
                        rows.shares.push(share);
                    }
                }
            }
            rows.constants.push(constant);
            rows.start.push(rows.columns.len() as u32);
        }
        rows
    }

    fn sweep_forward(&self, positions: &mut [Point2<f64>]) {
        let Some(&(mut last)) = positions.first() else { return };
        for i in 0..positions.len() {
            let next = positions[(i + 1).min(positions.len() - 1)];
            let others = self.after[i].add_to(self.far(i, positions), &next);
            last = self.before[i].add_to(others, &last).into();
            positions[i] = last;
        }
    }

    fn sweep_backward(&self, positions: &mut [Point2<f64>]) {
        let Some(&(mut last)) = positions.last() else { return };
        for i in (0..positions.len()).rev() {
            let next = positions[i.saturating_sub(1)];
            let others = self.before[i].add_to(self.far(i, positions), &next);
            last = self.after[i].add_to(others, &last).into();
            positions[i] = last;
        }
    }

    /// Where its neighbours think node `i` should be.
    #[inline]
    fn target(&self, i: usize, positions: &[Point2<f64>]) -> Point2<f64> {
        let (previous, next) = (positions[i.saturating_sub(1)], positions[(i + 1).min(positions.len() - 1)]);
        let others = self.after[i].add_to(self.far(i, positions), &next);
        self.before[i].add_to(others, &previous).into()
    }

    /// What neighbours that are not numbered next to node `i` say, and the constant.
    #[inline(always)] // Called, it costs more than it computes.
    fn far(&self, i: usize, positions: &[Point2<f64>]) -> Vector2<f64> {
        let row = self.start[i] as usize..self.start[i + 1] as usize;
        let mut sum = self.constants[i];
        for (&j, share) in self.columns[row.clone()].iter().zip(&self.shares[row]) {
            sum = share.add_to(sum, &positions[j as usize]);
        }
        sum
    }
}

//! Multifrontal Cholesky of the core: `A = L Lᵀ`, supernode by supernode, children before parents.
//!
//! Where x and y share one scalar matrix (`WIDTH` 1, two right-hand sides at once), the matrix is a grounded Laplacian: what
//! is on the diagonal is the sum of what is beside it and of the coupling to the ground. The factorisation keeps that sum
//! instead of the diagonal (as Grassmann, Taksar & Heyman 1985 did for Markov chains), so it only ever adds numbers of one
//! sign: each entry of `L` is right to its last digits however far apart the stiffnesses are, and no pivot can fail.
//! With 2×2 covariances (`WIDTH` 2) the diagonal is kept as usual.

use super::compliance::Compliance;
use super::dissection::Order;
use super::entries::Entries;
use super::front::{Fronts, Matrix};
use super::graph::Graph;
use super::substitution::Columns;
use super::symbolic::Symbolic;

/// A factorised core with `WIDTH` unknowns per node: 1 where x and y share the matrix, else 2.
#[derive(Debug, Clone)]
pub(crate) struct Factor<const WIDTH: usize> {
    pub(crate) order: Order,
    pub(crate) symbolic: Symbolic,
    /// Where the block of each supernode begins in `values`, and at the end their length.
    value_start: Vec<usize>,
    /// The blocks, column-major: the columns of each supernode from its first row down, the diagonal inverted.
    values: Vec<f64>,
}

impl<const WIDTH: usize> Factor<WIDTH> {
    /// Factors the matrix of `graph` in the given order.
    pub(crate) fn new<C: Compliance>(graph: &Graph<C>, order: Order) -> Self {
        let symbolic = Symbolic::new(graph, &order);
        let value_start = symbolic.value_start::<WIDTH>();
        let values = vec![0.0; value_start[symbolic.supernodes.len()]];
        let mut factor = Self { order, symbolic, value_start, values };
        let entries = Entries::new::<WIDTH>(graph, &factor.order);
        pulp::Arch::new().dispatch(Compute { factor: &mut factor, entries: &entries });
        factor
    }

    /// The number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        self.order.node.len() * WIDTH
    }

    #[inline(always)]
    fn compute<C: Compliance>(&mut self, entries: &Entries<C>) {
        let matrix = Matrix { entries, symbolic: &self.symbolic };
        let mut fronts = Fronts::<WIDTH>::new(&self.symbolic, self.order.node.len());
        for id in 0..self.symbolic.supernodes.len() {
            let block = &mut self.values[self.value_start[id]..self.value_start[id + 1]];
            fronts.eliminate(matrix, id, block);
        }
    }

    /// The columns of one supernode.
    pub(super) fn columns(&self, id: usize) -> Columns<'_> {
        Columns {
            supernode: self.symbolic.supernodes[id],
            rows: self.symbolic.rows(id),
            values: &self.values[self.value_start[id]..self.value_start[id + 1]],
        }
    }

    /// The part of `L y = b` that belongs to one supernode, `x` in the order of elimination.
    pub(crate) fn forward<const SIDES: usize>(&self, id: usize, x: &mut [[f64; SIDES]], below: &mut Vec<[f64; SIDES]>) {
        self.columns(id).forward::<WIDTH, SIDES>(x, below);
    }

    /// The part of `Lᵀ x = y` that belongs to one supernode.
    pub(crate) fn backward<const SIDES: usize>(
        &self,
        id: usize,
        x: &mut [[f64; SIDES]],
        below: &mut Vec<[f64; SIDES]>,
    ) {
        self.columns(id).backward::<WIDTH, SIDES>(x, below);
    }
}

/// The factorisation as a task that is compiled for each set of vector instructions, the best of which is found at run time:
/// everything below is inlined into it.
struct Compute<'a, C, const WIDTH: usize> {
    factor: &'a mut Factor<WIDTH>,
    entries: &'a Entries<C>,
}

impl<C: Compliance, const WIDTH: usize> pulp::WithSimd for Compute<'_, C, WIDTH> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.factor.compute(self.entries);
    }
}

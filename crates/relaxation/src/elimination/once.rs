//! Factoring for one solution: each front is solved forward as soon as it is eliminated, and what is quickly computed again
//! is not kept.
//!
//! Of a large factor, most lies in small subtrees, called *islands* here. The columns of an island are dropped when its
//! remainder has gone to the rest of the tree, and computed once more when the solution comes back down. That costs
//! multiplications and saves most of the memory; and since an island stays within the cache from its first number to its
//! last, it costs no time (`docs/results/relaxation.md`).

use std::ops::Range;

use super::compliance::Compliance;
use super::entries::Entries;
use super::front::{Fronts, Matrix};
use super::substitution::Columns;
use super::symbolic::Symbolic;

/// Factors with fewer entries than this are kept whole: 32 MB.
const KEPT: usize = 1 << 22;

/// The most entries of an island: 1 MB, which second-level caches hold.
const ISLAND: usize = 1 << 17;

/// A planned factorisation, `WIDTH` unknowns per node.
#[derive(Debug)]
pub(crate) struct Once<'a, C, const WIDTH: usize> {
    matrix: Matrix<'a, C>,
    value_start: Vec<usize>,
    /// The supernodes in their order: islands as a whole, the others one by one.
    stretches: Vec<Stretch>,
}

/// Supernodes that are eliminated in one go.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    first: u32,
    end: u32,
    /// Whether the columns are kept for the way down.
    kept: bool,
}

impl Stretch {
    fn ids(self) -> Range<usize> {
        self.first as usize..self.end as usize
    }
}

impl<'a, C: Compliance, const WIDTH: usize> Once<'a, C, WIDTH> {
    /// Decides what is kept.
    pub(super) fn planned(entries: &'a Entries<C>, symbolic: &'a Symbolic) -> Self {
        let total = symbolic.value_start::<WIDTH>()[symbolic.supernodes.len()];
        Self::with_islands(entries, symbolic, if total < KEPT { 0 } else { ISLAND })
    }

    /// With islands of at most so many entries.
    fn with_islands(entries: &'a Entries<C>, symbolic: &'a Symbolic, most: usize) -> Self {
        let value_start = symbolic.value_start::<WIDTH>();
        let stretches = stretches(symbolic, &value_start, most);
        Self { matrix: Matrix { entries, symbolic }, value_start, stretches }
    }

    /// Solves `A x = b` in place, `x` in the order of elimination.
    pub(crate) fn solve<const SIDES: usize>(&self, x: &mut [[f64; SIDES]]) {
        pulp::Arch::new().dispatch(Solve { once: self, x });
    }

    #[inline(always)]
    fn run<const SIDES: usize>(&self, x: &mut [[f64; SIDES]]) {
        let lengths = self.stretches.iter().map(|s| (s.kept, self.values(s.ids()).len()));
        let mut kept = vec![0.0; lengths.clone().filter(|l| l.0).map(|l| l.1).sum()];
        let mut island = vec![0.0; lengths.filter(|l| !l.0).map(|l| l.1).max().unwrap_or(0)];
        let mut fronts = Fronts::<WIDTH>::new(self.matrix.symbolic, x.len() / WIDTH);
        let mut below = Vec::new();
        let mut at = 0;
        for &stretch in &self.stretches {
            let length = self.values(stretch.ids()).len();
            let values = if stretch.kept { &mut kept[at..at + length] } else { &mut island[..length] };
            if stretch.kept {
                at += length;
            } else {
                values.fill(0.0);
            }
            for id in stretch.ids() {
                let block = &mut values[self.within(stretch, id)];
                fronts.eliminate(self.matrix, id, block);
                self.columns(id, block).forward::<WIDTH, SIDES>(x, &mut below);
            }
        }
        for &stretch in self.stretches.iter().rev() {
            let length = self.values(stretch.ids()).len();
            let values = if stretch.kept {
                at -= length;
                &kept[at..at + length]
            } else {
                self.eliminate_again(stretch, &mut fronts, &mut island[..length]);
                &island[..length]
            };
            for id in stretch.ids().rev() {
                self.columns(id, &values[self.within(stretch, id)]).backward::<WIDTH, SIDES>(x, &mut below);
            }
        }
    }

    #[inline(never)]
    fn eliminate_again(&self, island: Stretch, fronts: &mut Fronts<WIDTH>, values: &mut [f64]) {
        let supernodes = &self.matrix.symbolic.supernodes[island.ids()];
        fronts.reset(supernodes[0].first, supernodes[supernodes.len() - 1].end);
        values.fill(0.0);
        for id in island.ids() {
            fronts.eliminate(self.matrix, id, &mut values[self.within(island, id)]);
        }
    }

    /// Where the columns of some supernodes would be if all were kept.
    fn values(&self, ids: Range<usize>) -> Range<usize> {
        self.value_start[ids.start]..self.value_start[ids.end]
    }

    /// Where the columns of a supernode are among those of its stretch.
    #[inline(always)]
    fn within(&self, stretch: Stretch, id: usize) -> Range<usize> {
        let base = self.value_start[stretch.first as usize];
        self.value_start[id] - base..self.value_start[id + 1] - base
    }

    #[inline(always)]
    fn columns<'v>(&'v self, id: usize, values: &'v [f64]) -> Columns<'v> {
        Columns { supernode: self.matrix.symbolic.supernodes[id], rows: self.matrix.symbolic.rows(id), values }
    }
}

/// Parts the supernodes into islands, the largest subtrees of at most `most` entries, and the rest.
#[expect(clippy::cast_possible_truncation, reason = "supernodes are counted in 32 bits")]
fn stretches(symbolic: &Symbolic, value_start: &[usize], most: usize) -> Vec<Stretch> {
    let supernodes = &symbolic.supernodes;
    if most == 0 {
        return vec![Stretch { first: 0, end: supernodes.len() as u32, kept: true }];
    }
    // The first supernode of each subtree: children come before their parents, the first one's subtree first.
    let mut first: Vec<u32> = (0..supernodes.len() as u32).collect();
    for (id, supernode) in supernodes.iter().enumerate() {
        let own = first[id];
        if let Some(of_parent) = first.get_mut(supernode.parent as usize) {
            *of_parent = own.min(*of_parent);
        }
    }
    let small = |id: usize| value_start[id + 1] - value_start[first[id] as usize] <= most;
    let mut stretches: Vec<Stretch> = Vec::new();
    for (id, supernode) in (0_u32..).zip(supernodes) {
        if !small(id as usize) {
            stretches.push(Stretch { first: id, end: id + 1, kept: true });
        } else if supernode.parent == u32::MAX || !small(supernode.parent as usize) {
            stretches.push(Stretch { first: first[id as usize], end: id + 1, kept: false });
        }
    }
    stretches
}

/// The solution as a task that is compiled for each set of vector instructions.
struct Solve<'a, 'm, C, const WIDTH: usize, const SIDES: usize> {
    once: &'a Once<'m, C, WIDTH>,
    x: &'a mut [[f64; SIDES]],
}

impl<C: Compliance, const WIDTH: usize, const SIDES: usize> pulp::WithSimd for Solve<'_, '_, C, WIDTH, SIDES> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.once.run(self.x);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Point2, Vector2};
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::super::graph::{Graph, Springs};
    use super::super::{dissect, stars};
    use super::*;
    use crate::{Network, Spring};

    /// A square lattice of `side` × `side` places, one spring in ten missing.
    fn lattice(side: usize, seed: u64) -> Network {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut springs = Vec::new();
        for at in 0..side * side {
            let right = (at % side + 1 < side).then_some((at + 1, Vector2::x()));
            let up = (at / side + 1 < side).then_some((at + side, Vector2::y()));
            for (to, rest) in [right, up].into_iter().flatten() {
                if rng.random_range(0..10) > 0 {
                    let error = Vector2::new(rng.random_range(-0.2..0.2), rng.random_range(-0.2..0.2));
                    springs.push(Spring::isotropic(at, to, rest + error, rng.random_range(0.01..0.1)));
                }
            }
        }
        Network::from_vec(side * side, springs).unwrap()
    }

    /// The core of a network with everything left in, as one graph.
    fn core<C: Compliance>(network: &Network) -> Graph<C> {
        let edges = (0..u32::try_from(network.springs().len()).unwrap()).map(|spring| network.edge(spring)).collect();
        Graph::merged(network.len(), edges, Springs::<C>::anchors(network))
    }

    fn solved<C: Compliance, const WIDTH: usize, const SIDES: usize>(graph: &Graph<C>, island: usize) -> Vec<f64> {
        let anchored = vec![Point2::origin(); graph.anchors.len()];
        let positions = graph.reckoned(&anchored);
        let order = dissect(graph, &positions);
        let symbolic = Symbolic::new(graph, &order);
        let forces = graph.forces(&positions);
        let mut x = vec![[0.0; SIDES]; order.node.len() * WIDTH];
        for (chunk, &node) in x.chunks_exact_mut(WIDTH).zip(&order.node) {
            chunk.as_flattened_mut().copy_from_slice(&forces[node as usize]);
        }
        let entries = Entries::new::<WIDTH>(graph, &order);
        let once = Once::<C, WIDTH>::with_islands(&entries, &symbolic, island);
        assert_eq!(once.stretches.iter().any(|s| !s.kept), island > 0);
        once.solve(&mut x);
        x.into_flattened()
    }

    #[test]
    fn what_is_computed_twice_comes_out_as_what_is_kept() {
        let network = lattice(40, 1);
        let (scalar, matrix) = (core::<f64>(&network), core::<Matrix2<f64>>(&network));
        for island in [20, 300, 3000] {
            assert_eq!(solved::<_, 1, 2>(&scalar, island), solved::<_, 1, 2>(&scalar, 0), "islands of {island}");
            assert_eq!(solved::<_, 2, 1>(&matrix, island), solved::<_, 2, 1>(&matrix, 0), "islands of {island}");
        }
    }

    #[test]
    fn stars_and_fronts_agree() {
        for seed in 0..10 {
            let graph = core::<f64>(&lattice(11, seed));
            let reckoned = graph.reckoned(&vec![Point2::origin(); graph.anchors.len()]);
            let mut settled = reckoned.clone();
            stars::settle(&graph, &mut settled);
            let steps = solved::<_, 1, 2>(&graph, 0);
            let order = dissect(&graph, &reckoned);
            for (&node, step) in order.node.iter().zip(steps.as_chunks::<2>().0) {
                let expected = reckoned[node as usize] + Vector2::from(*step);
                assert!((settled[node as usize] - expected).norm() < 1e-12, "node {node} of lattice {seed}");
            }
        }
    }
}

//! The map as it was factored last, plus the trees that have grown on it since: what a node's position depends on.

use std::collections::BinaryHeap;

use nalgebra::{Point2, Vector2};

use crate::elimination::{Compliance, Factor, dissect, steps};
use crate::multilevel::Entry;
use crate::network::Network;

/// What a node's position follows from.
#[derive(Debug, Clone, Copy)]
enum Place<C> {
    /// It is held where it is.
    Anchor,
    /// It is an unknown of the factored core.
    Core { position: u32 },
    /// It shares the misfit of a chain, `compliance` behind its start.
    Link { chain: u32, compliance: C },
    /// It follows another node.
    Leaf { parent: u32, compliance: C },
}

/// A chain between two nodes.
#[derive(Debug, Clone, Copy)]
struct Chain<C> {
    a: u32,
    b: u32,
    compliance: C,
}

/// How the displacement between two nodes (or the position of one) depends on what is independent in the map.
///
/// Its variance under the map, and its covariance with another's, are plain sums over these entries.
#[derive(Debug, Clone, Default)]
pub(super) struct Functional<C, const WIDTH: usize> {
    /// Springs of trees: the node that hangs, and the share.
    forest: Vec<(u32, C)>,
    /// Places in chains: the chain, the compliance before the place, and the share.
    bridges: Vec<(u32, C, C)>,
    /// `L⁻¹` of the shares of the core's unknowns.
    core: Vec<(u32, [f64; WIDTH])>,
}

/// Forces on what is independent in the map: a combination of functionals.
#[derive(Debug)]
struct Forces<const WIDTH: usize> {
    forest: Vec<Vector2<f64>>,
    /// For each chain, its first entry in `bridges`.
    chain: Vec<u32>,
    core: Vec<f64>,
}

/// The base of [`Incremental`](super::Incremental).
#[derive(Debug)]
pub(super) struct Base<C, const WIDTH: usize> {
    place: Vec<Place<C>>,
    chains: Vec<Chain<C>>,
    /// All nodes, each after those it depends on.
    order: Vec<u32>,
    rank: Vec<u32>,
    factor: Factor<WIDTH>,
    supernode: Vec<u32>,
    /// The optimum of the base.
    pub(super) positions: Vec<Point2<f64>>,
    scratch: Scratch<C, WIDTH>,
}

/// Dense working memory, all zero between calls.
#[derive(Debug)]
struct Scratch<C, const WIDTH: usize> {
    share: Vec<C>,
    queued: Vec<bool>,
    unknowns: Vec<[f64; WIDTH]>,
    marked: Vec<bool>,
    below: Vec<[f64; WIDTH]>,
    queue: BinaryHeap<(u32, u32)>,
}

const NONE: u32 = u32::MAX;

impl<C: Compliance + Entry, const WIDTH: usize> Base<C, WIDTH> {
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    pub(super) fn new(network: &Network) -> Self {
        let steps = steps::<C>(network);
        // The number in the network of each node of the graph at hand.
        let mut numbers: Vec<Vec<u32>> = vec![(0..network.len() as u32).collect()];
        for (level, _) in &steps {
            let outer = &numbers[numbers.len() - 1];
            numbers.push(level.kept.iter().map(|&node| outer[node as usize]).collect());
        }
        let (core, inner) = (&steps[steps.len() - 1].1, &numbers[numbers.len() - 1]);
        let anchored: Vec<_> = network.anchors().iter().map(|anchor| anchor.position).collect();
        let order = dissect(core, &core.reckoned(&anchored));
        let factor = Factor::<WIDTH>::new(core, order);
        let mut supernode = vec![0; factor.order.node.len()];
        for (id, s) in (0_u32..).zip(&factor.symbolic.supernodes) {
            supernode[s.first as usize..s.end as usize].fill(id);
        }

        let mut place = vec![Place::Anchor; network.len()];
        let mut order = inner.clone();
        for (&node, &position) in inner.iter().zip(&factor.order.position) {
            if position != NONE {
                place[node as usize] = Place::Core { position };
            }
        }
        let mut chains = Vec::new();
        for ((level, _), number) in steps.iter().zip(&numbers).rev() {
            for chain in &level.chains {
                let (a, b) = (number[chain.a as usize], number[chain.b as usize]);
                for link in &level.links[chain.first as usize..chain.end as usize] {
                    let node = number[link.node as usize];
                    place[node as usize] = Place::Link { chain: chains.len() as u32, compliance: link.compliance };
                    order.push(node);
                }
                chains.push(Chain { a, b, compliance: chain.compliance });
            }
            for leaf in level.leaves.iter().rev() {
                let (node, parent) = (number[leaf.node as usize], number[leaf.parent as usize]);
                place[node as usize] = Place::Leaf { parent, compliance: leaf.compliance };
                order.push(node);
            }
        }
        let mut rank = vec![0; network.len()];
        for (at, &node) in (0_u32..).zip(&order) {
            rank[node as usize] = at;
        }
        let scratch = Scratch {
            share: vec![C::ZERO; network.len()],
            queued: vec![false; network.len()],
            unknowns: vec![[0.0; WIDTH]; factor.unknowns()],
            marked: vec![false; factor.symbolic.supernodes.len()],
            below: Vec::new(),
            queue: BinaryHeap::new(),
        };
        let positions = crate::elimination::eliminate(network, &anchored);
        Self { place, chains, order, rank, factor, supernode, positions, scratch }
    }

    pub(super) fn len(&self) -> usize {
        self.place.len()
    }

    /// Adds a node that is held where it is.
    pub(super) fn add_anchor(&mut self, position: Point2<f64>) {
        self.add(Place::Anchor, position);
    }

    /// Hangs the anchor `node`, on which nothing depends yet, on `parent`.
    pub(super) fn hang(&mut self, node: usize, parent: usize, rest: Vector2<f64>, compliance: C) {
        #[expect(clippy::cast_possible_truncation, reason = "nodes are counted in 32 bits")]
        let parent_number = parent as u32;
        self.place[node] = Place::Leaf { parent: parent_number, compliance };
        self.positions[node] = self.positions[parent] + rest;
        // What depends on nothing but an older node may come last.
        #[expect(clippy::cast_possible_truncation, reason = "nodes are counted in 32 bits")]
        let last = self.order.len() as u32;
        if self.rank[node] < self.rank[parent] {
            self.rank[node] = last;
            self.order.push(u32::try_from(node).expect("nodes are counted in 32 bits"));
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "nodes are counted in 32 bits")]
    fn add(&mut self, place: Place<C>, position: Point2<f64>) {
        let node = self.place.len() as u32;
        self.rank.push(self.order.len() as u32);
        self.order.push(node);
        self.place.push(place);
        self.positions.push(position);
        self.scratch.share.push(C::ZERO);
        self.scratch.queued.push(false);
    }

    /// The functional `Σ sign · p_node` of one or two nodes.
    ///
    /// Nodes are replaced by what they depend on, the most dependent first, so that shares meet and cancel: of two places in
    /// one tree only the way between them is touched.
    pub(super) fn functional(&mut self, terms: &[(usize, f64)]) -> Functional<C, WIDTH> {
        let mut found = Functional { forest: Vec::new(), bridges: Vec::new(), core: Vec::new() };
        let mut touched = Vec::new();
        for &(node, sign) in terms {
            let share = C::from_entries(|row, column| if row == column { sign } else { 0.0 });
            self.share(u32::try_from(node).expect("nodes are counted in 32 bits"), share);
        }
        while let Some((_, node)) = self.scratch.queue.pop() {
            self.scratch.queued[node as usize] = false;
            let share = std::mem::replace(&mut self.scratch.share[node as usize], C::ZERO);
            if share.is_zero() {
                continue;
            }
            match self.place[node as usize] {
                Place::Anchor => {}
                Place::Leaf { parent, .. } => {
                    found.forest.push((node, share));
                    self.share(parent, share);
                }
                Place::Link { chain, compliance } => {
                    found.bridges.push((chain, compliance, share));
                    let Chain { a, b, compliance: all } = self.chains[chain as usize];
                    let at_b = share.product(compliance.product(all.inverted()));
                    self.share(a, share.plus(at_b.negated()));
                    self.share(b, at_b);
                }
                Place::Core { position } => {
                    for row in 0..WIDTH {
                        for column in 0..WIDTH {
                            self.scratch.unknowns[position as usize * WIDTH + row][column] = share.entry(column, row);
                        }
                    }
                    self.mark(self.supernode[position as usize], &mut touched);
                }
            }
        }
        touched.sort_unstable();
        for &id in &touched {
            self.factor.forward(id as usize, &mut self.scratch.unknowns, &mut self.scratch.below);
            self.scratch.marked[id as usize] = false;
            let s = self.factor.symbolic.supernodes[id as usize];
            for unknown in s.first as usize * WIDTH..s.end as usize * WIDTH {
                let value = std::mem::replace(&mut self.scratch.unknowns[unknown], [0.0; WIDTH]);
                #[expect(clippy::cast_possible_truncation, reason = "unknowns are counted in 32 bits")]
                found.core.push((unknown as u32, value));
            }
        }
        found
    }

    fn share(&mut self, node: u32, share: C) {
        let sum = &mut self.scratch.share[node as usize];
        *sum = sum.plus(share);
        if !std::mem::replace(&mut self.scratch.queued[node as usize], true) {
            self.scratch.queue.push((self.rank[node as usize], node));
        }
    }

    /// Marks a supernode and its ancestors.
    fn mark(&mut self, mut id: u32, touched: &mut Vec<u32>) {
        while id != NONE && !std::mem::replace(&mut self.scratch.marked[id as usize], true) {
            touched.push(id);
            id = self.factor.symbolic.supernodes[id as usize].parent;
        }
    }

    /// The covariances `F_i A⁻¹ Gᵀ` of some functionals with another.
    pub(super) fn covariances<'a>(
        &mut self,
        functionals: impl Iterator<Item = &'a Functional<C, WIDTH>>,
        other: &Functional<C, WIDTH>,
    ) -> Vec<C>
    where
        C: 'a,
    {
        for &(node, share) in &other.forest {
            self.scratch.share[node as usize] = share;
        }
        for &(unknown, value) in &other.core {
            self.scratch.unknowns[unknown as usize] = value;
        }
        let found = functionals.map(|functional| self.covariance(functional, other)).collect();
        for &(node, _) in &other.forest {
            self.scratch.share[node as usize] = C::ZERO;
        }
        for &(unknown, _) in &other.core {
            self.scratch.unknowns[unknown as usize] = [0.0; WIDTH];
        }
        found
    }

    /// One covariance, with `other` spread over the working memory.
    fn covariance(&self, functional: &Functional<C, WIDTH>, other: &Functional<C, WIDTH>) -> C {
        let mut sum = C::ZERO;
        for &(node, share) in &functional.forest {
            let meets = self.scratch.share[node as usize];
            if !meets.is_zero()
                && let Place::Leaf { compliance, .. } = self.place[node as usize]
            {
                sum = sum.plus(share.product(compliance).product(meets.transposed()));
            }
        }
        for &(chain, here, share) in &functional.bridges {
            for &(other_chain, there, meets) in &other.bridges {
                if chain == other_chain {
                    let bridge = self.bridge(chain, here, there);
                    sum = sum.plus(share.product(bridge).product(meets.transposed()));
                }
            }
        }
        let mut block = [[0.0; WIDTH]; WIDTH];
        for &(unknown, value) in &functional.core {
            let meets = self.scratch.unknowns[unknown as usize];
            for row in 0..WIDTH {
                for column in 0..WIDTH {
                    block[row][column] += value[row] * meets[column];
                }
            }
        }
        sum.plus(C::from_entries(|row, column| block[row][column]))
    }

    /// The covariance of two places of a chain whose ends are held: `U_i − U_i U⁻¹ U_j`, the first place first.
    fn bridge(&self, chain: u32, here: C, there: C) -> C {
        let all = self.chains[chain as usize].compliance;
        if here.trace() <= there.trace() {
            here.plus(here.product(all.inverted()).product(there).negated())
        } else {
            there.plus(here.product(all.inverted()).product(there).negated())
        }
    }

    /// The value of `Σ sign · p_node` at the optimum of the base.
    pub(super) fn value(&self, terms: &[(usize, f64)]) -> Vector2<f64> {
        terms.iter().map(|&(node, sign)| self.positions[node].coords * sign).sum()
    }

    /// All positions under forces `λ` on functionals: the optimum of the base plus `A⁻¹ Σ Fᵀ λ`.
    pub(super) fn moved(&self, forced: &[(&Functional<C, WIDTH>, Vector2<f64>)], into: &mut Vec<Point2<f64>>) {
        let mut forces = Forces::<WIDTH> {
            forest: vec![Vector2::zeros(); self.len()],
            chain: vec![NONE; self.chains.len()],
            core: vec![0.0; self.factor.unknowns() * 2 / WIDTH],
        };
        // Forces on places of chains, linked chain by chain: compliance before the place, force, next.
        let mut pulls: Vec<(C, Vector2<f64>, u32)> = Vec::new();
        for (functional, force) in forced {
            for &(node, share) in &functional.forest {
                forces.forest[node as usize] += share.transposed().multiply(*force);
            }
            for &(chain, compliance, share) in &functional.bridges {
                let next = std::mem::replace(
                    &mut forces.chain[chain as usize],
                    u32::try_from(pulls.len()).expect("forces are counted in 32 bits"),
                );
                pulls.push((compliance, share.transposed().multiply(*force), next));
            }
            for &(unknown, value) in &functional.core {
                if WIDTH == 1 {
                    forces.core[2 * unknown as usize] += value[0] * force.x;
                    forces.core[2 * unknown as usize + 1] += value[0] * force.y;
                } else {
                    forces.core[unknown as usize] += value[0] * force.x + value[1] * force.y;
                }
            }
        }
        self.back(&mut forces.core);
        into.clear();
        into.extend_from_slice(&self.positions);
        let mut step = vec![Vector2::zeros(); self.len()];
        for &node in &self.order {
            let at = node as usize;
            step[at] = match self.place[at] {
                Place::Anchor => continue,
                Place::Core { position } => {
                    Vector2::new(forces.core[2 * position as usize], forces.core[2 * position as usize + 1])
                }
                Place::Leaf { parent, compliance } => {
                    let force = forces.forest[at];
                    let along = if force == Vector2::zeros() { force } else { compliance.multiply(force) };
                    step[parent as usize] + along
                }
                Place::Link { chain, compliance } => {
                    let Chain { a, b, compliance: all } = self.chains[chain as usize];
                    let (a, b) = (step[a as usize], step[b as usize]);
                    let mut moved = a + compliance.multiply(all.inverted().multiply(b - a));
                    let mut next = forces.chain[chain as usize];
                    while let Some(&(there, force, following)) = pulls.get(next as usize) {
                        moved += self.bridge(chain, compliance, there).multiply(force);
                        next = following;
                    }
                    moved
                }
            };
            into[at] = self.positions[at] + step[at];
        }
    }

    /// `L⁻ᵀ x`, x and y of each node side by side.
    fn back(&self, x: &mut [f64]) {
        let supernodes = self.factor.symbolic.supernodes.len();
        if WIDTH == 1 {
            let mut below = Vec::new();
            (0..supernodes).rev().for_each(|id| self.factor.backward(id, x.as_chunks_mut::<2>().0, &mut below));
        } else {
            let mut below = Vec::new();
            (0..supernodes).rev().for_each(|id| self.factor.backward(id, x.as_chunks_mut::<1>().0, &mut below));
        }
    }
}

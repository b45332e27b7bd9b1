//! Small cores: star by star, each replaced by the mesh among its points that pulls alike.
//!
//! For a hundred nodes it costs more to plan a factorisation than to do one. So the node with the fewest neighbours is
//! eliminated as soon as it is chosen: with couplings `w_u` to its neighbours, the ground among them, and their sum `s`, any
//! two neighbours become coupled by `w_u w_v / s` more, and a force on it is shared out as `w_u / s`. That is Gaussian
//! elimination in terms of springs, in which nothing is ever subtracted (Grassmann, Taksar & Heyman 1985).

use nalgebra::Point2;

use super::compliance::Compliance;
use super::graph::Graph;

/// The most nodes a small core can have: sets of them fit into a number.
pub(super) const LARGEST: usize = 128;

/// What is left of the core.
#[derive(Debug)]
struct Stars {
    nodes: usize,
    /// The coupling of each two nodes, row by row and symmetric.
    coupling: Vec<f64>,
    neighbours: [u128; LARGEST],
    /// The coupling of each node to the anchors.
    ground: [f64; LARGEST],
    /// The force on each node; in the end, how far it moves.
    force: Vec<[f64; 2]>,
    /// The free nodes of each degree, as bits.
    of_degree: [u128; LARGEST],
    /// The nodes in the order of their elimination, each with what it couples to in all.
    order: Vec<(usize, f64)>,
    /// The neighbours that each of them then had, with their shares.
    shares: Vec<(usize, f64)>,
    /// Where the shares of each of them end.
    ends: Vec<usize>,
}

/// Moves the nodes of a core with isotropic springs to the optimum, the anchors held.
pub(super) fn settle<C: Compliance>(core: &Graph<C>, positions: &mut [Point2<f64>]) {
    let mut stars = Stars::new(core, positions);
    pulp::Arch::new().dispatch(Settle(&mut stars));
    for &(node, _) in &stars.order {
        positions[node].x += stars.force[node][0];
        positions[node].y += stars.force[node][1];
    }
}

/// The solution as a task that is compiled for each set of instructions: it counts bits.
struct Settle<'a>(&'a mut Stars);

impl pulp::WithSimd for Settle<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.0.eliminate();
        self.0.come_back();
    }
}

impl Stars {
    fn new<C: Compliance>(core: &Graph<C>, positions: &[Point2<f64>]) -> Self {
        let nodes = core.nodes;
        let mut stars = Self {
            nodes,
            coupling: vec![0.0; nodes * nodes],
            neighbours: [0; LARGEST],
            ground: [0.0; LARGEST],
            force: core.forces(positions),
            of_degree: [0; LARGEST],
            order: Vec::with_capacity(nodes),
            shares: Vec::with_capacity(8 * nodes),
            ends: Vec::with_capacity(nodes),
        };
        let anchors = core.anchors.iter().fold(0_u128, |set, anchor| set | 1 << anchor);
        for edge in &core.edges {
            let (a, b) = (edge.a as usize, edge.b as usize);
            let stiffness = edge.compliance.stiffness().entry(0, 0);
            match (anchors >> a & 1, anchors >> b & 1) {
                (0, 0) => {
                    stars.coupling[a * nodes + b] = stiffness;
                    stars.coupling[b * nodes + a] = stiffness;
                    stars.neighbours[a] |= 1 << b;
                    stars.neighbours[b] |= 1 << a;
                }
                (0, _) => stars.ground[a] += stiffness,
                (_, 0) => stars.ground[b] += stiffness,
                _ => {}
            }
        }
        for node in (0..nodes).filter(|&node| anchors >> node & 1 == 0) {
            stars.of_degree[stars.neighbours[node].count_ones() as usize] |= 1 << node;
        }
        stars
    }

    #[inline(always)]
    fn eliminate(&mut self) {
        let mut least = 0;
        while let Some(nodes) = self.of_degree[least..].iter().position(|&nodes| nodes != 0) {
            least += nodes;
            let node = self.of_degree[least].trailing_zeros() as usize;
            self.of_degree[least] &= !(1 << node);
            self.dissolve(node);
            // A neighbour may lose the node and gain none for it.
            least = least.saturating_sub(1);
        }
    }

    /// Replaces a node by a mesh among its neighbours.
    #[inline(always)]
    fn dissolve(&mut self, node: usize) {
        let clique = self.neighbours[node];
        let (own, force) = (node * self.nodes, self.force[node]);
        let first = self.shares.len();
        for u in bits(clique) {
            self.shares.push((u, self.coupling[own + u]));
        }
        let all = self.ground[node] + self.shares[first..].iter().map(|share| share.1).sum::<f64>();
        for at in first..self.shares.len() {
            let (u, coupling) = self.shares[at];
            let share = coupling / all;
            self.shares[at].1 = share;
            self.ground[u] += share * self.ground[node];
            self.force[u][0] += share * force[0];
            self.force[u][1] += share * force[1];
            for &(v, other) in &self.shares[at + 1..] {
                self.coupling[u * self.nodes + v] += share * other;
                self.coupling[v * self.nodes + u] += share * other;
            }
            let before = self.neighbours[u];
            let after = (before | clique) & !(1 << u | 1 << node);
            self.neighbours[u] = after;
            self.of_degree[before.count_ones() as usize] &= !(1 << u);
            self.of_degree[after.count_ones() as usize] |= 1 << u;
        }
        self.order.push((node, all));
        self.ends.push(self.shares.len());
    }

    /// Lets each node follow those that were left when it went.
    #[inline(always)]
    fn come_back(&mut self) {
        for (step, &(node, all)) in self.order.iter().enumerate().rev() {
            let first = step.checked_sub(1).map_or(0, |before| self.ends[before]);
            let mut moved = self.force[node].map(|force| force / all);
            for &(u, share) in &self.shares[first..self.ends[step]] {
                moved[0] += share * self.force[u][0];
                moved[1] += share * self.force[u][1];
            }
            self.force[node] = moved;
        }
    }
}

/// The numbers of the bits set, ascending.
#[inline(always)]
fn bits(set: u128) -> impl Iterator<Item = usize> {
    #[expect(clippy::cast_possible_truncation, reason = "one half after the other")]
    let mut halves = [set as u64, (set >> 64) as u64];
    std::iter::from_fn(move || {
        let half = usize::from(halves[0] == 0);
        let bits = halves[half];
        halves[half] &= bits.wrapping_sub(1);
        (bits != 0).then(|| half * 64 + bits.trailing_zeros() as usize)
    })
}

//! A map that stays at its optimum while it grows.

mod base;
mod closures;
mod online_sweeps;

pub use online_sweeps::OnlineSweeps;

use nalgebra::{Matrix2, Point2, Vector2};

use crate::elimination::Compliance;
use crate::multilevel::Entry;
use crate::network::{Anchor, Network, NetworkError, check};
use crate::spring::Spring;
use base::{Base, Functional};
use closures::Closures;

/// A network that gains and loses nodes and springs and is at its optimum after every change.
///
/// The answer is the exact one, as [`optimum`](crate::optimum) computes it, to rounding (1e-9 of the energy and better). What a
/// change costs depends on what it touches:
///
/// * a node hung on the map by one spring, as exploration adds most of them, is exact at once: `O(1)`;
/// * a spring between two nodes of the map (a loop closure), or one taken away, is one more row of a small dense system over
///   the closures since the map was factored last (Woodbury 1950). Its coefficients are sums along the loop and along the path
///   of the loop's ends to the root of the factor, so the rest of the map is not looked at;
/// * after some dozen to some hundred closures, more on larger maps, the map is factored afresh, which spreads a full solution
///   over all of them. Joining two components, or parting one, does so at once.
///
/// Positions are computed when they are read: [`position`](Self::position) of one node at the cost of a closure,
/// [`positions`](Self::positions) of all in one pass over the map.
///
/// Each component is held by its anchor, the lowest-numbered node or the one given by
/// [`from_network`](Self::from_network). Where a component falls apart, the part without anchor stays where it is, held by its
/// lowest-numbered node; where two join, the anchor of the lower-numbered component stays.
///
/// ```
/// use relaxation::{nalgebra::Vector2, Incremental, Spring};
///
/// let mut map = Incremental::new();
/// let corners: Vec<usize> = (0..4).map(|_| map.add_node()).collect();
/// let side = |from, to, x, y| Spring::isotropic(from, to, Vector2::new(x, y), 1.0);
/// map.add_spring(side(corners[0], corners[1], 1.0, 0.0))?;
/// map.add_spring(side(corners[1], corners[2], 0.0, 1.0))?;
/// map.add_spring(side(corners[2], corners[3], -1.0, 0.0))?;
/// assert_eq!(map.position(3), [0.0, 1.0].into());
/// let closure = map.add_spring(side(corners[3], corners[0], 0.4, -1.0))?; // 0.4 m off: each side takes a quarter
/// assert!((map.position(3).x + 0.3).abs() < 1e-12);
/// map.remove_spring(closure)?;
/// assert!(map.position(3).x.abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Default)]
pub struct Incremental {
    springs: Vec<Spring>,
    present: Vec<bool>,
    anchors: Vec<Anchor>,
    /// Disjoint sets of connected nodes.
    root: Vec<u32>,
    /// Whether each node has no spring yet.
    lone: Vec<bool>,
    engine: Engine,
    /// The positions of all nodes, if nothing has changed since they were computed.
    positions: Vec<Point2<f64>>,
    fresh: bool,
    factored: usize,
}

/// The base and its closures, with numbers or 2×2 blocks.
#[derive(Debug)]
enum Engine {
    Scalar(Growing<f64, 1>),
    Block(Growing<Matrix2<f64>, 2>),
}

impl Default for Engine {
    fn default() -> Self {
        Self::Scalar(Growing::new(&Network::new(0, &[]).expect("an empty network is legal")))
    }
}

/// A factored map and what came since.
#[derive(Debug)]
struct Growing<C, const WIDTH: usize> {
    base: Base<C, WIDTH>,
    functionals: Vec<Functional<C, WIDTH>>,
    closures: Closures<C>,
}

/// Why a spring could not be taken away.
///
/// The text is a fragment that fits after "could not remove the spring: ".
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("there is no spring {spring} (it never was, or is gone already)")]
pub struct NoSuchSpring {
    /// The number given.
    pub spring: usize,
}

impl Incremental {
    /// An empty map.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A map that begins as `network`, at its optimum. Springs of weight zero keep their numbers and are absent.
    #[must_use]
    pub fn from_network(network: &Network) -> Self {
        let weighted = |index: usize, s: &Spring| Spring { covariance: s.covariance / network.weight(index), ..*s };
        let present: Vec<bool> = (0..network.springs().len()).map(|index| network.weight(index) > 0.0).collect();
        let springs = network.springs().iter().enumerate();
        let springs = springs.map(|(index, s)| if present[index] { weighted(index, s) } else { *s }).collect();
        let mut map = Self { springs, present, anchors: network.anchors().to_vec(), ..Self::default() };
        map.adopt(network);
        map
    }

    /// How many nodes there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.root.len()
    }

    /// Whether there is no node at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.root.is_empty()
    }

    /// How often the map has been factored, the first time included.
    #[must_use]
    pub fn factorizations(&self) -> usize {
        self.factored
    }

    /// Adds a node, held at the origin until a spring joins it to the map, and returns its number.
    ///
    /// # Panics
    ///
    /// If there are more nodes than 32-bit indices can number.
    pub fn add_node(&mut self) -> usize {
        let node = self.root.len();
        self.root.push(u32::try_from(node).expect("nodes are counted in 32 bits"));
        self.lone.push(true);
        match &mut self.engine {
            Engine::Scalar(growing) => growing.base.add_anchor(Point2::origin()),
            Engine::Block(growing) => growing.base.add_anchor(Point2::origin()),
        }
        self.positions.push(Point2::origin());
        node
    }

    /// Adds a spring and returns its number.
    ///
    /// # Errors
    ///
    /// A node that does not exist, a displacement that is not finite, a covariance that is not symmetric positive definite:
    /// see [`Network::new`]. The map is then as it was.
    pub fn add_spring(&mut self, spring: Spring) -> Result<usize, NetworkError> {
        let number = self.springs.len();
        check(number, &spring, self.len())?;
        self.springs.push(spring);
        self.present.push(true);
        let (from, to) = (spring.from, spring.to);
        if from == to {
            return Ok(number);
        }
        let (root_from, root_to) = (self.find(from), self.find(to));
        if matches!(self.engine, Engine::Scalar(_)) && !spring.is_isotropic() {
            self.join(root_from, root_to);
            self.factor();
        } else if root_from == root_to {
            self.close(number, true);
        } else if self.lone[to] && root_from < root_to {
            self.hang(to, from, spring.rest, &spring);
            self.join(root_from, root_to);
        } else if self.lone[from] && root_to < root_from {
            self.hang(from, to, -spring.rest, &spring);
            self.join(root_from, root_to);
        } else {
            self.join(root_from, root_to);
            self.factor();
        }
        (self.lone[from], self.lone[to]) = (false, false);
        Ok(number)
    }

    /// Takes a spring away. What it alone held together stays where it is, as two components.
    ///
    /// # Errors
    ///
    /// A spring that never was or is gone.
    pub fn remove_spring(&mut self, spring: usize) -> Result<(), NoSuchSpring> {
        if !self.present.get(spring).copied().unwrap_or(false) {
            return Err(NoSuchSpring { spring });
        }
        if self.springs[spring].from != self.springs[spring].to {
            self.close(spring, false);
        } else {
            self.present[spring] = false;
        }
        Ok(())
    }

    /// Where a node is.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn position(&mut self, node: usize) -> Point2<f64> {
        if self.fresh {
            return self.positions[node];
        }
        match &mut self.engine {
            Engine::Scalar(growing) => growing.position(node),
            Engine::Block(growing) => growing.position(node),
        }
    }

    /// Where all nodes are.
    pub fn positions(&mut self) -> &[Point2<f64>] {
        if !self.fresh {
            match &self.engine {
                Engine::Scalar(growing) => growing.positions(&mut self.positions),
                Engine::Block(growing) => growing.positions(&mut self.positions),
            }
            self.fresh = true;
        }
        &self.positions
    }

    /// The map as a network: the springs present, in the order of their numbers, and the anchors.
    ///
    /// # Panics
    ///
    /// Never: every spring was checked when it came.
    #[must_use]
    pub fn to_network(&self) -> Network {
        let springs = self.springs.iter().zip(&self.present).filter(|(_, present)| **present).map(|(s, _)| *s);
        Network::from_vec(self.len(), springs.collect()).expect("every spring was checked").held(&self.anchors)
    }

    fn hang(&mut self, node: usize, parent: usize, rest: Vector2<f64>, spring: &Spring) {
        match &mut self.engine {
            Engine::Scalar(growing) => growing.base.hang(node, parent, rest, spring.covariance.m11),
            Engine::Block(growing) => growing.base.hang(node, parent, rest, spring.covariance),
        }
        if self.fresh {
            self.positions[node] = self.positions[parent] + rest;
        }
    }

    /// A spring between nodes of one component comes or goes.
    fn close(&mut self, number: usize, came: bool) {
        let spring = self.springs[number];
        let done = match &mut self.engine {
            Engine::Scalar(growing) => growing.close(&spring, spring.covariance.m11, came),
            Engine::Block(growing) => growing.close(&spring, spring.covariance, came),
        };
        let many = match &self.engine {
            Engine::Scalar(growing) => growing.closures.len(),
            Engine::Block(growing) => growing.closures.len(),
        };
        if !done {
            // A bridge goes: what hung from it stays where it is now.
            self.positions();
        }
        self.present[number] = came;
        if !done || many >= self.patience() {
            self.factor();
        } else {
            self.fresh = false;
        }
    }

    /// Closures after which a fresh factorisation costs less than going on: both costs grow, with the square root of the map.
    fn patience(&self) -> usize {
        self.len().isqrt().clamp(16, 256)
    }

    /// Factors the map afresh.
    fn factor(&mut self) {
        // Anchors do not move, and a part that has lost its anchor is held where it is.
        let known = std::mem::take(&mut self.positions);
        let network = self.to_network();
        let held = network.anchors().iter().map(|anchor| Anchor { node: anchor.node, position: known[anchor.node] });
        let anchors: Vec<Anchor> = held.collect();
        let network = network.held(&anchors);
        self.anchors = anchors;
        self.adopt(&network);
    }

    fn adopt(&mut self, network: &Network) {
        let _span = tracing::debug_span!("factor", nodes = network.len(), springs = network.springs().len()).entered();
        self.engine = if network.is_isotropic() {
            Engine::Scalar(Growing::new(network))
        } else {
            Engine::Block(Growing::new(network))
        };
        let lowest: Vec<u32> = {
            let mut lowest = vec![u32::MAX; network.components()];
            for node in (0..network.len()).rev() {
                lowest[network.component(node)] = u32::try_from(node).expect("nodes are counted in 32 bits");
            }
            lowest
        };
        self.root = (0..network.len()).map(|node| lowest[network.component(node)]).collect();
        self.lone = vec![true; network.len()];
        for s in network.springs() {
            (self.lone[s.from], self.lone[s.to]) = (false, false);
        }
        self.positions = match &self.engine {
            Engine::Scalar(growing) => growing.base.positions.clone(),
            Engine::Block(growing) => growing.base.positions.clone(),
        };
        self.fresh = true;
        self.factored += 1;
    }

    fn find(&mut self, node: usize) -> u32 {
        let mut node = node;
        loop {
            let up = self.root[node] as usize;
            if up == node {
                return self.root[node];
            }
            self.root[node] = self.root[up];
            node = up;
        }
    }

    fn join(&mut self, a: u32, b: u32) {
        self.root[a.max(b) as usize] = a.min(b);
    }
}

impl<C: Compliance + Entry, const WIDTH: usize> Growing<C, WIDTH> {
    fn new(network: &Network) -> Self {
        Self { base: Base::new(network), functionals: Vec::new(), closures: Closures::new() }
    }

    /// Returns whether the spring could come or go without parting the map.
    fn close(&mut self, spring: &Spring, compliance: C, came: bool) -> bool {
        let terms = [(spring.to, 1.0), (spring.from, -1.0)];
        let functional = self.base.functional(&terms);
        let all = self.functionals.iter().chain([&functional]);
        let mut beside = self.base.covariances(all, &functional);
        let Some(own) = beside.pop() else { return false };
        let misfit = spring.rest - self.base.value(&terms);
        let done = self.closures.push(&beside, own, compliance, came, misfit);
        if done {
            self.functionals.push(functional);
        }
        done
    }

    fn position(&mut self, node: usize) -> Point2<f64> {
        let functional = self.base.functional(&[(node, 1.0)]);
        let covariances = self.base.covariances(self.functionals.iter(), &functional);
        let forces = self.closures.forces();
        let moved = covariances.iter().zip(&forces).map(|(c, force)| c.transposed().multiply(*force));
        self.base.positions[node] + moved.sum::<Vector2<f64>>()
    }

    fn positions(&self, into: &mut Vec<Point2<f64>>) {
        let forces = self.closures.forces();
        let forced: Vec<_> = self.functionals.iter().zip(forces).collect();
        self.base.moved(&forced, into);
    }
}

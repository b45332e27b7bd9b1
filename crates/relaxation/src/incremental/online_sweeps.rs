//! The paper's policy: one sweep each time a place is added. To compare with.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::gauss_seidel::inverse;
use crate::network::{Network, NetworkError, check};
use crate::spring::Spring;

/// A map that grows and is swept, as in Duckett & Saffiotti (2000): good between loop closures, far off after them.
///
/// A new node starts where its first spring puts it. Node 0 is the anchor. [`Incremental`](crate::Incremental) is exact and
/// on all but the smallest maps also quicker, since a sweep costs as much as the map is large.
#[derive(Debug, Default)]
pub struct OnlineSweeps {
    springs: Vec<Spring>,
    positions: Vec<Point2<f64>>,
    /// The springs of each node.
    ends: Vec<Vec<End>>,
}

/// A spring as the node at one end sees it.
#[derive(Debug)]
struct End {
    there: usize,
    /// Displacement from there to here.
    rest: Vector2<f64>,
    stiffness: Matrix2<f64>,
}

impl OnlineSweeps {
    /// An empty map.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// How many nodes there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no node at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Adds a node at the origin, where it stays until a spring joins it to the map; returns its number.
    pub fn add_node(&mut self) -> usize {
        self.positions.push(Point2::origin());
        self.ends.push(Vec::new());
        self.positions.len() - 1
    }

    /// Adds a spring; a node that has none yet goes where the spring puts it.
    ///
    /// # Errors
    ///
    /// As [`Network::new`].
    pub fn add_spring(&mut self, spring: Spring) -> Result<(), NetworkError> {
        check(self.springs.len(), &spring, self.len())?;
        self.springs.push(spring);
        let Spring { from, to, rest, .. } = spring;
        if from == to {
            return Ok(());
        }
        if to > 0 && self.ends[to].is_empty() {
            self.positions[to] = self.positions[from] + rest;
        } else if from > 0 && self.ends[from].is_empty() {
            self.positions[from] = self.positions[to] - rest;
        }
        let stiffness = spring.information();
        self.ends[to].push(End { there: from, rest, stiffness });
        self.ends[from].push(End { there: to, rest: -rest, stiffness });
        Ok(())
    }

    /// Moves every node but the first to where its neighbours think it should be, once.
    pub fn sweep(&mut self) {
        for node in 1..self.positions.len() {
            let (mut total, mut sum) = (Matrix2::zeros(), Vector2::zeros());
            for End { there, rest, stiffness } in &self.ends[node] {
                total += stiffness;
                sum += stiffness * (self.positions[*there] + rest).coords;
            }
            if !self.ends[node].is_empty() {
                self.positions[node] = (inverse(&total) * sum).into();
            }
        }
    }

    /// Where all nodes are.
    #[must_use]
    pub fn positions(&self) -> &[Point2<f64>] {
        &self.positions
    }

    /// The map as a network.
    ///
    /// # Panics
    ///
    /// Never: every spring was checked when it came.
    #[must_use]
    pub fn to_network(&self) -> Network {
        Network::new(self.len(), &self.springs).expect("every spring was checked")
    }
}

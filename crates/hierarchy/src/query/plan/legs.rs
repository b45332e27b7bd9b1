//! The graph of doors, and the cheapest chain through it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::Point2;

use super::doors::Door;

/// A way through one region from a door to another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leg {
    pub(super) to: usize,
    pub(super) region: u16,
    pub(super) cost: f64,
    /// Its way's index, and whether that is gone backwards.
    pub(super) way: (usize, bool),
}

/// A chain of doors from start to goal.
#[derive(Debug)]
pub(super) struct Chain {
    pub(super) first: usize,
    /// What leads from each door to the next.
    pub(super) legs: Vec<Leg>,
}

impl Chain {
    pub(super) fn last(&self) -> usize {
        self.legs.last().map_or(self.first, |leg| leg.to)
    }

    /// The cheapest chain (A*: no way is cheaper than it is long), given what it costs from the start to some doors, and
    /// from some doors to the goal.
    pub(super) fn cheapest(
        (doors, legs): (&[Door], &[Vec<Leg>]),
        first: &[(usize, f64)],
        last: &[(usize, f64)],
        goal: Point2<f64>,
    ) -> Option<Self> {
        let arrived = doors.len();
        let mut search = Search::new(arrived + 1);
        let left = |door: usize| if door == arrived { 0.0 } else { (doors[door].point - goal).norm() };
        first.iter().for_each(|&(door, cost)| search.reach(door, cost, left(door), None));
        while let Some(Reverse((_, door))) = search.open.pop() {
            if door == arrived {
                return search.trace();
            }
            if std::mem::replace(&mut search.settled[door], true) {
                continue;
            }
            let cost = search.costs[door];
            for leg in &legs[door] {
                search.reach(leg.to, cost + leg.cost, left(leg.to), Some((door, Some(*leg))));
            }
            for (_, rest) in last.iter().filter(|(exit, _)| *exit == door) {
                search.reach(arrived, cost + rest, 0.0, Some((door, None)));
            }
        }
        None
    }
}

/// What the search knows; the last door stands for the goal.
struct Search {
    costs: Vec<f64>,
    /// The door before, and the leg from there; none leads to the goal.
    came: Vec<Option<(usize, Option<Leg>)>>,
    settled: Vec<bool>,
    open: BinaryHeap<Reverse<(Ordered, usize)>>,
}

impl Search {
    fn new(n: usize) -> Self {
        Self { costs: vec![f64::INFINITY; n], came: vec![None; n], settled: vec![false; n], open: BinaryHeap::new() }
    }

    fn reach(&mut self, door: usize, cost: f64, left: f64, from: Option<(usize, Option<Leg>)>) {
        if cost < self.costs[door] {
            self.costs[door] = cost;
            self.came[door] = from;
            self.open.push(Reverse((Ordered(cost + left), door)));
        }
    }

    fn trace(&self) -> Option<Chain> {
        let (mut first, _) = (*self.came.last()?)?;
        let mut legs = Vec::new();
        while let Some((before, Some(leg))) = self.came[first] {
            legs.push(leg);
            first = before;
        }
        legs.reverse();
        Some(Chain { first, legs })
    }
}

/// A cost that can be compared.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ordered(f64);

impl Eq for Ordered {}

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

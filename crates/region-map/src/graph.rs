//! The graph of regions: who borders whom, and the way from one to another.

use std::{cmp::Ordering, collections::BinaryHeap};

use local_grid::nalgebra::Point2;

use crate::{Gateway, RegionMap};

/// A way through regions.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Route {
    /// Labels of the regions in order, one more than gateways.
    pub regions: Vec<u16>,
    /// Indices of the gateways in order.
    pub gateways: Vec<usize>,
    /// Length of the way that goes straight from gateway to gateway, in metres: what a robot drives is at least this.
    pub length: f64,
}

/// A gateway that can be reached in `length` metres.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reached {
    length: f64,
    gateway: usize,
    /// The region that one is in after the gateway.
    region: u16,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |reached: &Self| (reached.gateway, reached.region);
        other.length.total_cmp(&self.length).then_with(|| key(other).cmp(&key(self)))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl RegionMap {
    /// The gateways of a region: their indices, and the labels of the regions behind them.
    pub fn exits(&self, label: u16) -> impl Iterator<Item = (usize, u16)> + '_ {
        self.gateways.iter().enumerate().filter_map(move |(index, gateway)| match gateway.regions {
            [here, there] | [there, here] if here == label => Some((index, there)),
            _ => None,
        })
    }

    /// The shortest way from one point to another through gateways that are `open` and not blocked (Dijkstra 1959), or `None` where a point
    /// lies in no region or no way leads there.
    ///
    /// Lengths are straight lines from gateway to gateway, so a way through a bent region counts as shorter than it is.
    pub fn route(&self, from: Point2<f64>, to: Point2<f64>, open: impl Fn(&Gateway) -> bool) -> Option<Route> {
        let (start, goal) = (self.region_at(from)?.label, self.region_at(to)?.label);
        if start == goal {
            return Some(Route { regions: vec![start], gateways: Vec::new(), length: (to - from).norm() });
        }
        // Each gateway is two nodes: passed one way, passed the other way.
        let node = |gateway: usize, region: u16| 2 * gateway + usize::from(self.gateways[gateway].regions[1] == region);
        let mut came: Vec<Option<usize>> = vec![None; 2 * self.gateways.len()];
        let mut best = vec![f64::INFINITY; 2 * self.gateways.len()];
        let mut queue = BinaryHeap::new();
        let passable = |&(index, _): &(usize, u16)| !self.gateways[index].blocked && open(&self.gateways[index]);
        let exits = |region: u16| self.exits(region).filter(passable);
        for (gateway, region) in exits(start) {
            let length = (self.gateways[gateway].center - from).norm();
            best[node(gateway, region)] = length;
            queue.push(Reached { length, gateway, region });
        }
        let mut arrived: Option<(f64, usize)> = None;
        while let Some(Reached { length, gateway, region }) = queue.pop() {
            let here = node(gateway, region);
            if length > best[here] {
                continue;
            }
            if arrived.is_some_and(|(total, _)| length >= total) {
                break;
            }
            let center = self.gateways[gateway].center;
            if region == goal {
                let total = length + (to - center).norm();
                if arrived.is_none_or(|(least, _)| total < least) {
                    arrived = Some((total, here));
                }
            }
            for (next, behind) in exits(region).filter(|&(next, _)| next != gateway) {
                let length = length + (self.gateways[next].center - center).norm();
                let there = node(next, behind);
                if length < best[there] {
                    (best[there], came[there]) = (length, Some(here));
                    queue.push(Reached { length, gateway: next, region: behind });
                }
            }
        }
        let (length, last) = arrived?;
        let mut nodes: Vec<usize> = std::iter::successors(Some(last), |&node| came[node]).collect();
        nodes.reverse();
        let behind = |node: &usize| self.gateways[node / 2].regions[node % 2];
        let regions = std::iter::once(start).chain(nodes.iter().map(behind)).collect();
        Some(Route { regions, gateways: nodes.iter().map(|node| node / 2).collect(), length })
    }
}

use std::collections::BTreeMap;

use nalgebra::Point2;
use serde::Serialize;
use topo_map::{LinkOrigin, LinkState, PlaceId};

use crate::atlas::{Atlas, AtlasLink, AtlasPlace};

/// Where a robot can go: the places it was at and the ways it can take between them, as navigation stacks want them.
///
/// One node for each spot: a place that a person merged into another is no node of its own, nor is one that was recognised
/// and lies as near to an earlier one as [`RouteOptions::same_spot`] says. One edge for each two nodes that a passable link
/// joins, whatever the number of links between them.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RouteGraph {
    /// By number of their place.
    pub nodes: Vec<RouteNode>,
    /// By the indices of their nodes.
    pub edges: Vec<RouteEdge>,
}

/// What becomes part of a [`RouteGraph`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RouteOptions {
    /// Ways gone less often are left out; nodes that no way reaches any more stay.
    pub min_traversals: u32,
    /// A place recognised as lying beside an earlier one, no farther than this from it in the map, is the same spot (m).
    pub same_spot: f64,
}

impl Default for RouteOptions {
    /// Every way; half the distance between places.
    fn default() -> Self {
        Self { min_traversals: 0, same_spot: 0.5 }
    }
}

/// A spot to which a robot can be sent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RouteNode {
    /// The number of its place.
    pub place: PlaceId,
    /// Its name: `P12`, unless a person gave it one.
    pub name: String,
    /// Where it lies in the map, in metres.
    pub position: Point2<f64>,
    /// Which way the robot looked when it came here first, in radians.
    pub heading: f64,
    /// How unsure its position is, in metres (one σ along the least sure direction).
    pub sigma: f64,
    /// How many times the robot was here.
    pub visits: u32,
}

/// A way between two nodes, to be gone in both directions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RouteEdge {
    /// Index of one node.
    pub from: usize,
    /// Index of the other, which is greater.
    pub to: usize,
    /// Distance between the two in the map, in metres.
    pub length: f64,
    /// How unsure the measured distance is, in metres; that of the surest link between them.
    pub sigma: f64,
    /// How many times the way was gone; 0 where the two places were only recognised as lying beside each other.
    pub traversals: u32,
}

impl Atlas {
    /// The passable part of the map.
    #[must_use]
    pub fn route_graph(&self, options: &RouteOptions) -> RouteGraph {
        let spots = self.spots(options.same_spot);
        let visited = |index: &usize| self.places[*index].visited;
        let own: Vec<usize> = (0..self.places.len()).filter(visited).filter(|index| spots[*index] == *index).collect();
        let mut nodes: Vec<RouteNode> = own.iter().map(|index| node(&self.places[*index])).collect();
        let node_of: BTreeMap<usize, usize> = own.into_iter().zip(0..).collect();
        for index in (0..self.places.len()).filter(visited).filter(|index| spots[*index] != *index) {
            if let Some(node) = node_of.get(&spots[index]) {
                nodes[*node].absorb(&self.places[index]);
            }
        }
        let mut edges: BTreeMap<(usize, usize), RouteEdge> = BTreeMap::new();
        for link in self.links.iter().filter(is_passable) {
            let (Some(&a), Some(&b)) = (node_of.get(&spots[link.from]), node_of.get(&spots[link.to])) else { continue };
            if a == b {
                continue;
            }
            let (from, to) = (a.min(b), a.max(b));
            let length = (nodes[a].position - nodes[b].position).norm();
            let new = RouteEdge { from, to, length, sigma: f64::INFINITY, traversals: 0 };
            let edge = edges.entry((from, to)).or_insert(new);
            edge.sigma = edge.sigma.min(link.sigma);
            edge.traversals += if link.origin == LinkOrigin::Traveled { link.traversals } else { 0 };
        }
        let edges = edges.into_values().filter(|edge| edge.traversals >= options.min_traversals).collect();
        RouteGraph { nodes, edges }
    }

    /// The index of the place that stands for the spot of each place: an earlier one, the one that a person named, or itself.
    fn spots(&self, same_spot: f64) -> Vec<usize> {
        let mut spots: Vec<usize> = (0..self.places.len()).collect();
        let mut beside = vec![Vec::new(); self.places.len()];
        for link in self.links.iter().filter(is_passable).filter(|link| link.origin == LinkOrigin::Recognized) {
            beside[link.from.max(link.to)].push(link.from.min(link.to));
        }
        for index in 0..spots.len() {
            // Near to what stands for the spot, not only to its neighbour: a chain of small steps is no spot.
            let apart = |spot: &usize| (self.places[*spot].position - self.places[index].position).norm();
            let earlier = beside[index].iter().map(|earlier| spots[*earlier]);
            let near = earlier.filter(|spot| apart(spot) <= same_spot);
            if let Some(spot) = near.min_by(|a, b| apart(a).total_cmp(&apart(b)).then(a.cmp(b))) {
                spots[index] = spot;
            }
        }
        let index_of = |id: PlaceId| self.places.iter().position(|place| place.id == id);
        for index in 0..spots.len() {
            if let Some(other) = self.places[index].same_as.and_then(index_of) {
                let (from, to) = (spots[index], spots[other]);
                spots.iter_mut().filter(|spot| **spot == from).for_each(|spot| *spot = to);
            }
        }
        spots
    }
}

fn is_passable(link: &&AtlasLink) -> bool {
    link.state == LinkState::Open && link.origin != LinkOrigin::Predicted
}

impl RouteNode {
    /// Another place at the same spot: its visits count, and its name does where this one has none.
    fn absorb(&mut self, place: &AtlasPlace) {
        self.visits += place.visits;
        if let Some(name) = place.name.as_ref().filter(|_| self.name == format!("P{}", self.place.0)) {
            self.name.clone_from(name);
        }
    }
}

fn node(place: &AtlasPlace) -> RouteNode {
    RouteNode {
        place: place.id,
        name: place.name.clone().unwrap_or_else(|| format!("P{}", place.id.0)),
        position: place.position,
        heading: place.robot_heading,
        sigma: place.ellipse.map_or(0.0, |(half, _)| half[0]),
        visits: place.visits,
    }
}

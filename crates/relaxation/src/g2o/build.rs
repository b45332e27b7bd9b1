//! From a file's graph to a problem that can be solved: ids become indices, missing vertices are made from the edges.

use nalgebra::Point2;

use super::Graph;
use crate::headings::{Forest, Joint};
use crate::network::{Anchor, Network, NetworkError};
use crate::pose::Pose;
use crate::pose_graph::{PoseGraph, PoseGraphError, PoseSpring, is_positive_definite};
use crate::spring::Spring;

/// The poses of a file as a [`PoseGraph`].
#[derive(Debug, Clone)]
pub struct PoseProblem {
    /// The id of each node, ascending.
    pub ids: Vec<u64>,
    /// One spring for each pose edge, in the file's order. `FIX` vertices are held; in components without one, the vertex of the lowest id.
    pub graph: PoseGraph,
    /// The file's poses; dead reckoning from them for vertices the file does not have.
    pub start: Vec<Pose>,
    /// How many vertices the file did not have.
    pub made: usize,
}

/// The points of a file as a [`Network`].
#[derive(Debug, Clone)]
pub struct PointProblem {
    /// The id of each node, ascending.
    pub ids: Vec<u64>,
    /// One spring for each displacement, in the file's order. `FIX` vertices are anchors; in components without one, the vertex of the lowest id.
    pub network: Network,
    /// The file's positions; dead reckoning from them for vertices the file does not have.
    pub start: Vec<Point2<f64>>,
    /// How many vertices the file did not have.
    pub made: usize,
}

/// Why a file's graph is no problem to solve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// There is nothing of this kind in the file.
    #[error("the file holds no {what}")]
    Nothing {
        /// What was looked for.
        what: &'static str,
    },
    /// A pose edge is wrong.
    #[error("edge {from} → {to} (number {edge} of the pose edges)")]
    PoseEdge {
        /// Number of the edge among the pose edges, from 0.
        edge: usize,
        /// Id.
        from: u64,
        /// Id.
        to: u64,
        /// What is wrong with it.
        #[source]
        source: PoseGraphError,
    },
    /// A displacement is wrong.
    #[error("edge {from} → {to} (number {edge} of the displacements)")]
    PointEdge {
        /// Number of the edge among the displacements, from 0.
        edge: usize,
        /// Id.
        from: u64,
        /// Id.
        to: u64,
        /// What is wrong with it.
        #[source]
        source: NetworkError,
    },
    /// The information matrix of a displacement has no inverse.
    #[error("edge {from} → {to}: the information matrix must be positive definite, got [[{}, {}], [{}, {}]]",
        .information[0], .information[1], .information[1], .information[2])]
    Information {
        /// Id.
        from: u64,
        /// Id.
        to: u64,
        /// I11 I12 I22.
        information: [f64; 3],
    },
    /// The pose graph as a whole is wrong.
    #[error(transparent)]
    PoseGraph(#[from] PoseGraphError),
    /// The network as a whole is wrong.
    #[error(transparent)]
    Network(#[from] NetworkError),
}

impl Graph {
    /// The pose part of the graph, ready to be relaxed.
    ///
    /// # Errors
    /// No poses and pose edges at all, or an edge whose information matrix is not positive definite
    /// (see [`take_indefinite`](Self::take_indefinite)).
    pub fn pose_problem(&self) -> Result<PoseProblem, BuildError> {
        let ids = ids(self.poses.iter().map(|v| v.id), self.pose_edges.iter().map(|e| (e.from, e.to)));
        if ids.is_empty() {
            return Err(BuildError::Nothing { what: "poses (VERTEX_SE2, EDGE_SE2, VERTEX2, EDGE2)" });
        }
        let springs: Vec<PoseSpring> = self
            .pose_edges
            .iter()
            .map(|e| PoseSpring {
                from: rank(&ids, e.from),
                to: rank(&ids, e.to),
                from_to: e.from_to,
                information: e.information_matrix(),
            })
            .collect();
        let graph = PoseGraph::new(ids.len(), &springs).map_err(|source| match source {
            PoseGraphError::PoseNotFinite { spring: edge, .. }
            | PoseGraphError::InformationNotPositiveDefinite { spring: edge, .. } => {
                BuildError::PoseEdge { edge, from: self.pose_edges[edge].from, to: self.pose_edges[edge].to, source }
            }
            other => BuildError::PoseGraph(other),
        })?;
        let mut known: Vec<Option<Pose>> = vec![None; ids.len()];
        for vertex in &self.poses {
            known[rank(&ids, vertex.id)] = Some(vertex.pose);
        }
        let made = known.iter().filter(|pose| pose.is_none()).count();
        let joints: Vec<Joint> = springs.iter().map(|s| Joint::new(s.from, s.to)).collect();
        let forest = Forest::odometry(ids.len(), &joints, |node| known[node].is_some());
        let mut start: Vec<Pose> = known.iter().map(|pose| pose.unwrap_or_default()).collect();
        for step in forest.steps().iter().filter(|step| known[step.child].is_none()) {
            let measured = springs[step.edge].from_to;
            start[step.child] = start[step.parent].compose(if step.forward { measured } else { measured.inverse() });
        }
        let held = self.held(&ids, &joints).into_iter().map(|node| (node, start[node])).collect::<Vec<_>>();
        let graph = graph.with_held(&held)?;
        Ok(PoseProblem { ids, graph, start, made })
    }

    /// The point part of the graph, ready to be relaxed.
    ///
    /// # Errors
    /// No points and displacements at all, an information matrix that is not positive definite, two `FIX` vertices in one component.
    pub fn point_problem(&self) -> Result<PointProblem, BuildError> {
        let ids = ids(self.points.iter().map(|v| v.id), self.point_edges.iter().map(|e| (e.from, e.to)));
        if ids.is_empty() {
            return Err(BuildError::Nothing { what: "points (VERTEX_XY, EDGE_XY, EDGE_POINTXY)" });
        }
        let mut springs = Vec::with_capacity(self.point_edges.len());
        for edge in &self.point_edges {
            let [a, b, c] = edge.information;
            let determinant = a * c - b * b;
            if !(a > 0.0 && determinant > 1e-13 * a * c && determinant.is_finite()) {
                return Err(BuildError::Information { from: edge.from, to: edge.to, information: edge.information });
            }
            let covariance = nalgebra::Matrix2::new(c, -b, -b, a) / determinant;
            springs.push(Spring {
                from: rank(&ids, edge.from),
                to: rank(&ids, edge.to),
                rest: edge.displacement,
                covariance,
            });
        }
        let network = Network::new(ids.len(), &springs).map_err(|source| match source {
            NetworkError::RestNotFinite { spring: edge, .. }
            | NetworkError::CovarianceNotPositiveDefinite { spring: edge, .. } => {
                BuildError::PointEdge { edge, from: self.point_edges[edge].from, to: self.point_edges[edge].to, source }
            }
            other => BuildError::Network(other),
        })?;
        let mut known: Vec<Option<Point2<f64>>> = vec![None; ids.len()];
        for vertex in &self.points {
            known[rank(&ids, vertex.id)] = Some(vertex.position);
        }
        let made = known.iter().filter(|position| position.is_none()).count();
        let joints: Vec<Joint> = springs.iter().map(|s| Joint::new(s.from, s.to)).collect();
        let forest = Forest::odometry(ids.len(), &joints, |node| known[node].is_some());
        let mut start: Vec<Point2<f64>> = known.iter().map(|position| position.unwrap_or(Point2::origin())).collect();
        for step in forest.steps().iter().filter(|step| known[step.child].is_none()) {
            let rest = springs[step.edge].rest;
            start[step.child] = start[step.parent] + if step.forward { rest } else { -rest };
        }
        let anchors: Vec<Anchor> =
            self.held(&ids, &joints).into_iter().map(|node| Anchor { node, position: start[node] }).collect();
        Ok(PointProblem { ids, network: network.with_anchors(&anchors)?, start, made })
    }

    /// Takes the pose edges out whose information matrix is not positive definite, which no least-squares method can use, and returns them.
    pub fn take_indefinite(&mut self) -> Vec<super::PoseEdge> {
        let (kept, taken) = self.pose_edges.iter().partition(|edge| is_positive_definite(&edge.information_matrix()));
        self.pose_edges = kept;
        taken
    }

    /// `FIX` nodes, and the lowest node of each component that has none.
    fn held(&self, ids: &[u64], joints: &[Joint]) -> Vec<usize> {
        let mut fixed: Vec<usize> = self.fixed.iter().filter_map(|id| ids.binary_search(id).ok()).collect();
        fixed.sort_unstable();
        fixed.dedup();
        let forest = Forest::breadth_first(ids.len(), joints);
        let with_fixed: Vec<usize> = fixed.iter().map(|node| forest.root_of(*node)).collect();
        fixed.extend(forest.roots().filter(|root| !with_fixed.contains(root)));
        fixed
    }
}

/// Every id that is named, ascending.
fn ids(vertices: impl Iterator<Item = u64>, edges: impl Iterator<Item = (u64, u64)>) -> Vec<u64> {
    let mut ids: Vec<u64> = vertices.chain(edges.flat_map(|(from, to)| [from, to])).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// The index of an id that is among `ids`; files mostly number from 0 without gaps.
fn rank(ids: &[u64], id: u64) -> usize {
    match usize::try_from(id) {
        Ok(guess) if ids.get(guess) == Some(&id) => guess,
        _ => ids.partition_point(|other| *other < id),
    }
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;

    fn poses(text: &str) -> Result<PoseProblem, BuildError> {
        read(text.as_bytes()).unwrap().pose_problem()
    }

    #[test]
    fn missing_vertices_are_made_from_the_edges() {
        let problem =
            poses("VERTEX_SE2 7 1 1 0\nEDGE_SE2 7 9 2 0 0 1 0 0 1 0 1\nEDGE_SE2 20 9 0 1 0 1 0 0 1 0 1\n").unwrap();
        assert_eq!((problem.ids, problem.made), (vec![7, 9, 20], 2));
        assert_eq!(problem.start[1], Pose::new(3.0, 1.0, 0.0));
        assert_eq!(problem.start[2], Pose::new(3.0, 0.0, 0.0));
        assert_eq!(problem.graph.held(0), Some(Pose::new(1.0, 1.0, 0.0)));
    }

    #[test]
    fn fixed_vertices_are_held_where_the_file_has_them() {
        let problem = poses(
            "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 5 0 1\nFIX 1 77\nEDGE_SE2 0 1 2 0 0 1 0 0 1 0 1\nVERTEX_SE2 4 9 9 0\n",
        )
        .unwrap();
        assert_eq!(problem.graph.held(0), None);
        assert_eq!(problem.graph.held(1), Some(Pose::new(5.0, 0.0, 1.0)));
        assert_eq!(problem.graph.held(2), Some(Pose::new(9.0, 9.0, 0.0)));
    }

    #[test]
    fn an_indefinite_information_matrix_names_its_edge_and_can_be_taken_out() {
        let text = "EDGE_SE2 3 4 1 0 0 1 0 0 1 0 1\nEDGE_SE2 4 5 1 0 0 1 0 0 1 0 -2\n";
        let error = poses(text).unwrap_err();
        assert_eq!(error.to_string(), "edge 4 → 5 (number 1 of the pose edges)");
        let mut graph = read(text.as_bytes()).unwrap();
        assert_eq!(graph.take_indefinite().len(), 1);
        assert_eq!(graph.pose_problem().unwrap().ids, [3, 4]);
    }

    #[test]
    fn points_become_a_network_with_inverse_covariances() {
        let text = "EDGE_XY 0 1 1 2 4 0 2\nVERTEX_XY 0 5 5\n";
        let problem = read(text.as_bytes()).unwrap().point_problem().unwrap();
        assert_eq!(problem.start[1], Point2::new(6.0, 7.0));
        assert_eq!(problem.network.springs()[0].covariance, nalgebra::Matrix2::new(0.25, 0.0, 0.0, 0.5));
        let error = read(&b"EDGE_XY 0 1 1 2 1 1 1\n"[..]).unwrap().point_problem().unwrap_err();
        assert_eq!(
            error.to_string(),
            "edge 0 → 1: the information matrix must be positive definite, got [[1, 1], [1, 1]]"
        );
    }

    #[test]
    fn a_file_with_nothing_in_it_says_so() {
        assert!(matches!(poses("# nothing\n"), Err(BuildError::Nothing { .. })));
        assert!(matches!(Graph::default().point_problem(), Err(BuildError::Nothing { .. })));
    }
}

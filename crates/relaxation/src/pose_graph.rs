//! Pose graphs: positions and headings together, when no compass tells the headings (the full SE(2) cost).
//!
//! The cost is g2o's χ²: `Σ eᵀ I e` with `e = z⁻¹ (x_i⁻¹ x_j)`, translation and wrapped angle. It has many minima; which one is found
//! is settled by the start. So [`relax_poses`] computes the headings first (they alone make the problem hard), then positions
//! exactly as the paper does with known headings, and only then descends on the whole cost ([`descend`]).

mod certificate;
mod covariance;
mod descend;
mod error;
mod linearize;
mod positions;
mod reweighting;
mod search;
mod starts;
#[cfg(test)]
mod tests;

use nalgebra::{Matrix2, Matrix3, Vector2};

use crate::headings::{Forest, Joint};
use crate::network::{Network, NetworkError};
use crate::pose::{Pose, wrap};
use crate::spring::Spring;

pub use certificate::{PoseCertificate, PoseStrain, certify_poses};
pub use covariance::pose_covariances;
pub(crate) use descend::check_start;
pub use descend::{PoseOptions, RelaxedPoses, descend};
pub use error::PoseGraphError;
pub(crate) use error::is_positive_definite;
pub(crate) use reweighting::Reweighting;
pub use search::relax_poses;

/// A measured pose of one node in the frame of another.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PoseSpring {
    /// The node measured from.
    pub from: usize,
    /// The node measured.
    pub to: usize,
    /// Pose of `to` in the frame of `from`.
    pub from_to: Pose,
    /// Inverse covariance of the error `(x, y, heading)` as seen from the measured pose: 1/m², 1/(m·rad), 1/rad².
    pub information: Matrix3<f64>,
}

impl PoseSpring {
    /// The error `e = z⁻¹ (x_from⁻¹ x_to)` with its angle in `[-π, π]`.
    #[must_use]
    pub fn error(&self, map_from_from: Pose, map_from_to: Pose) -> nalgebra::Vector3<f64> {
        let e = self.from_to.between(map_from_from.between(map_from_to));
        nalgebra::Vector3::new(e.x, e.y, wrap(e.heading))
    }

    /// `eᵀ I e`.
    #[must_use]
    pub fn chi2(&self, map_from_from: Pose, map_from_to: Pose) -> f64 {
        let e = self.error(map_from_from, map_from_to);
        e.dot(&(self.information * e))
    }
}

/// Pose springs between numbered nodes: checked, with its components found and each held somewhere.
#[derive(Debug, Clone)]
pub struct PoseGraph {
    springs: Vec<PoseSpring>,
    weights: Vec<f64>,
    /// Where a node is held, if it is.
    held: Vec<Option<Pose>>,
    components: usize,
}

impl PoseGraph {
    /// Checks `springs` between the nodes `0..nodes`. The lowest-numbered node of each component is held at the origin.
    ///
    /// Springs from a node to itself are kept, as a constant of the cost.
    ///
    /// # Errors
    /// A spring that names a missing node, is not finite, or whose information matrix is not symmetric and positive definite.
    pub fn new(nodes: usize, springs: &[PoseSpring]) -> Result<Self, PoseGraphError> {
        if nodes >= u32::MAX as usize || springs.len() >= u32::MAX as usize {
            return Err(PoseGraphError::TooMany { nodes, springs: springs.len() });
        }
        for (index, spring) in springs.iter().enumerate() {
            error::check(index, spring, nodes)?;
        }
        let mut graph = Self {
            springs: springs.to_vec(),
            weights: vec![1.0; springs.len()],
            held: vec![None; nodes],
            components: 0,
        };
        let forest = Forest::breadth_first(nodes, &graph.joints());
        for root in forest.roots() {
            graph.held[root] = Some(Pose::default());
            graph.components += 1;
        }
        Ok(graph)
    }

    /// The same graph with these nodes held at these poses. In components with one of them, the lowest node is free.
    ///
    /// # Errors
    /// A node that does not exist, or a pose that is not finite.
    pub fn with_held(mut self, held: &[(usize, Pose)]) -> Result<Self, PoseGraphError> {
        let nodes = self.held.len();
        let forest = Forest::breadth_first(nodes, &self.joints());
        for &(node, pose) in held {
            if node >= nodes {
                return Err(PoseGraphError::HeldNodeOutOfRange { node, nodes });
            }
            if !pose.is_finite() {
                return Err(PoseGraphError::HeldPoseNotFinite { node });
            }
            self.held[forest.root_of(node)] = None;
        }
        for &(node, pose) in held {
            self.held[node] = Some(pose);
        }
        Ok(self)
    }

    /// The same graph with the information of each spring multiplied by a factor.
    ///
    /// A factor of zero takes the spring out of the cost, but not out of the components: callers keep a spanning forest.
    ///
    /// # Errors
    /// Not one factor for each spring, or one that is negative or not finite.
    pub fn reweighted(&self, factors: &[f64]) -> Result<Self, PoseGraphError> {
        if factors.len() != self.springs.len() {
            return Err(PoseGraphError::WeightCount { weights: factors.len(), springs: self.springs.len() });
        }
        if let Some(spring) = factors.iter().position(|f| !(f.is_finite() && *f >= 0.0)) {
            return Err(PoseGraphError::WeightNegative { spring, weight: factors[spring] });
        }
        Ok(Self { weights: factors.to_vec(), ..self.clone() })
    }

    /// How many nodes there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.held.len()
    }

    /// Whether there are no nodes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.held.is_empty()
    }

    /// How many parts without a spring between them there are.
    #[must_use]
    pub fn components(&self) -> usize {
        self.components
    }

    /// The springs, in the order they were given.
    #[must_use]
    pub fn springs(&self) -> &[PoseSpring] {
        &self.springs
    }

    /// Factors on the springs' information, all 1 unless [`reweighted`](Self::reweighted).
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Where `node` is held, if it is.
    #[must_use]
    pub fn held(&self, node: usize) -> Option<Pose> {
        self.held[node]
    }

    /// g2o's χ² of these poses: `Σ wᵢ eᵢᵀ Iᵢ eᵢ`.
    ///
    /// # Panics
    /// When there are fewer poses than nodes.
    #[must_use]
    pub fn chi2(&self, poses: &[Pose]) -> f64 {
        assert!(poses.len() >= self.len(), "one pose for each node: {} poses, {} nodes", poses.len(), self.len());
        let one = |(spring, weight): (&PoseSpring, &f64)| weight * spring.chi2(poses[spring.from], poses[spring.to]);
        self.springs.iter().zip(&self.weights).map(one).sum()
    }

    /// Poses by dead reckoning: along successive nodes where springs join them, along the first other springs where not.
    #[must_use]
    pub fn odometry(&self) -> Vec<Pose> {
        let forest = Forest::odometry(self.len(), &self.joints(), |node| self.held[node].is_some());
        let mut poses: Vec<Pose> = self.held.iter().map(|held| held.unwrap_or_default()).collect();
        for step in forest.steps() {
            if self.held[step.child].is_some() {
                continue;
            }
            let measured = self.springs[step.edge].from_to;
            let parent = poses[step.parent];
            poses[step.child] = parent.compose(if step.forward { measured } else { measured.inverse() });
        }
        poses
    }

    /// The positions' problem when the headings are known: the network of the paper, one spring for each pose spring.
    ///
    /// Each measured translation is turned into the map's directions; where a spring ties translation to heading, what the known
    /// headings say of its heading error is taken into account. Anchors are the lowest held node of each component; the optimum of the network
    /// is the minimum of χ² over positions when no more nodes than these are held.
    ///
    /// # Errors
    /// More than one held node in a component.
    ///
    /// # Panics
    /// When there are fewer headings than nodes.
    pub fn network(&self, headings: &[f64]) -> Result<Network, NetworkError> {
        assert!(
            headings.len() >= self.len(),
            "one heading for each node: {} headings, {} nodes",
            headings.len(),
            self.len()
        );
        let springs: Vec<Spring> =
            self.springs.iter().map(|spring| in_directions_of_the_map(spring, headings)).collect();
        let anchor = |(node, held): (usize, &Option<Pose>)| {
            held.map(|pose| crate::Anchor { node, position: nalgebra::Point2::from(pose.translation()) })
        };
        let anchors: Vec<_> = self.held.iter().enumerate().filter_map(anchor).collect();
        let network = Network::from_vec(self.len(), springs)?.with_anchors(&anchors)?;
        if self.weights.iter().all(|weight| *weight == 1.0) { Ok(network) } else { network.reweighted(&self.weights) }
    }

    fn joints(&self) -> Vec<Joint> {
        self.springs.iter().map(|spring| Joint::new(spring.from, spring.to)).collect()
    }
}

/// A pose spring whose nodes' headings are known, as a spring of a network.
fn in_directions_of_the_map(spring: &PoseSpring, headings: &[f64]) -> Spring {
    let turn = nalgebra::Rotation2::new(headings[spring.from]).into_inner();
    // The error is seen from the measured pose, so the information turns with its heading, too.
    let seen = turn * nalgebra::Rotation2::new(spring.from_to.heading).into_inner();
    let information: Matrix2<f64> = seen * spring.information.fixed_view::<2, 2>(0, 0) * seen.transpose();
    let covariance = information.try_inverse().unwrap_or(Matrix2::from_element(f64::NAN));
    let covariance = (covariance + covariance.transpose()) * 0.5;
    let tie: Vector2<f64> = seen * spring.information.fixed_view::<2, 1>(0, 2);
    let turned = wrap(headings[spring.to] - headings[spring.from] - spring.from_to.heading);
    let rest = turn * spring.from_to.translation() - covariance * tie * turned;
    Spring { from: spring.from, to: spring.to, rest, covariance }
}

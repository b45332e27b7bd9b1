use nalgebra::{Isometry2, Matrix2, Matrix3, Point2, Rotation2};
use relaxation::{
    Auto, Certificate, Covariance, Direct, Network, NetworkError, Pose, PoseGraph, PoseGraphError, PoseOptions,
    PoseSpring, RobustError, RobustMethod, RobustOptions, Solver, Spring, certify, descend, relax_poses,
    relax_poses_robustly, relax_robustly, sweep,
};
use topo_map::{Link, TopoMap};

use crate::coordinates::directions::HeldHeading;

/// The measured links of a topological map as a problem of relaxation: the one place where links become springs.
///
/// Where a compass holds the headings only positions are unknown, and the problem is the paper's: convex, with one
/// optimum. Where it does not, headings are unknown as well, and the energy is the χ² of the whole poses.
#[derive(Debug, Clone)]
pub enum Problem {
    /// Headings are known.
    Positions(Box<Network>),
    /// Headings are unknown.
    Poses(PoseGraph),
}

/// Why links cannot be relaxed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RelaxationError {
    /// As a network of springs.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// As a graph of poses.
    #[error(transparent)]
    Poses(#[from] PoseGraphError),
    /// As a graph of poses with links that may be false.
    #[error(transparent)]
    Robust(#[from] RobustError),
}

/// Variance in rad² of a turn that a link states as certain, among others that do not: (0.06°)².
const CERTAIN: f64 = 1e-6;

impl Problem {
    /// The springs that the measured links are.
    ///
    /// # Errors
    ///
    /// A link that is no spring, which the topological map should have refused.
    pub fn new<S>(map: &TopoMap<S>) -> Result<Self, RelaxationError> {
        Self::held(map, &[])
    }

    /// The same with headings that the building holds, where no compass does.
    ///
    /// # Errors
    ///
    /// As [`Problem::new`].
    pub fn held<S>(map: &TopoMap<S>, headings: &[HeldHeading]) -> Result<Self, RelaxationError> {
        let nodes = map.places().len();
        let measured = || map.links().iter().filter(|link| link.is_measured());
        if measured().any(|link| link.displacement.turn.is_some()) {
            let mut springs: Vec<PoseSpring> = measured().map(pose_spring).collect();
            springs.extend(headings.iter().filter(|held| held.place.index() > 0).map(heading_spring));
            return Ok(Self::Poses(PoseGraph::new(nodes, &springs)?));
        }
        Ok(Self::Positions(Box::new(network(map)?)))
    }

    /// The energy of some poses, each link counted once, weighted by its covariance.
    #[must_use]
    pub fn energy(&self, poses: &[Isometry2<f64>]) -> f64 {
        match self {
            Self::Positions(network) => network.energy(&positions(poses)),
            Self::Poses(graph) => graph.chi2(&plain(poses)),
        }
    }

    /// The squared normalised residual of every measured link, in their order.
    #[must_use]
    pub fn residuals(&self, poses: &[Isometry2<f64>]) -> Vec<f64> {
        match self {
            Self::Positions(network) => {
                let at = positions(poses);
                (0..network.springs().len()).map(|spring| network.spring_energy(spring, &at)).collect()
            }
            Self::Poses(graph) => {
                let at = plain(poses);
                graph.springs().iter().map(|spring| spring.chi2(at[spring.from], at[spring.to])).collect()
            }
        }
    }

    /// The measured links, by their order, that truncated least squares leaves out, among those that are not trusted.
    ///
    /// # Errors
    ///
    /// Covariances too far apart for 64-bit numbers.
    pub fn outvoted(&self, trusted: &[bool], bound: f64) -> Result<Vec<usize>, RelaxationError> {
        let options =
            RobustOptions { method: RobustMethod::TruncatedLeastSquares { bound }, ..RobustOptions::default() };
        match self {
            Self::Positions(network) => Ok(relax_robustly(network, trusted, &options)?.rejected),
            Self::Poses(graph) => Ok(relax_poses_robustly(graph, trusted, &options, &PoseOptions::default())?.rejected),
        }
    }

    /// One sweep of Gauss-Seidel over the positions, headings left as they are.
    ///
    /// # Errors
    ///
    /// Headings that make a link no spring.
    pub fn swept(&self, poses: &[Isometry2<f64>]) -> Result<Vec<Isometry2<f64>>, RelaxationError> {
        let mut moved = positions(poses);
        match self {
            Self::Positions(network) => sweep(network, &mut moved),
            Self::Poses(graph) => {
                let headings: Vec<f64> = poses.iter().map(|pose| pose.rotation.angle()).collect();
                sweep(&graph.network(&headings)?, &mut moved);
            }
        };
        Ok(put(poses, &moved))
    }

    /// The poses of least energy near some others.
    ///
    /// # Errors
    ///
    /// Covariances too far apart for 64-bit numbers.
    pub fn relaxed(&self, poses: &[Isometry2<f64>]) -> Result<Vec<Isometry2<f64>>, RelaxationError> {
        match self {
            Self::Positions(network) => Ok(put(poses, &Auto.solve(network, &positions(poses)).positions)),
            Self::Poses(graph) => Ok(isometries(&descend(graph, &plain(poses), &PoseOptions::default())?.poses)),
        }
    }

    /// The covariance of every position relative to the first place, in m², with the headings taken as known.
    ///
    /// # Errors
    ///
    /// Headings that make a link no spring.
    pub fn covariances(&self, poses: &[Isometry2<f64>]) -> Result<Vec<Matrix2<f64>>, RelaxationError> {
        let network = self.network_at(poses)?;
        let covariance = Covariance::new(&network);
        Ok((0..network.len()).map(|node| covariance.node(node)).collect())
    }

    /// The springs between positions when the headings are those of `poses`, in the order of the measured links.
    ///
    /// # Errors
    ///
    /// Headings that make a link no spring.
    pub fn network_at(&self, poses: &[Isometry2<f64>]) -> Result<Network, RelaxationError> {
        match self {
            Self::Positions(network) => Ok(Network::clone(network)),
            Self::Poses(graph) => {
                let headings: Vec<f64> = poses.iter().map(|pose| pose.rotation.angle()).collect();
                let all = graph.network(&headings)?;
                // Springs that hold a heading say nothing of positions, and would join what no link joins.
                let tells = |spring: &&Spring| spring.covariance.m11 < 0.1 / NOTHING;
                let links: Vec<Spring> = all.springs().iter().filter(tells).copied().collect();
                Ok(if links.len() < all.springs().len() { Network::from_vec(all.len(), links)? } else { all })
            }
        }
    }

    /// What can be proven of some poses: how far from the optimum they are, and the `strained` links that are farthest from
    /// their measurements, by their number among the measured ones. Headings are taken as they are.
    ///
    /// # Errors
    ///
    /// Headings that make a link no spring.
    pub fn certificate(&self, poses: &[Isometry2<f64>], strained: usize) -> Result<Certificate, RelaxationError> {
        let at = positions(poses);
        match self {
            Self::Positions(network) => Ok(certify(network, &at, strained)),
            Self::Poses(graph) => {
                let headings: Vec<f64> = poses.iter().map(|pose| pose.rotation.angle()).collect();
                Ok(certify(&graph.network(&headings)?, &at, strained))
            }
        }
    }

    /// The least energy there is, found without any start and by another way: what checks the relaxation.
    ///
    /// # Errors
    ///
    /// Covariances too far apart for 64-bit numbers.
    pub fn optimum(&self) -> Result<f64, RelaxationError> {
        match self {
            Self::Positions(network) => Ok(Direct.solve(network, &network.dead_reckoning()).energy),
            Self::Poses(graph) => Ok(relax_poses(graph, &PoseOptions::default())?.chi2),
        }
    }
}

/// The measured links of a map whose headings a compass holds, as the paper's network of springs.
pub(crate) fn network<S>(map: &TopoMap<S>) -> Result<Network, NetworkError> {
    let measured = map.links().iter().filter(|link| link.is_measured());
    let springs: Vec<Spring> = measured.map(spring).collect();
    Network::new(map.places().len(), &springs)
}

pub(crate) fn spring(link: &Link) -> Spring {
    let displacement = &link.displacement;
    let (from, to) = (link.from.index(), link.to.index());
    Spring { from, to, rest: displacement.vector, covariance: displacement.covariance }
}

pub(crate) fn pose_spring(link: &Link) -> PoseSpring {
    let displacement = &link.displacement;
    let (change, variance) = displacement.turn.map_or((0.0, CERTAIN), |turn| (turn.change, turn.variance));
    // The link's covariance is seen from its first place, the spring's error from the measured pose.
    let back = Rotation2::new(-change).into_inner();
    let seen = back * displacement.covariance * back.transpose();
    let mut information = Matrix3::zeros();
    let inverse = seen.try_inverse().unwrap_or_else(Matrix2::zeros);
    information.fixed_view_mut::<2, 2>(0, 0).copy_from(&((inverse + inverse.transpose()) * 0.5));
    information[(2, 2)] = 1.0 / variance;
    let from_to = Pose::new(displacement.vector.x, displacement.vector.y, change);
    PoseSpring { from: link.from.index(), to: link.to.index(), from_to, information }
}

/// A spring from the first place, which is held, that says nothing of positions.
fn heading_spring(held: &HeldHeading) -> PoseSpring {
    let from_to = Pose::new(0.0, 0.0, relaxation::wrap(held.heading));
    let information = Matrix3::from_diagonal(&[NOTHING, NOTHING, 1.0 / held.variance].into());
    PoseSpring { from: 0, to: held.place.index(), from_to, information }
}

/// As little information in 1/m² as a spring may have.
const NOTHING: f64 = 1e-9;

fn positions(poses: &[Isometry2<f64>]) -> Vec<Point2<f64>> {
    poses.iter().map(|pose| pose.translation.vector.into()).collect()
}

fn put(poses: &[Isometry2<f64>], positions: &[Point2<f64>]) -> Vec<Isometry2<f64>> {
    poses.iter().zip(positions).map(|(pose, at)| Isometry2::from_parts(at.coords.into(), pose.rotation)).collect()
}

fn plain(poses: &[Isometry2<f64>]) -> Vec<Pose> {
    let pose = |pose: &Isometry2<f64>| {
        let at = pose.translation.vector;
        Pose::new(at.x, at.y, pose.rotation.angle())
    };
    poses.iter().map(pose).collect()
}

pub(crate) fn isometries(poses: &[Pose]) -> Vec<Isometry2<f64>> {
    poses.iter().map(|pose| Isometry2::new(pose.translation(), pose.heading)).collect()
}

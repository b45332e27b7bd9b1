#![doc = include_str!("../README.md")]

pub use nalgebra;

mod spring;

mod network;

mod bridges;
mod certificate;
mod solver;

mod gauss_seidel;
mod node_variances;
mod sor;

mod conjugate_gradient;
mod multilevel;

mod direct;
mod elimination;

mod auto;

mod covariance;

mod incremental;

mod block_cholesky;
mod unknowns;

mod headings;

mod pose_graph;

mod robust;

pub mod g2o;
mod pose;

pub use auto::Auto;
pub use bridges::bridges;
pub use certificate::{Certificate, Strain, certify, forces, gap_bound};
pub use conjugate_gradient::{ConjugateGradient, Preconditioner};
pub use covariance::{Covariance, JointCovariance, SpringCovariance, joint_covariance};
pub use direct::{Direct, DirectFactor, SolveError, optimum};
pub use elimination::Elimination;
pub use gauss_seidel::{GaussSeidel, SweepOrder, sweep};
pub use headings::{Compass, HeadingError, HeadingMethod, Headings, Turn, headings};
pub use incremental::{Incremental, NoSuchSpring, OnlineSweeps};
pub use multilevel::Multilevel;
pub use network::{Anchor, Network, NetworkError};
pub use node_variances::{NodeVariances, sweep_with_variances};
pub use pose::{Pose, wrap};
pub use pose_graph::{
    PoseCertificate, PoseGraph, PoseGraphError, PoseOptions, PoseSpring, PoseStrain, RelaxedPoses, certify_poses,
    descend, pose_covariances, relax_poses,
};
pub use robust::{
    Kernel, RobustError, RobustMethod, RobustOptions, RobustPoses, RobustPositions, consistent_closures,
    relax_poses_robustly, relax_poses_robustly_from, relax_robustly,
};
pub use solver::{RelaxOptions, Relaxed, Solver, relax};
pub use sor::{FactorOutOfRange, Sor};
pub use spring::Spring;

#![doc = include_str!("../README.md")]

pub use nalgebra;

mod spring;

mod network;

mod certificate;
mod solver;

mod gauss_seidel;

mod direct;
mod elimination;

mod block_cholesky;
mod unknowns;

mod headings;

mod pose_graph;

pub mod g2o;
mod pose;

pub use certificate::{forces, gap_bound};
pub use direct::{Direct, DirectFactor, SolveError, optimum};
pub use elimination::Elimination;
pub use gauss_seidel::{GaussSeidel, SweepOrder, sweep};
pub use headings::{Compass, HeadingError, HeadingMethod, Headings, Turn, headings};
pub use network::{Anchor, Network, NetworkError};
pub use pose::{Pose, wrap};
pub use pose_graph::{PoseGraph, PoseGraphError, PoseOptions, PoseSpring, RelaxedPoses, descend, relax_poses};
pub use solver::{RelaxOptions, Relaxed, Solver, relax};
pub use spring::Spring;

#![doc = include_str!("../README.md")]

pub use nalgebra;

mod spring;

mod network;

mod certificate;
mod solver;

mod gauss_seidel;

mod direct;

pub mod g2o;
mod block_cholesky;
mod pose;

pub use certificate::{forces, gap_bound};
pub use direct::{Direct, DirectFactor, SolveError, optimum};
pub use gauss_seidel::{GaussSeidel, SweepOrder, sweep};
pub use network::{Anchor, Network, NetworkError};
pub use pose::{Pose, wrap};
pub use solver::{RelaxOptions, Relaxed, Solver, relax};
pub use spring::Spring;

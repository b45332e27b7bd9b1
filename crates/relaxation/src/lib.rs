//! Globally consistent coordinates from displacements between places.

pub mod g2o;
mod pose;

pub use nalgebra;
pub use pose::{Pose, wrap};

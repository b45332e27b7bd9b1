//! Behaviour of the crate, file by subject.

mod graph;
mod morphology;
mod plans;
mod rooms;
mod shapes;

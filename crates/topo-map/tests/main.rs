//! Behaviour of the topological level, one binary.

mod localize;
mod map;

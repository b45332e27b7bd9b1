//! Behaviour of the topological level, one binary.
#![expect(clippy::unwrap_used, reason = "helpers of tests may fail loudly, too")]

mod explore;
mod localize;
mod map;

//! Behaviour of the crate as its users see it.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod alignment;
mod laser;
mod plan;
mod signature;
mod sonar_model;
mod structure;

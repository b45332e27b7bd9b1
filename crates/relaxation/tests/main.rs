//! Behaviour of the crate, one module per subject.
#![expect(clippy::unwrap_used, reason = "a test may stop where it fails")]

mod bad_input;
mod covariances;
mod growing;
mod hand_cases;
mod problems;
mod rates;
mod real_graphs;
mod robust_graphs;
mod solvers;

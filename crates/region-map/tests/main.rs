//! Behaviour of the crate, file by subject.

mod plans;
mod rooms;

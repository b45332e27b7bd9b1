//! Decisions that flow down: what the higher levels say about the lower ones.

mod rooms;

pub use rooms::{count_regions, floor, regions};

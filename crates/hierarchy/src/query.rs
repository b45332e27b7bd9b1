//! Decisions that flow down: what the higher levels say about the lower ones.

mod doors;
mod floor;
pub(crate) mod floor_plan;
mod locate;
mod plan;
mod rooms;

pub use floor::floor;
pub use locate::{Finder, FinderError, Whereabouts};
pub use plan::{Plan, Planner, RouteError};
pub use rooms::{count_regions, regions};

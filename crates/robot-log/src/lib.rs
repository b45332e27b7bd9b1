//! Streams of logged robot experiments: CARMEN, and CSV-like logs with a robot description.

mod entry;

pub use entry::{Entry, EntryKind};

pub use local_grid;

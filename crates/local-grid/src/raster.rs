//! Which cells a beam touches: walks along rays, sweeps over cones.

mod cone;
mod ray;

pub use cone::ConeCells;
pub use ray::{RayCell, RayCells};

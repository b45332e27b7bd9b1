//! The places that a way passes.

use nalgebra::Point2;
use topo_map::PlaceId;

use crate::mapper::Mapper;

/// A place belongs to a way that passes it within this distance, in metres.
const PASSED: f64 = 1.0;

impl Mapper {
    /// The visited places that a way passes, in order: the nearest one to each of its points.
    #[must_use]
    pub fn places_along(&self, path: &[Point2<f64>]) -> Vec<PlaceId> {
        let places = self.visited_poses();
        let mut passed = Vec::new();
        for point in path {
            let apart = |pose: &nalgebra::Isometry2<f64>| (pose.translation.vector - point.coords).norm();
            let nearest = places.iter().min_by(|a, b| apart(&a.1).total_cmp(&apart(&b.1)));
            if let Some((place, _)) = nearest.filter(|(_, pose)| apart(pose) <= PASSED)
                && passed.last() != Some(place)
            {
                passed.push(*place);
            }
        }
        passed
    }
}

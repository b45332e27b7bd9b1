use nalgebra::{Matrix2, Point2};
use relaxation::{Anchor, Covariance, Incremental, NetworkError, Spring};
use topo_map::{PlaceId, TopoMap};

use crate::coordinates::problem::spring;

/// The optimal coordinates of a map that grows: after each change only the springs that changed are taken out and put in
/// again, and [`Incremental`] touches no more of the map than they need.
#[derive(Debug, Default)]
pub(super) struct Optimum {
    network: Incremental,
    /// The spring of each link, and its number in the network.
    springs: Vec<Option<(usize, Spring)>>,
}

impl Optimum {
    /// The positions of all places, by their index; of a place without measured link, the origin.
    pub(super) fn follow<S>(&mut self, map: &TopoMap<S>) -> Result<&[Point2<f64>], NetworkError> {
        while self.network.len() < map.places().len() {
            self.network.add_node();
        }
        self.springs.resize(map.links().len(), None);
        for (link, known) in map.links().iter().zip(&mut self.springs) {
            let now = link.is_measured().then(|| spring(link));
            if known.as_ref().map(|(_, spring)| spring) == now.as_ref() {
                continue;
            }
            // The new spring first, so that nothing falls apart meanwhile.
            let added = now.map(|spring| Ok((self.network.add_spring(spring)?, spring))).transpose()?;
            if let Some((number, _)) = std::mem::replace(known, added) {
                self.network.remove_spring(number).expect("a spring that was added and not removed yet");
            }
        }
        Ok(self.network.positions())
    }

    /// How surely each place is known, seen from one of them, by all links together; see [`Seen::covariance`].
    pub(super) fn seen_from(&self, place: PlaceId) -> Result<Seen, NetworkError> {
        let anchor = Anchor { node: place.index(), position: Point2::origin() };
        let network = self.network.to_network().with_anchors(&[anchor])?;
        let covariance = Covariance::new(&network);
        let component = network.component(place.index());
        let node = |node: usize| (network.component(node) == component).then(|| covariance.node(node));
        Ok(Seen { covariances: (0..network.len()).map(node).collect() })
    }
}

/// The places as they are known from one of them.
#[derive(Debug)]
pub(super) struct Seen {
    covariances: Vec<Option<Matrix2<f64>>>,
}

impl Seen {
    /// The covariance of a place's position relative to the one seen from, in m²; `None` where no links lead.
    pub(super) fn covariance(&self, place: PlaceId) -> Option<Matrix2<f64>> {
        *self.covariances.get(place.index())?
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use topo_map::Displacement;

    use super::*;
    use crate::coordinates::problem::network;

    #[test]
    fn what_is_followed_change_by_change_is_what_is_solved_at_once() {
        let step = |x: f64, y: f64| Displacement::isotropic(Vector2::new(x, y), 0.01);
        let (mut map, mut optimum) = (TopoMap::new(), Optimum::default());
        let first = map.add_place(0).unwrap();
        let (second, _) = map.predict_place(first, step(1.0, 0.0), 0.9).unwrap();
        let (third, _) = map.predict_place(first, step(0.0, 1.0), 0.9).unwrap();
        optimum.follow(&map).unwrap();
        map.verify(third, 1).unwrap();
        map.travel(first, third, step(0.1, 0.9)).unwrap();
        optimum.follow(&map).unwrap();
        map.verify(second, 2).unwrap();
        map.travel(third, second, step(0.9, -1.1)).unwrap();
        map.travel(second, first, step(-1.2, 0.1)).unwrap();
        optimum.follow(&map).unwrap();
        map.travel(second, first, step(-1.0, 0.0)).unwrap(); // measured again: its spring changes
        let fourth = map.add_place(3).unwrap();
        map.travel(second, fourth, step(0.1, 0.0)).unwrap();
        map.merge(fourth, second, Vector2::new(0.1, 0.0), Matrix2::zeros()).unwrap();
        let followed = optimum.follow(&map).unwrap().to_vec();
        let solved = relaxation::optimum(&network(&map).unwrap()).unwrap();
        for place in [first, second, third] {
            approx::assert_relative_eq!(followed[place.index()], solved[place.index()], epsilon = 1e-9);
        }
    }
}

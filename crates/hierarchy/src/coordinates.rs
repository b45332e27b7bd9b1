use nalgebra::{Isometry2, Point2, Vector2};
use relaxation::{Direct, Network, NetworkError, Solver, Spring, sweep};
use topo_map::{Displacement, Link, PlaceId, TopoMap};

/// Where the places are in the map: what relaxation makes of the links.
///
/// The one place where links become springs and positions become coordinates again. A place that is merged or
/// predicted has no coordinates of its own and is not part of the network.
#[derive(Debug, Clone, Default)]
pub struct Coordinates {
    map_from_place: Vec<Isometry2<f64>>,
    sweeps: usize,
}

/// How one relaxation went.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Relaxation {
    /// Sweeps spent; 0 where the optimum was solved directly.
    pub sweeps: usize,
    /// Energy before, each link counted once.
    pub energy_before: f64,
    /// Energy after.
    pub energy_after: f64,
    /// Largest shift of a place, in metres.
    pub max_shift: f64,
}

impl Coordinates {
    /// Where a place is and how its axes are turned; the identity for one that has never been placed.
    #[must_use]
    pub fn map_from_place(&self, place: PlaceId) -> Isometry2<f64> {
        self.map_from_place.get(place.index()).copied().unwrap_or_else(Isometry2::identity)
    }

    /// The position of every place in the map, in metres.
    #[must_use]
    pub fn positions(&self) -> Vec<Point2<f64>> {
        self.map_from_place.iter().map(|pose| pose.translation.vector.into()).collect()
    }

    /// Gauss-Seidel sweeps made so far.
    #[must_use]
    pub fn sweeps(&self) -> usize {
        self.sweeps
    }

    /// Puts a place where a known one and the displacement from it say; without one, at the origin.
    pub fn place(&mut self, place: PlaceId, seen_from: Option<(PlaceId, &Displacement)>) {
        let pose = seen_from.map_or_else(Isometry2::identity, |(from, displacement)| {
            self.map_from_place(from) * displacement.from_place_from_to_place()
        });
        if self.map_from_place.len() <= place.index() {
            self.map_from_place.resize(place.index() + 1, Isometry2::identity());
        }
        self.map_from_place[place.index()] = pose;
    }

    /// The springs that the measured links are, with the places' present headings.
    ///
    /// # Errors
    ///
    /// A link that is no spring, which the topological map should have refused.
    pub fn network<S>(&self, map: &TopoMap<S>) -> Result<Network, NetworkError> {
        let springs: Vec<Spring> =
            map.links().iter().filter(|link| link.is_measured()).map(|l| self.spring(l)).collect();
        Network::new(map.places().len(), &springs)
    }

    fn spring(&self, link: &Link) -> Spring {
        let displacement = &link.displacement;
        let (mut rest, mut covariance) = (displacement.vector, displacement.covariance);
        if displacement.turn.is_some() {
            let turn = self.map_from_place(link.from).rotation.to_rotation_matrix();
            rest = turn * rest;
            covariance = turn.matrix() * covariance * turn.matrix().transpose();
        }
        Spring { from: link.from.index(), to: link.to.index(), rest, covariance }
    }

    /// One sweep over all places: the paper's share of relaxation for each added place.
    ///
    /// # Errors
    ///
    /// As [`Coordinates::network`].
    pub fn sweep<S>(&mut self, map: &TopoMap<S>) -> Result<Relaxation, NetworkError> {
        let network = self.network(map)?;
        let before = self.padded(map);
        let mut after = before.clone();
        sweep(&network, &mut after);
        self.sweeps += 1;
        Ok(self.accept(&network, &before, &after, 1))
    }

    /// The coordinates of least energy.
    ///
    /// # Errors
    ///
    /// As [`Coordinates::network`].
    pub fn relax<S>(&mut self, map: &TopoMap<S>) -> Result<Relaxation, NetworkError> {
        let network = self.network(map)?;
        let before = self.padded(map);
        let relaxed = Direct.solve(&network, &before);
        Ok(self.accept(&network, &before, &relaxed.positions, relaxed.sweeps))
    }

    /// One position for each place of the map.
    fn padded<S>(&self, map: &TopoMap<S>) -> Vec<Point2<f64>> {
        let position = |place: &topo_map::Place<S>| self.map_from_place(place.id).translation.vector.into();
        map.places().iter().map(position).collect()
    }

    fn accept(
        &mut self,
        network: &Network,
        before: &[Point2<f64>],
        after: &[Point2<f64>],
        sweeps: usize,
    ) -> Relaxation {
        let mut max_shift: f64 = 0.0;
        for (pose, (from, to)) in self.map_from_place.iter_mut().zip(before.iter().zip(after)) {
            let shift: Vector2<f64> = to - from;
            max_shift = max_shift.max(shift.norm());
            pose.translation.vector = to.coords;
        }
        Relaxation { sweeps, energy_before: network.energy(before), energy_after: network.energy(after), max_shift }
    }
}

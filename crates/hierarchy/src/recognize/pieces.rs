use topo_map::{PlaceId, TopoMap};

/// The pieces of a map: places that measured links hold together. There is one, until the robot is carried.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    /// The piece of each place, by number; later places belong to the last one's. Empty where all is one.
    piece: Vec<u32>,
    /// Whether the robot was ever carried, so that closures may be all that holds the map together.
    was_carried: bool,
}

impl Pieces {
    pub(super) fn of<S>(map: &TopoMap<S>) -> Self {
        if !map.links().iter().any(topo_map::Link::is_carried) {
            return Self::default();
        }
        let groups = map.components();
        if groups.len() < 2 {
            return Self { was_carried: true, ..Self::default() };
        }
        let mut piece = vec![0; map.places().len()];
        for (number, group) in (0..).zip(&groups) {
            group.iter().for_each(|place| piece[place.index()] = number);
        }
        Self { piece, was_carried: true }
    }

    /// Whether the map can fall apart where a closure is taken back.
    pub(super) fn hang_on_closures(&self) -> bool {
        self.was_carried
    }

    pub(super) fn is_whole(&self) -> bool {
        self.piece.is_empty()
    }

    /// Whether two places hang together.
    pub(super) fn are_one(&self, a: PlaceId, b: PlaceId) -> bool {
        let of = |place: PlaceId| self.piece.get(place.index()).or(self.piece.last());
        of(a) == of(b)
    }

    /// How many places do not hang together with this one.
    pub(super) fn others(&self, place: PlaceId) -> usize {
        let of = |place: PlaceId| self.piece.get(place.index()).or(self.piece.last());
        self.piece.iter().filter(|piece| Some(*piece) != of(place)).count()
    }
}

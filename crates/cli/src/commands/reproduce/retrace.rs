//! Where the places would be if less was known: by dead reckoning alone, or by the links that it measures.

use hierarchy::local_grid::nalgebra::{Isometry2, Matrix2, Point2, UnitComplex};
use hierarchy::relaxation::Network;
use hierarchy::topo_map::{Displacement, PlaceId, TopoMap};
use hierarchy::{Anchor, Coordinates, Problem, RelaxationError};
use robot_log::{Entry, EntryKind};

/// A path by stamp, as some way of dead reckoning has it.
pub(super) type Path = hierarchy::evaluate::TimedPath;

/// Where the places are, by their index; nothing for places never visited.
pub(super) type Positions = Vec<Option<Point2<f64>>>;

/// The robot's own odometry, the odometry turned to where the compass points, and the truth.
pub(super) struct Paths {
    pub(super) odometry: Path,
    pub(super) compass: Path,
    pub(super) truth: Path,
}

impl Paths {
    pub(super) fn of(entries: &[Entry]) -> Self {
        let mut reckoned = Isometry2::identity();
        let mut before: Option<Isometry2<f64>> = None;
        let (mut odometry, mut compass, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        for entry in entries {
            match &entry.kind {
                EntryKind::Odometry { odom_from_robot } => {
                    let step = before.map_or_else(Isometry2::identity, |before| before.inv_mul(odom_from_robot));
                    before = Some(*odom_from_robot);
                    reckoned.translation.vector += reckoned.rotation * step.translation.vector;
                    odometry.push((entry.stamp, *odom_from_robot));
                    compass.push((entry.stamp, reckoned));
                }
                EntryKind::Heading { heading, .. } => {
                    reckoned.rotation = UnitComplex::new(heading.radians());
                    if let Some((_, pose)) = compass.last_mut() {
                        *pose = reckoned;
                    }
                }
                EntryKind::Truth { map_from_robot } => truth.push((entry.stamp, *map_from_robot)),
                _ => {}
            }
        }
        Self { odometry: Path::new(odometry), compass: Path::new(compass), truth: Path::new(truth) }
    }
}

/// Where a path puts the centre of each place at its first visit; for places never visited, nothing.
pub(super) fn first_visits(anchors: &[Anchor], path: &Path, places: usize) -> Positions {
    let mut found = vec![None; places];
    for anchor in anchors {
        let spot = &mut found[anchor.place.index()];
        if spot.is_none() {
            *spot = path.at(anchor.stamp).map(|pose| center(&pose, anchor));
        }
    }
    found
}

/// The centre of a place, for a robot that is there; places have the compass' axes, so only positions are needed.
fn center(map_from_robot: &Isometry2<f64>, anchor: &Anchor) -> Point2<f64> {
    Point2::from(map_from_robot.translation.vector - anchor.place_from_robot.translation.vector)
}

/// The topological map that a path measures: the same places, each link the displacement between two visits.
pub(super) struct Measured {
    map: TopoMap<()>,
    coordinates: Coordinates,
    /// The number here of each place there.
    number: Vec<Option<PlaceId>>,
}

/// Variance of a displacement in m², at least and per metre driven.
const VARIANCE: (f64, f64) = (1e-3, 2.5e-3);

impl Measured {
    /// Drives along the anchors again, `each` being told when a place was added.
    pub(super) fn along(
        anchors: &[Anchor],
        path: &Path,
        places: usize,
        mut each: impl FnMut(&TopoMap<()>, &mut Coordinates) -> Result<(), RelaxationError>,
    ) -> Result<Self, RelaxationError> {
        let mut measured =
            Self { map: TopoMap::new(), coordinates: Coordinates::default(), number: vec![None; places] };
        let mut last: Option<(&Anchor, Point2<f64>)> = None;
        for anchor in anchors {
            let Some(pose) = path.at(anchor.stamp) else { continue };
            let spot = center(&pose, anchor);
            let known = measured.number[anchor.place.index()];
            let place = known.unwrap_or_else(|| measured.map.add_place(()).expect("as many places as there were"));
            measured.number[anchor.place.index()] = Some(place);
            let before = last.and_then(|(before, at)| Some((before, at, measured.number[before.place.index()]?)));
            if let Some((before, at, from)) = before.filter(|(.., from)| *from != place) {
                let variance = VARIANCE.0 + VARIANCE.1 * (anchor.travelled - before.travelled);
                let displacement =
                    Displacement { vector: spot - at, covariance: Matrix2::identity() * variance, turn: None };
                measured.map.travel(from, place, displacement).expect("two visited places and a finite path");
                if known.is_none() {
                    measured.coordinates.place(place, Some((from, &displacement)));
                    each(&measured.map, &mut measured.coordinates)?;
                }
            } else if known.is_none() {
                measured.coordinates.place(place, None);
            }
            last = Some((anchor, spot));
        }
        Ok(measured)
    }

    /// Brings the coordinates to their optimum.
    pub(super) fn relax(&mut self) -> Result<(), RelaxationError> {
        self.coordinates.relax(&self.map).map(|_| ())
    }

    /// Where the places are, by the numbers of the map that was explored.
    pub(super) fn positions(&self) -> Positions {
        let at = |place: &PlaceId| Point2::from(self.coordinates.map_from_place(*place).translation.vector);
        self.number.iter().map(|place| place.as_ref().map(at)).collect()
    }

    /// The links as a network of springs.
    pub(super) fn network(&self) -> Result<Network, RelaxationError> {
        match Problem::new(&self.map)? {
            Problem::Positions(network) => Ok(*network),
            Problem::Poses(_) => unreachable!("no link here has a turn"),
        }
    }
}

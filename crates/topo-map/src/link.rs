use local_grid::Heading;
use nalgebra::{Isometry2, Matrix2, Vector2};

use crate::PlaceId;

/// The number of a link in its [`TopoMap`](crate::TopoMap): an index, given out in order from 0 and never again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinkId(pub u32);

impl LinkId {
    /// The number as an index into a slice that has one entry per link.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl std::fmt::Display for LinkId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "link {}", self.0)
    }
}

/// The standard deviation in metres of a link over which the robot was carried.
const CARRIED: f64 = 100.0;

/// How far the heading frame of one place is turned against that of another, where headings are not known for sure.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Turn {
    /// The turn from the first place's frame to the second's, in radians counter-clockwise.
    pub change: f64,
    /// Its variance, in rad².
    pub variance: f64,
}

/// Where one place lies as seen from another: a displacement with its covariance, and a turn if headings are uncertain.
///
/// With a compass both places share the map's axes and `turn` is `None`: this is the paper's link, a vector. Without
/// one, every place has axes of its own: `displacement` is expressed in those of the place where the link begins, and
/// `turn` leads from them to those of the place where it ends.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Displacement {
    /// From the centre of the first place to that of the second, in metres.
    pub vector: Vector2<f64>,
    /// The covariance of `vector`, in m².
    pub covariance: Matrix2<f64>,
    /// The turn between the axes of the two places, unless they are known to be the same.
    pub turn: Option<Turn>,
}

/// Why a displacement cannot be a measurement.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DisplacementError {
    /// A displacement must be a vector.
    #[error("displacement must be finite, got ({0}, {1})")]
    Vector(f64, f64),
    /// A covariance must be symmetric and positive definite.
    #[error("covariance of the displacement must be symmetric and positive definite, got [{xx}, {xy}; {yx}, {yy}]")]
    Covariance {
        /// Row 1, column 1.
        xx: f64,
        /// Row 1, column 2.
        xy: f64,
        /// Row 2, column 1.
        yx: f64,
        /// Row 2, column 2.
        yy: f64,
    },
    /// A turn must be an angle with a variance.
    #[error("turn must be finite with a positive variance, got {change} rad and {variance} rad²")]
    Turn {
        /// The angle given.
        change: f64,
        /// The variance given.
        variance: f64,
    },
}

impl Displacement {
    /// A displacement in the map frame with the same variance (m²) in all directions, as a compass gives it.
    #[must_use]
    pub fn isotropic(vector: Vector2<f64>, variance: f64) -> Self {
        Self { vector, covariance: Matrix2::identity() * variance, turn: None }
    }

    /// The same displacement, of which nothing is known but that the robot was carried: see [`Link::is_carried`].
    #[must_use]
    pub fn carried(&self) -> Self {
        let any_turn = |turn: Turn| Turn { variance: std::f64::consts::PI.powi(2) / 3.0, ..turn };
        Self { covariance: Matrix2::identity() * CARRIED.powi(2), turn: self.turn.map(any_turn), ..*self }
    }

    /// The same displacement as seen from its other end.
    ///
    /// Without a turn this flips the sign. With a turn `(R, v)` the vector becomes `−Rᵀd` and its covariance
    /// `Rᵀ(C + v·Jd(Jd)ᵀ)R`, where `J` turns by a right angle: an uncertain heading at the far end swings the near one.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let Some(turn) = self.turn else {
            return Self { vector: -self.vector, ..*self };
        };
        let back = Isometry2::rotation(-turn.change).rotation;
        let lever = Vector2::new(-self.vector.y, self.vector.x);
        let matrix = back.to_rotation_matrix();
        let covariance = matrix * (self.covariance + turn.variance * lever * lever.transpose()) * matrix.transpose();
        Self { vector: -(back * self.vector), covariance, turn: Some(Turn { change: -turn.change, ..turn }) }
    }

    /// The same displacement in axes that are turned by `turn` radians against the present ones.
    #[must_use]
    pub fn in_axes_turned_by(&self, turn: f64) -> Self {
        let rotation = nalgebra::Rotation2::new(-turn);
        let covariance = rotation * self.covariance * rotation.transpose();
        Self { vector: rotation * self.vector, covariance, turn: self.turn }.symmetric()
    }

    /// The pose of the second place's axes in those of the first.
    #[must_use]
    pub fn from_place_from_to_place(&self) -> Isometry2<f64> {
        Isometry2::new(self.vector, self.turn.map_or(0.0, |turn| turn.change))
    }

    /// This displacement and then `next`, which begins where this one ends.
    ///
    /// Covariances are propagated to first order; the two are taken to be independent.
    #[must_use]
    pub fn followed_by(&self, next: &Self) -> Self {
        let own = self.turn.map_or(0.0, |turn| turn.change);
        let rotation = nalgebra::Rotation2::new(own);
        let moved = rotation * next.vector;
        let lever = Vector2::new(-moved.y, moved.x);
        let swing = self.turn.map_or(0.0, |turn| turn.variance) * lever * lever.transpose();
        let covariance = self.covariance + rotation * next.covariance * rotation.transpose() + swing;
        let turn = match (self.turn, next.turn) {
            (Some(a), Some(b)) => Some(Turn { change: a.change + b.change, variance: a.variance + b.variance }),
            (one, None) | (None, one) => one,
        };
        Self { vector: self.vector + moved, covariance, turn }
    }

    /// The two measurements of the same displacement fused by inverse variance.
    ///
    /// Position and turn are fused each for itself; where only one has a turn, the other is taken to say nothing of it.
    /// Answers `None` when the sum of the information is singular, which checked measurements never are.
    #[must_use]
    pub fn fused(&self, other: &Self) -> Option<Self> {
        let (mine, theirs) = (self.covariance.try_inverse()?, other.covariance.try_inverse()?);
        let covariance = (mine + theirs).try_inverse()?;
        let vector = covariance * (mine * self.vector + theirs * other.vector);
        let turn = match (self.turn, other.turn) {
            (Some(a), Some(b)) => Some(fuse_turns(a, b)),
            (one, None) | (None, one) => one,
        };
        Some(Self { vector, covariance: (covariance + covariance.transpose()) * 0.5, turn })
    }

    /// The squared Mahalanobis distance between two measurements of the same displacement, positions only.
    #[must_use]
    pub fn disagreement(&self, other: &Self) -> f64 {
        let difference = self.vector - other.vector;
        let sum = self.covariance + other.covariance;
        sum.try_inverse().map_or(f64::INFINITY, |information| (difference.transpose() * information * difference)[0])
    }

    /// The same with a covariance that is symmetric to the last bit, as a stored map is.
    #[must_use]
    pub fn symmetric(&self) -> Self {
        Self { covariance: (self.covariance + self.covariance.transpose()) * 0.5, ..*self }
    }

    /// Refuses what cannot be a measurement.
    ///
    /// # Errors
    ///
    /// A vector or turn that is not finite, a covariance that is not symmetric and positive definite, a variance that
    /// is not positive.
    pub fn check(&self) -> Result<(), DisplacementError> {
        let (vector, covariance) = (self.vector, self.covariance);
        if !(vector.x.is_finite() && vector.y.is_finite()) {
            return Err(DisplacementError::Vector(vector.x, vector.y));
        }
        let [xx, xy, yx, yy] = [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 0)], covariance[(1, 1)]];
        let symmetric = (xy - yx).abs() <= 1e-9 * (xx.abs() + yy.abs());
        let definite = xx > 0.0 && yy > 0.0 && xx * yy > xy * yx && xx.is_finite() && yy.is_finite();
        if !(symmetric && definite) {
            return Err(DisplacementError::Covariance { xx, xy, yx, yy });
        }
        match self.turn {
            Some(Turn { change, variance }) if !(change.is_finite() && variance > 0.0 && variance.is_finite()) => {
                Err(DisplacementError::Turn { change, variance })
            }
            _ => Ok(()),
        }
    }
}

/// Two measurements of one turn fused by inverse variance; the difference is taken the short way round.
fn fuse_turns(a: Turn, b: Turn) -> Turn {
    let difference = Heading::from_radians(b.change) - Heading::from_radians(a.change);
    let change = a.change + difference * a.variance / (a.variance + b.variance);
    Turn { change, variance: a.variance * b.variance / (a.variance + b.variance) }
}

/// How a link came into the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum LinkOrigin {
    /// The robot went from one place to the other.
    Traveled,
    /// The two places were recognised as lying beside each other.
    Recognized,
    /// The way between them looked open; nobody has gone it yet.
    Predicted,
}

/// Whether a link can be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum LinkState {
    /// It counts, for routes and for coordinates.
    #[default]
    Open,
    /// Something stands in the way: no route leads over it; if it was traveled, its displacement still counts.
    Blocked,
    /// It is held to be false: it counts for nothing.
    Rejected,
}

/// Two places that lie beside each other, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Link {
    /// Which link this is.
    pub id: LinkId,
    /// Where it begins.
    pub from: PlaceId,
    /// Where it ends.
    pub to: PlaceId,
    /// Where `to` lies as seen from `from`.
    pub displacement: Displacement,
    /// How it came into the map.
    pub origin: LinkOrigin,
    /// Whether it can be used.
    pub state: LinkState,
    /// How many times it was gone, in either direction.
    pub traversals: u32,
}

impl Link {
    /// The length `d` of the link in metres.
    #[must_use]
    pub fn distance(&self) -> f64 {
        self.displacement.vector.norm()
    }

    /// The direction `θ` of the link, in the axes of the place where it begins.
    #[must_use]
    pub fn heading(&self) -> Heading {
        Heading::of(self.displacement.vector)
    }

    /// The place at the other end, seen from `place`, which must be one of its two.
    #[must_use]
    pub fn other_end(&self, place: PlaceId) -> PlaceId {
        if place == self.from { self.to } else { self.from }
    }

    /// The displacement as seen from `place`, which must be one of its two.
    #[must_use]
    pub fn displacement_from(&self, place: PlaceId) -> Displacement {
        if place == self.from { self.displacement } else { self.displacement.reversed() }
    }

    /// Whether a robot may plan to go over it: it is open and was gone, by the robot itself, or recognised.
    #[must_use]
    pub fn is_passable(&self) -> bool {
        self.state == LinkState::Open && self.origin != LinkOrigin::Predicted && !self.is_carried()
    }

    /// Whether the robot did not go over it but was carried: its displacement says where the wheels believed to be, with a
    /// deviation of 100 m, so that it only keeps the map in one piece until the robot recognises something.
    #[must_use]
    pub fn is_carried(&self) -> bool {
        self.origin == LinkOrigin::Traveled && self.displacement.covariance.m11 >= 0.99 * CARRIED.powi(2)
    }

    /// Whether its displacement is a measurement that coordinates must respect.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        self.state != LinkState::Rejected && self.origin != LinkOrigin::Predicted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reversing_twice_gives_the_vector_back() {
        let there = Displacement {
            vector: Vector2::new(1.0, 0.4),
            covariance: Matrix2::new(0.02, 0.005, 0.005, 0.04),
            turn: Some(Turn { change: 0.3, variance: 1e-4 }),
        };
        let again = there.reversed().reversed();
        approx::assert_relative_eq!(again.vector, there.vector, epsilon = 1e-12);
        let identity = there.from_place_from_to_place() * there.reversed().from_place_from_to_place();
        approx::assert_relative_eq!(identity, Isometry2::identity(), epsilon = 1e-12);
    }

    #[test]
    fn fusing_equal_measurements_halves_the_variance() {
        let one = Displacement::isotropic(Vector2::new(1.0, 0.0), 0.02);
        let two = Displacement::isotropic(Vector2::new(1.2, 0.0), 0.02);
        let fused = one.fused(&two).unwrap();
        approx::assert_relative_eq!(fused.vector, Vector2::new(1.1, 0.0), epsilon = 1e-12);
        approx::assert_relative_eq!(fused.covariance[(0, 0)], 0.01, epsilon = 1e-12);
    }

    #[test]
    fn turns_are_fused_across_the_seam() {
        let fused = fuse_turns(Turn { change: 3.1, variance: 1.0 }, Turn { change: -3.1, variance: 1.0 });
        approx::assert_relative_eq!(fused.change, std::f64::consts::PI, epsilon = 1e-12);
    }

    #[test]
    fn impossible_measurements_are_refused() {
        let good = Displacement::isotropic(Vector2::new(1.0, 0.0), 0.02);
        assert_eq!(good.check(), Ok(()));
        let flat = Displacement { covariance: Matrix2::new(1.0, 1.0, 1.0, 1.0), ..good };
        assert!(matches!(flat.check(), Err(DisplacementError::Covariance { .. })));
        let nowhere = Displacement { vector: Vector2::new(f64::NAN, 0.0), ..good };
        assert!(matches!(nowhere.check(), Err(DisplacementError::Vector(..))));
        let spun = Displacement { turn: Some(Turn { change: 0.0, variance: 0.0 }), ..good };
        assert!(matches!(spun.check(), Err(DisplacementError::Turn { .. })));
    }
}

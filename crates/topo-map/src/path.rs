use nalgebra::{Isometry2, Matrix2, Vector2};

use crate::{Displacement, DisplacementError, PlaceId, Turn};

/// The way that the robot went, as a tree of places each reached from an earlier one: what odometry alone says of where
/// any two places lie to each other.
///
/// It holds no recognition, so a loop that is under test can be compared with it. The displacement between any two
/// places takes logarithmic time, and its covariance is exact to first order, the swing of later places by earlier
/// errors of heading included.
#[derive(Debug, Clone, Default)]
pub struct PathTree {
    nodes: Vec<Node>,
    /// The node of each place, by number.
    node_of: Vec<Option<usize>>,
}

/// A place on the way, with sums over all steps from the root, all in the axes of the root.
#[derive(Debug, Clone, Copy)]
struct Node {
    parent: usize,
    /// An ancestor farther up; with these, lowest common ancestors take logarithmic time (Myers 1983).
    jump: usize,
    depth: usize,
    root_from_place: Isometry2<f64>,
    sums: Sums,
}

/// What the covariance between two places needs of the steps between them: all of it adds up along the way.
#[derive(Debug, Clone, Copy)]
struct Sums {
    /// Covariances of the steps' displacements.
    noise: Matrix2<f64>,
    /// Variances `v` of the turns.
    turn: f64,
    /// `Σ v p`, with `p` the point where the turn happened.
    turn_at: Vector2<f64>,
    /// `Σ v p pᵀ`.
    turn_at_squared: Matrix2<f64>,
}

/// Why a step cannot be added to the way.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// A place is reached for the first time only once.
    #[error("{0} is on the way already")]
    Twice(PlaceId),
    /// A step begins somewhere.
    #[error("{0} is not on the way")]
    Unknown(PlaceId),
    /// The step is no measurement.
    #[error("step from {from} to {to}")]
    Step {
        /// Where it begins.
        from: PlaceId,
        /// Where it ends.
        to: PlaceId,
        /// What is wrong with it.
        #[source]
        source: DisplacementError,
    },
}

impl Sums {
    fn zero() -> Self {
        Self { noise: Matrix2::zeros(), turn: 0.0, turn_at: Vector2::zeros(), turn_at_squared: Matrix2::zeros() }
    }

    fn combined(&self, other: &Self, factor: f64) -> Self {
        Self {
            noise: self.noise + other.noise * factor,
            turn: self.turn + other.turn * factor,
            turn_at: self.turn_at + other.turn_at * factor,
            turn_at_squared: self.turn_at_squared + other.turn_at_squared * factor,
        }
    }

    /// `Σ C + Σ v J(c − p)(c − p)ᵀJᵀ`: the covariance of where `c` lies, seen from the other end of the way.
    fn covariance_of(&self, c: Vector2<f64>) -> Matrix2<f64> {
        let cross = c * self.turn_at.transpose();
        let lever = self.turn * c * c.transpose() - cross - cross.transpose() + self.turn_at_squared;
        // J M Jᵀ for the quarter turn J and a symmetric M.
        let swung = Matrix2::new(lever[(1, 1)], -lever[(0, 1)], -lever[(0, 1)], lever[(0, 0)]);
        self.noise + swung
    }
}

impl PathTree {
    /// A way that has not begun.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Begins a way, or a further one that nothing connects with the others, at `place`.
    ///
    /// # Errors
    ///
    /// The place is on the way already.
    pub fn begin(&mut self, place: PlaceId) -> Result<(), PathError> {
        let index = self.reserve(place)?;
        let root_from_place = Isometry2::identity();
        self.nodes.push(Node { parent: index, jump: index, depth: 0, root_from_place, sums: Sums::zero() });
        Ok(())
    }

    /// The robot went from a place on the way to one that it had not reached before.
    ///
    /// # Errors
    ///
    /// `from` is not on the way or `to` is, or the step is no measurement.
    pub fn step(&mut self, from: PlaceId, to: PlaceId, step: &Displacement) -> Result<(), PathError> {
        step.check().map_err(|source| PathError::Step { from, to, source })?;
        let parent = self.find(from).ok_or(PathError::Unknown(from))?;
        self.reserve(to)?;
        let before = self.nodes[parent];
        let root_from_place = before.root_from_place * step.from_place_from_to_place();
        let rotation = before.root_from_place.rotation.to_rotation_matrix();
        let (at, turn) = (root_from_place.translation.vector, step.turn.map_or(0.0, |turn| turn.variance));
        let own = Sums {
            noise: rotation * step.covariance * rotation.transpose(),
            turn,
            turn_at: turn * at,
            turn_at_squared: turn * at * at.transpose(),
        };
        let across = self.nodes[before.jump];
        // Equal strides on both sides make one stride of both.
        let even = before.depth - across.depth == across.depth - self.nodes[across.jump].depth;
        let jump = if even { across.jump } else { parent };
        let sums = before.sums.combined(&own, 1.0);
        self.nodes.push(Node { parent, jump, depth: before.depth + 1, root_from_place, sums });
        Ok(())
    }

    /// Whether the way has been at `place`.
    #[must_use]
    pub fn contains(&self, place: PlaceId) -> bool {
        self.find(place).is_some()
    }

    /// Where `to` lies as seen from `from`, in the axes of `from`, along the way; `None` if no way connects the two.
    ///
    /// Between a place and itself lies nothing, with a covariance of nothing.
    #[must_use]
    pub fn between(&self, from: PlaceId, to: PlaceId) -> Option<Displacement> {
        let (a, c) = (self.find(from)?, self.find(to)?);
        let meet = self.common_ancestor(a, c)?;
        let (start, end) = (&self.nodes[a], &self.nodes[c]);
        let sums = start.sums.combined(&end.sums, 1.0).combined(&self.nodes[meet].sums, -2.0);
        let back = start.root_from_place.rotation.inverse().to_rotation_matrix();
        let seen = start.root_from_place.inverse() * end.root_from_place;
        let covariance = back * sums.covariance_of(end.root_from_place.translation.vector) * back.transpose();
        let turn = (sums.turn > 0.0).then_some(Turn { change: seen.rotation.angle(), variance: sums.turn });
        Some(Displacement { vector: seen.translation.vector, covariance, turn })
    }

    /// How many steps lie between two places along the way; `None` if no way connects them.
    #[must_use]
    pub fn steps_between(&self, from: PlaceId, to: PlaceId) -> Option<usize> {
        let (a, c) = (self.find(from)?, self.find(to)?);
        let meet = self.common_ancestor(a, c)?;
        Some(self.nodes[a].depth + self.nodes[c].depth - 2 * self.nodes[meet].depth)
    }

    fn find(&self, place: PlaceId) -> Option<usize> {
        self.node_of.get(place.index()).copied().flatten()
    }

    fn reserve(&mut self, place: PlaceId) -> Result<usize, PathError> {
        if self.contains(place) {
            return Err(PathError::Twice(place));
        }
        if self.node_of.len() <= place.index() {
            self.node_of.resize(place.index() + 1, None);
        }
        self.node_of[place.index()] = Some(self.nodes.len());
        Ok(self.nodes.len())
    }

    fn common_ancestor(&self, mut a: usize, mut c: usize) -> Option<usize> {
        if self.nodes[a].depth < self.nodes[c].depth {
            std::mem::swap(&mut a, &mut c);
        }
        let depth = self.nodes[c].depth;
        while self.nodes[a].depth > depth {
            let jump = self.nodes[a].jump;
            a = if self.nodes[jump].depth >= depth { jump } else { self.nodes[a].parent };
        }
        while a != c {
            let (x, y) = (self.nodes[a], self.nodes[c]);
            if x.depth == 0 {
                return None; // two ways that nothing connects
            }
            (a, c) = if x.jump == y.jump { (x.parent, y.parent) } else { (x.jump, y.jump) };
        }
        Some(a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(x: f64, y: f64, turn: f64) -> Displacement {
        Displacement {
            vector: Vector2::new(x, y),
            covariance: Matrix2::new(0.01, 0.002, 0.002, 0.02),
            turn: Some(Turn { change: turn, variance: 0.001 }),
        }
    }

    /// A tree of 40 places, each reached from one of the four before it.
    fn tree() -> (PathTree, Vec<(usize, Displacement)>) {
        let mut path = PathTree::new();
        path.begin(PlaceId(0)).unwrap();
        let mut steps = vec![(0, step(0.0, 0.0, 0.0))];
        for place in 1..40_u32 {
            let from = place.saturating_sub(1 + (place * 7) % 4);
            let angle = f64::from(place);
            let taken = step(angle.cos(), 1.0 + angle.sin(), 0.3 * (2.0 * angle).sin());
            path.step(PlaceId(from), PlaceId(place), &taken).unwrap();
            steps.push((from as usize, taken));
        }
        (path, steps)
    }

    /// The chain of steps from `a` to `c`, found without jumps.
    fn chain(steps: &[(usize, Displacement)], a: usize, c: usize) -> Vec<Displacement> {
        let ancestors = |mut at: usize| {
            let mut list = vec![at];
            while at != 0 {
                at = steps[at].0;
                list.push(at);
            }
            list
        };
        let (up, down) = (ancestors(a), ancestors(c));
        let meet = *up.iter().find(|at| down.contains(at)).unwrap();
        let rising = up.iter().take_while(|at| **at != meet).map(|&at| steps[at].1.reversed());
        let mut falling: Vec<_> = down.iter().take_while(|at| **at != meet).map(|&at| steps[at].1).collect();
        falling.reverse();
        rising.chain(falling).collect()
    }

    #[test]
    fn displacements_equal_the_chain_of_steps() {
        let (path, steps) = tree();
        for (a, c) in [(0, 39), (39, 0), (17, 33), (38, 36), (5, 5), (12, 3)] {
            let pose = chain(&steps, a, c)
                .iter()
                .fold(Isometry2::identity(), |pose, step| pose * step.from_place_from_to_place());
            let id = |at: usize| PlaceId(u32::try_from(at).unwrap());
            let between = path.between(id(a), id(c)).unwrap();
            approx::assert_relative_eq!(between.from_place_from_to_place(), pose, epsilon = 1e-9);
            assert_eq!(path.steps_between(id(a), id(c)).unwrap(), chain(&steps, a, c).len());
        }
    }

    #[test]
    fn covariances_equal_first_order_propagation() {
        let (path, steps) = tree();
        for (a, c) in [(0_u32, 39_u32), (17, 33), (36, 20)] {
            // Composition step by step: the covariance of a chain swings with each joint.
            let (mut pose, mut covariance, mut turn, mut cross) =
                (Isometry2::<f64>::identity(), Matrix2::zeros(), 0.0, Vector2::zeros());
            for step in chain(&steps, a as usize, c as usize) {
                let moved = pose.rotation * step.vector;
                let lever = Vector2::new(-moved.y, moved.x);
                let rotation = pose.rotation.to_rotation_matrix();
                // Errors of `reversed` steps correlate turn and position; see there: its vector's swing is in both.
                let reversed_lever = Vector2::new(-step.vector.y, step.vector.x);
                let plain = is_plain(&step);
                let own = if plain { Vector2::zeros() } else { rotation * reversed_lever };
                let v = step.turn.unwrap().variance;
                covariance += cross * lever.transpose() + lever * cross.transpose() + turn * lever * lever.transpose();
                cross += turn * lever + v * own;
                covariance += rotation * step.covariance * rotation.transpose();
                turn += v;
                pose *= step.from_place_from_to_place();
            }
            let between = path.between(PlaceId(a), PlaceId(c)).unwrap();
            approx::assert_relative_eq!(between.covariance, covariance, epsilon = 1e-9);
            approx::assert_relative_eq!(between.turn.unwrap().variance, turn, epsilon = 1e-12);
        }
    }

    /// Whether a step was taken forwards: only then its covariance is the one that all steps of the test have.
    fn is_plain(step: &Displacement) -> bool {
        (step.covariance - Matrix2::new(0.01, 0.002, 0.002, 0.02)).norm() < 1e-12
    }

    #[test]
    fn ways_that_nothing_connects_say_nothing() {
        let (mut path, _) = tree();
        path.begin(PlaceId(50)).unwrap();
        path.step(PlaceId(50), PlaceId(51), &step(1.0, 0.0, 0.0)).unwrap();
        assert_eq!(path.between(PlaceId(3), PlaceId(51)), None);
        assert_eq!(path.between(PlaceId(3), PlaceId(45)), None);
        assert_eq!(path.begin(PlaceId(3)), Err(PathError::Twice(PlaceId(3))));
        assert_eq!(path.step(PlaceId(99), PlaceId(60), &step(1.0, 0.0, 0.0)), Err(PathError::Unknown(PlaceId(99))));
        assert!(path.step(PlaceId(3), PlaceId(60), &step(f64::NAN, 0.0, 0.0)).is_err());
    }

    #[test]
    fn with_a_compass_variances_just_add_up() {
        let mut path = PathTree::new();
        path.begin(PlaceId(0)).unwrap();
        for place in 0..10 {
            let east = Displacement::isotropic(Vector2::new(1.0, 0.0), 0.01);
            path.step(PlaceId(place), PlaceId(place + 1), &east).unwrap();
        }
        let between = path.between(PlaceId(8), PlaceId(2)).unwrap();
        approx::assert_relative_eq!(between.vector, Vector2::new(-6.0, 0.0), epsilon = 1e-12);
        approx::assert_relative_eq!(between.covariance, Matrix2::identity() * 0.06, epsilon = 1e-12);
        assert_eq!(between.turn, None);
    }
}

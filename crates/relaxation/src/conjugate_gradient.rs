//! Conjugate gradients: every step the best one in all directions tried so far.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::gauss_seidel::iterate;
use crate::multilevel::{Entry, Hierarchy, Matrix, Unknowns};
use crate::network::Network;
use crate::solver::{RelaxOptions, Relaxed, Solver};

/// What conjugate gradients take for the inverse of the matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Preconditioner {
    /// The inverse of its diagonal (Jacobi).
    Diagonal,
    /// One cycle of [`Multilevel`](crate::Multilevel) relaxation: a few dozen iterations on maps of any size.
    #[default]
    Multilevel,
}

/// Preconditioned conjugate gradients (Hestenes & Stiefel 1952), x and y in one iteration.
///
/// Needs no more memory than the springs and a few vectors, so it is the solver of last resort for graphs whose factor would
/// not fit. It stops on the proven energy excess as all solvers here do, not on the residual, which on long chains is tiny long
/// before the map is right.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct ConjugateGradient {
    /// When to stop; an iteration counts as a sweep.
    pub options: RelaxOptions,
    /// What stands in for the inverse.
    pub preconditioner: Preconditioner,
}

impl Solver for ConjugateGradient {
    fn name(&self) -> &'static str {
        match self.preconditioner {
            Preconditioner::Diagonal => "conjugate-gradient",
            Preconditioner::Multilevel => "multilevel-conjugate-gradient",
        }
    }

    fn solve(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        if network.is_isotropic() {
            self.iterate::<f64>(network, start)
        } else {
            self.iterate::<Matrix2<f64>>(network, start)
        }
    }
}

/// How the inverse is approximated.
enum Approximation<E> {
    Diagonal(Matrix<E>),
    Cycle(Hierarchy<E>),
}

impl<E: Entry> Approximation<E> {
    fn matrix(&self) -> &Matrix<E> {
        match self {
            Self::Diagonal(matrix) => matrix,
            Self::Cycle(hierarchy) => hierarchy.finest(),
        }
    }

    fn apply(&self, residual: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        match self {
            Self::Diagonal(matrix) => matrix.divided_by_diagonal(residual),
            Self::Cycle(hierarchy) => {
                let mut x = vec![Vector2::zeros(); residual.len()];
                hierarchy.cycle(residual, &mut x);
                x
            }
        }
    }
}

/// Iterations after which the residual is computed afresh, so that rounding does not pile up.
const REFRESH: usize = 50;

impl ConjugateGradient {
    fn iterate<E: Entry>(&self, network: &Network, start: &[Point2<f64>]) -> Relaxed {
        let unknowns = Unknowns::new(network);
        let matrix = unknowns.matrix::<E>(network);
        let approximation = match self.preconditioner {
            Preconditioner::Diagonal => Approximation::Diagonal(matrix),
            Preconditioner::Multilevel => Approximation::Cycle(Hierarchy::new(matrix)),
        };
        let mut state = State::default();
        iterate(network, start, &self.options, |step, positions| {
            if step % REFRESH == 0 {
                state.restart(&approximation, unknowns.forces(network, positions));
            }
            let length = state.step(&approximation);
            unknowns.advance(positions, &state.last, length);
        })
    }
}

/// The vectors of the iteration.
#[derive(Debug, Default)]
struct State {
    residual: Vec<Vector2<f64>>,
    direction: Vec<Vector2<f64>>,
    /// The direction of the step just made.
    last: Vec<Vector2<f64>>,
    /// `A · direction`.
    image: Vec<Vector2<f64>>,
    /// `residual · M⁻¹ residual`.
    height: f64,
}

impl State {
    fn restart<E: Entry>(&mut self, approximation: &Approximation<E>, residual: Vec<Vector2<f64>>) {
        self.direction = approximation.apply(&residual);
        self.height = dot(&residual, &self.direction);
        self.residual = residual;
    }

    /// Steps along `direction` (then found in `last`), returns how far, and turns to the next one.
    fn step<E: Entry>(&mut self, approximation: &Approximation<E>) -> f64 {
        self.last.clone_from(&self.direction);
        approximation.matrix().times(&self.direction, &mut self.image);
        let curvature = dot(&self.direction, &self.image);
        // At the optimum there is nowhere left to go.
        if curvature <= 0.0 || !curvature.is_finite() {
            return 0.0;
        }
        let length = self.height / curvature;
        for (r, q) in self.residual.iter_mut().zip(&self.image) {
            *r -= q * length;
        }
        let preconditioned = approximation.apply(&self.residual);
        let height = dot(&self.residual, &preconditioned);
        let turn = height / self.height;
        for (d, z) in self.direction.iter_mut().zip(&preconditioned) {
            *d = z + *d * turn;
        }
        self.height = height;
        length
    }
}

fn dot(a: &[Vector2<f64>], b: &[Vector2<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

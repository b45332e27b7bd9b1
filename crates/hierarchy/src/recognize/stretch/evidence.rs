//! What the views of a stretch say of one motion.

use nalgebra::{Isometry2, Matrix3, Vector2, Vector3};
use topo_map::{Displacement, PlaceId};

use super::{Likeness, View};
use crate::coordinates::Coordinates;

/// A likeness that agrees with a motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Agreement {
    /// The view's number in the stretch, and the likeness' in the view.
    pub(crate) view: usize,
    pub(crate) likeness: usize,
    pub(crate) known: PlaceId,
    /// Whether what it measured is near enough to become a link: one that only just agrees was probably drawn aside.
    pub(crate) is_firm: bool,
}

/// A view with its comparisons, as the coordinates have them now.
pub(super) struct Sighted {
    /// The view's number in the stretch.
    number: usize,
    pub(super) map_from_place: Isometry2<f64>,
    pub(super) comparisons: Vec<Comparison>,
}

/// A likeness, ready to be held against any motion.
pub(super) struct Comparison {
    /// The likeness' number in the view.
    number: usize,
    known: PlaceId,
    pub(super) map_from_known: Isometry2<f64>,
    log_ratio: f64,
    /// The share of the greatest χ² within which it agrees firmly.
    firm: f64,
    /// Where the old place was measured, the information of that, and the greatest χ² at which it still agrees; absent where
    /// the two do not look alike.
    pub(super) measured: Option<(Isometry2<f64>, Matrix3<f64>, f64)>,
}

/// What the views together say of a motion: the sum of their logarithms, and the information of those that agree on the
/// shift and turn at the pivot, with its gradient.
pub(super) struct Evidence {
    pub(super) sum: f64,
    pub(super) agreeing: Vec<Agreement>,
    pub(super) information: Matrix3<f64>,
    pub(super) gradient: Vector3<f64>,
}

/// How one measured displacement lies to a motion.
pub(super) struct Misfit {
    residual: Vector3<f64>,
    information: Matrix3<f64>,
    is_firm: bool,
}

/// Views say something of a motion where they land no farther from an old place than this, in metres: farther apart, two
/// signatures share too little.
pub(crate) const OVERLAP: f64 = 1.2;
/// 99 % of the χ² distribution with two degrees of freedom, and with three: beyond it a likeness does not agree.
const CHI2_99: [f64; 2] = [9.21, 11.34];
/// What a view says that does not look like the old place on which it would lie.
pub(crate) const UNLIKE: f64 = -1.5;

impl Evidence {
    /// What the views together say of a motion; `pivot` is the point of the map about which the stretch turns.
    pub(super) fn of(views: &[Sighted], motion: &Isometry2<f64>, pivot: Vector2<f64>) -> Self {
        let mut evidence =
            Self { sum: 0.0, agreeing: Vec::new(), information: Matrix3::zeros(), gradient: Vector3::zeros() };
        let pivot = motion * nalgebra::Point2::from(pivot);
        for view in views {
            let lands = motion * view.map_from_place;
            let Some((says, comparison, misfit)) = view.best_at(&lands) else { continue };
            evidence.sum += says;
            if let Some(misfit) = misfit {
                let lever = comparison.map_from_known.translation.vector - pivot.coords;
                let (likeness, known) = (comparison.number, comparison.known);
                let agreement = Agreement { view: view.number, likeness, known, is_firm: misfit.is_firm };
                evidence.agree(agreement, &misfit, &lands, lever);
            }
        }
        evidence
    }

    /// Counts a view that agrees; `lever` leads from the pivot to the old place.
    fn agree(&mut self, agreement: Agreement, misfit: &Misfit, lands: &Isometry2<f64>, lever: Vector2<f64>) {
        // Where the old place is seen when the stretch moves on by a shift and a turn about the pivot.
        let place_from_map = lands.rotation.inverse().to_rotation_matrix();
        let sideways = place_from_map * Vector2::new(-lever.y, lever.x);
        let mut moves = Matrix3::zeros();
        moves.fixed_view_mut::<2, 2>(0, 0).copy_from(&-place_from_map.matrix());
        moves.fixed_view_mut::<2, 1>(0, 2).copy_from(&-sideways);
        moves[(2, 2)] = -1.0;
        self.information += moves.transpose() * misfit.information * moves;
        self.gradient += moves.transpose() * misfit.information * misfit.residual;
        self.agreeing.push(agreement);
    }
}

impl Sighted {
    pub(super) fn of(
        number: usize,
        view: &View,
        wanted: impl Fn(PlaceId) -> bool,
        coordinates: &Coordinates,
        (turn_error, firm): (f64, f64),
    ) -> Self {
        let map_from_place = coordinates.map_from_place(view.place);
        let comparison = |(number, likeness): (usize, &Likeness)| Comparison {
            number,
            known: likeness.known,
            map_from_known: coordinates.map_from_place(likeness.known),
            log_ratio: likeness.log_ratio,
            firm,
            measured: likeness.displacement.and_then(|measured| seen(&measured, turn_error)),
        };
        let wanted = view.likenesses.iter().enumerate().filter(|(_, likeness)| wanted(likeness.known));
        Self { number, map_from_place, comparisons: wanted.map(comparison).collect() }
    }

    /// What the comparison that speaks most for landing there says; `None` where no old place is near.
    pub(super) fn best_at(&self, lands: &Isometry2<f64>) -> Option<(f64, &Comparison, Option<Misfit>)> {
        let mut best: Option<(f64, &Comparison, Option<Misfit>)> = None;
        for comparison in &self.comparisons {
            let apart = comparison.map_from_known.translation.vector - lands.translation.vector;
            if apart.norm_squared() > OVERLAP * OVERLAP {
                continue;
            }
            let (says, misfit) = comparison.says(lands);
            if best.as_ref().is_none_or(|(other, ..)| says > *other) {
                best = Some((says, comparison, misfit));
            }
        }
        best
    }
}

impl Comparison {
    /// What this comparison says of a view that lands somewhere, and how it lies to that if it agrees.
    fn says(&self, lands: &Isometry2<f64>) -> (f64, Option<Misfit>) {
        let Some((measured, information, bound)) = &self.measured else { return (UNLIKE, None) };
        let expected = lands.inv_mul(&self.map_from_known);
        let off = measured.translation.vector - expected.translation.vector;
        let turn = if information[(2, 2)] > 0.0 { expected.rotation.angle_to(&measured.rotation) } else { 0.0 };
        let residual = Vector3::new(off.x, off.y, turn);
        let chi2 = residual.dot(&(information * residual));
        let misfit = Misfit { residual, information: *information, is_firm: chi2 < self.firm * bound };
        ((self.log_ratio - 0.5 * chi2).max(UNLIKE), (chi2 < *bound).then_some(misfit))
    }
}

/// A measured displacement as a pose with its information, 0 for a turn that a compass holds, and its bound of agreement;
/// `None` for a covariance that is none.
fn seen(measured: &Displacement, turn_error: f64) -> Option<(Isometry2<f64>, Matrix3<f64>, f64)> {
    let mut information = Matrix3::zeros();
    information.fixed_view_mut::<2, 2>(0, 0).copy_from(&measured.covariance.try_inverse()?);
    if let Some(turn) = measured.turn {
        information[(2, 2)] = 1.0 / (turn.variance + turn_error.powi(2));
    }
    let bound = CHI2_99[usize::from(measured.turn.is_some())];
    Some((measured.from_place_from_to_place(), information, bound))
}

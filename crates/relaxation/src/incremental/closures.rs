//! The springs that came (or went) since the base was factored, as one small dense system.

use nalgebra::Vector2;

use crate::multilevel::Entry;

/// `M = L D Lᵀ` for `M_ij = F_i A⁻¹ F_jᵀ + δ_ij U_i`, grown row by row, and the misfit of each spring under the base.
///
/// `U_i` is the compliance of a spring that came, and minus that of one that went (Woodbury 1950). Each leading part of the
/// system belongs to a map that was sound at its time, so no pivot is zero.
#[derive(Debug)]
pub(super) struct Closures<E> {
    /// Rows of the unit lower triangle, without the diagonal.
    lower: Vec<Vec<E>>,
    pivots: Vec<E>,
    misfits: Vec<Vector2<f64>>,
}

/// A spring is a bridge when what is left of its variance by the others is all of it, but for this part.
const BRIDGE: f64 = 1e-7;

impl<E: Entry> Closures<E> {
    pub(super) fn new() -> Self {
        Self { lower: Vec::new(), pivots: Vec::new(), misfits: Vec::new() }
    }

    /// Adds a spring of which the base misses `misfit`; `beside` and `own` are its covariances with those before and itself.
    ///
    /// Returns `false`, and adds nothing, if the spring went and nothing else holds its ends together.
    pub(super) fn push(&mut self, beside: &[E], own: E, compliance: E, came: bool, misfit: Vector2<f64>) -> bool {
        let mut row: Vec<E> = Vec::with_capacity(beside.len());
        let mut pivot = own.plus(if came { compliance } else { compliance.negated() });
        for (j, &entry) in beside.iter().enumerate() {
            // entry is M_ji: the row below the diagonal holds its transpose.
            let known = self.lower[j].iter().zip(&row).zip(&self.pivots);
            let rest = known.fold(entry.transposed(), |rest, ((l, r), d)| {
                rest.plus(r.product(*d).product(l.transposed()).negated())
            });
            row.push(rest.product(self.pivots[j].inverted()));
        }
        for (r, d) in row.iter().zip(&self.pivots) {
            pivot = pivot.plus(r.product(*d).product(r.transposed()).negated());
        }
        if !came && !pivot.negated().plus(compliance.product(E::scalar(BRIDGE)).negated()).is_positive() {
            return false;
        }
        self.lower.push(row);
        self.pivots.push(pivot);
        self.misfits.push(misfit);
        true
    }

    /// The forces `λ = M⁻¹ misfits`.
    pub(super) fn forces(&self) -> Vec<Vector2<f64>> {
        let mut x = self.misfits.clone();
        for i in 0..x.len() {
            for (j, l) in self.lower[i].iter().enumerate() {
                let known = x[j];
                x[i] -= l.multiply(known);
            }
        }
        for (x, pivot) in x.iter_mut().zip(&self.pivots) {
            *x = pivot.inverted().multiply(*x);
        }
        for i in (0..x.len()).rev() {
            for (j, l) in self.lower[i].iter().enumerate() {
                let known = x[i];
                x[j] -= l.transposed().multiply(known);
            }
        }
        x
    }

    pub(super) fn len(&self) -> usize {
        self.pivots.len()
    }
}

//! Which motion of a stretch is the likeliest.

use std::collections::HashMap;

use nalgebra::{Isometry2, Matrix3, Vector2, Vector3};
use topo_map::PlaceId;

use super::evidence::{Agreement, Evidence, Sighted};
use super::{View, motion};
use crate::coordinates::Coordinates;
use crate::recognize::reach::{Held, Reach};

/// A motion of the whole stretch in the map, and what speaks for it.
#[derive(Debug, Clone)]
pub(crate) struct Hypothesis {
    /// Where a point of the stretch would come to lie.
    pub(crate) motion: Isometry2<f64>,
    /// Logarithm of its probability against that of "never been here", which has 0.
    pub(crate) log_weight: f64,
    pub(crate) agreeing: Vec<Agreement>,
    /// Whether it leaves the stretch about where the coordinates have it, though they need not be believed.
    pub(crate) stays: bool,
}

/// Weighs all motions that the views of a stretch propose against each other, and against none.
pub(crate) struct Weighing<'a> {
    views: Vec<Sighted>,
    turns: bool,
    doubt: Doubt<'a>,
    /// The newest place: where a motion is measured.
    pivot: Vector2<f64>,
}

/// How far the coordinates of a stretch may be wrong.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Doubt<'a> {
    /// What holds the robot's pose, and how surely each old place is known from the newest.
    Held(Held, &'a HashMap<PlaceId, Reach>),
    /// They say nothing: the robot was carried, and may be at any of so many places.
    Anywhere(usize),
}

/// Motions closer than this are the same, in metres and radians.
const SAME: (f64, f64) = (0.8, 0.2);
/// Steps of refinement from a motion that is only roughly known.
const STEPS: usize = 3;
/// Proposals so close to each other need no judgement of their own.
const NEARLY_EQUAL: (f64, f64) = (0.1, 0.05);
/// Logarithm of the probability that the robot was not carried where it seemed so, and how far it is then from where its
/// wheels believe, as deviations in metres and radians.
const UNMOVED: f64 = -2.3;
const UNMOVED_WITHIN: (f64, f64) = (0.5, 0.1);
/// The least deviations of the coordinates, in metres and radians: a scan may be laid wrongly now and then.
const LEAST_DOUBT: (f64, f64) = (0.15, 0.02);

/// The variance of a turn that a compass holds, in rad².
const CERTAIN: f64 = 1e-6;

impl Doubt<'_> {
    /// The deviation by which an alignment may err in the turn, beyond its own covariance, in radians: scans see walls where
    /// they are, a few sonars see them a decimetre to the side.
    fn turn_error(self) -> f64 {
        if matches!(self, Self::Held(Held::Scans, _)) { 0.02 } else { 0.2 }
    }

    /// The share of the greatest χ² within which an alignment agrees firmly: 95 % of χ² where precise scans measure the link
    /// in the end. Of 2,083 alignments of sonar views half erred by less than a tenth of what their covariance says, and 98 %
    /// by less than a quarter of the bound: those beyond were drawn aside by something else.
    fn firm(self) -> f64 {
        if matches!(self, Self::Held(Held::Scans, _)) { 0.65 } else { 0.25 }
    }

    /// Logarithm of the number of places among which the stretch has to be found.
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2⁵² places")]
    fn log_places(self) -> f64 {
        if let Self::Anywhere(places) = self { (places.max(1) as f64).ln() } else { 0.0 }
    }
}

impl<'a> Weighing<'a> {
    /// Of numbered views those comparisons with old places that are `wanted`.
    pub(crate) fn new(
        views: impl IntoIterator<Item = (usize, &'a View)>,
        wanted: impl Fn(PlaceId) -> bool,
        coordinates: &Coordinates,
        doubt: Doubt<'a>,
    ) -> Self {
        let trust = (doubt.turn_error(), doubt.firm());
        let sighted = |(number, view)| Sighted::of(number, view, &wanted, coordinates, trust);
        let views: Vec<Sighted> = views.into_iter().map(sighted).collect();
        let pivot = views.last().map_or_else(Vector2::zeros, |view| view.map_from_place.translation.vector);
        let mut comparisons = views.iter().flat_map(|view| &view.comparisons);
        let turns = comparisons.any(|of| of.measured.is_some_and(|(_, information, _)| information[(2, 2)] > 0.0));
        Self { views, turns, doubt, pivot }
    }

    /// All motions worth the name, the likeliest first, each different from those before it.
    pub(crate) fn hypotheses(&self) -> Vec<Hypothesis> {
        let proposed: Vec<Hypothesis> = self.proposals().iter().filter_map(|motion| self.judge(motion)).collect();
        let refined = self.different(proposed).iter().filter_map(|rough| self.refined(rough)).collect();
        self.different(refined)
    }

    /// The best motion near a given one.
    pub(crate) fn near(&self, motion: &Isometry2<f64>) -> Option<Hypothesis> {
        let mut best = self.judge(motion)?;
        for _ in 0..STEPS {
            best = self.refined(&best)?;
        }
        Some(best)
    }

    /// What each view says of a motion, in their order; 0 where it would land on no old place.
    pub(crate) fn said(&self, motion: &Isometry2<f64>) -> Vec<f64> {
        let says = |view: &Sighted| view.best_at(&(motion * view.map_from_place)).map_or(0.0, |(says, ..)| says);
        self.views.iter().map(says).collect()
    }

    /// The likeliest first, without those that are close to a likelier one.
    fn different(&self, mut hypotheses: Vec<Hypothesis>) -> Vec<Hypothesis> {
        hypotheses.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
        let mut different: Vec<Hypothesis> = Vec::new();
        for hypothesis in hypotheses {
            if different.iter().all(|other| !self.are_close(&hypothesis.motion, &other.motion, SAME)) {
                different.push(hypothesis);
            }
        }
        different
    }

    /// The motion that each likeness proposes by itself.
    fn proposals(&self) -> Vec<Isometry2<f64>> {
        let mut proposals: Vec<Isometry2<f64>> = Vec::new();
        for view in &self.views {
            for comparison in &view.comparisons {
                let Some((measured, information, _)) = &comparison.measured else { continue };
                let turned = information[(2, 2)] > 0.0;
                let motion = motion(&view.map_from_place, &comparison.map_from_known, measured, turned);
                if proposals.iter().all(|other| !self.are_close(&motion, other, NEARLY_EQUAL)) {
                    proposals.push(motion);
                }
            }
        }
        proposals
    }

    fn are_close(&self, a: &Isometry2<f64>, b: &Isometry2<f64>, within: (f64, f64)) -> bool {
        let (a_pivot, b_pivot) = (a * nalgebra::Point2::from(self.pivot), b * nalgebra::Point2::from(self.pivot));
        (a_pivot - b_pivot).norm() < within.0 && a.rotation.angle_to(&b.rotation).abs() < within.1
    }

    fn judge(&self, motion: &Isometry2<f64>) -> Option<Hypothesis> {
        let seen = Evidence::of(&self.views, motion, self.pivot);
        let doubt = self.doubt(&seen.agreeing)?;
        Some(self.weighed(*motion, seen, &doubt))
    }

    /// A hypothesis moved to where the views that agree with it and the coordinates together want it, if that is better.
    fn refined(&self, rough: &Hypothesis) -> Option<Hypothesis> {
        let seen = Evidence::of(&self.views, &rough.motion, self.pivot);
        let better = self.judge(&self.towards(&rough.motion, &seen, &self.doubt(&seen.agreeing)?));
        better.filter(|better| better.log_weight > rough.log_weight).or_else(|| Some(rough.clone()))
    }

    /// By how much the coordinates may be wrong: the variances of shift and turn, over the surest way to any place agreed on;
    /// infinite where they say nothing.
    fn doubt(&self, agreeing: &[Agreement]) -> Option<Vector3<f64>> {
        agreeing.first()?;
        let Doubt::Held(held, reach) = self.doubt else { return Some(Vector3::repeat(f64::INFINITY)) };
        let reach = agreeing.iter().filter_map(|at| reach.get(&at.known));
        let surest = reach.min_by(|a, b| held.variance(a).total_cmp(&held.variance(b)))?;
        let shift = held.variance(surest) + LEAST_DOUBT.0.powi(2);
        let turn = if self.turns { surest.turn_variance + LEAST_DOUBT.1.powi(2) } else { CERTAIN };
        Some(Vector3::new(shift, shift, turn))
    }

    /// Shift and turn of a motion, at the pivot.
    fn at_pivot(&self, motion: &Isometry2<f64>) -> Vector3<f64> {
        let shift = motion * nalgebra::Point2::from(self.pivot) - self.pivot;
        Vector3::new(shift.x, shift.y, motion.rotation.angle())
    }

    /// One step of Gauss-Newton towards what views and coordinates want.
    fn towards(&self, motion: &Isometry2<f64>, seen: &Evidence, doubt: &Vector3<f64>) -> Isometry2<f64> {
        let prior = Matrix3::from_diagonal(&doubt.map(f64::recip));
        let wanted = seen.gradient - prior * self.at_pivot(motion);
        let Some(step) = (seen.information + prior).try_inverse().map(|covariance| covariance * wanted) else {
            return *motion;
        };
        let pivot = motion * nalgebra::Point2::from(self.pivot);
        let turned = Isometry2::new(pivot.coords + step.xy(), step.z) * Isometry2::new(-pivot.coords, 0.0);
        turned * motion
    }

    fn weighed(&self, motion: Isometry2<f64>, seen: Evidence, doubt: &Vector3<f64>) -> Hypothesis {
        let at = self.at_pivot(&motion);
        let prior = -0.5 * at.component_mul(&at).component_div(doubt).sum();
        let unmoved =
            UNMOVED - 0.5 * (at.xy().norm_squared() / UNMOVED_WITHIN.0.powi(2) + (at.z / UNMOVED_WITHIN.1).powi(2));
        let stays = matches!(self.doubt, Doubt::Anywhere(_)) && unmoved > -self.doubt.log_places();
        let prior = if stays { unmoved } else { prior - self.doubt.log_places() };
        Hypothesis { motion, log_weight: seen.sum + prior, agreeing: seen.agreeing, stays }
    }
}

#[cfg(test)]
mod tests {
    use topo_map::{Displacement, Turn};

    use super::*;
    use crate::recognize::stretch::Likeness;

    /// Two rows of old places 4 m apart, and a stretch of four new ones midway between them.
    struct Midway {
        coordinates: Coordinates,
        reach: HashMap<PlaceId, Reach>,
    }

    const ROWS: [u32; 2] = [0, 4];

    impl Midway {
        fn new() -> Self {
            let mut coordinates = Coordinates::default();
            coordinates.place(PlaceId(0), None);
            for number in 0..12_u32 {
                // Numbers 0 to 3 are the first row, 4 to 7 the second, 8 to 11 the new places.
                let x = if number < 4 {
                    0.0
                } else if number < 8 {
                    4.0
                } else {
                    2.0
                };
                let at = Displacement::isotropic(Vector2::new(x, f64::from(number % 4)), 0.01);
                if number > 0 {
                    coordinates.place(PlaceId(number), Some((PlaceId(0), &at)));
                }
            }
            let far = Reach { position_variance: 4.0, turn_variance: 0.1, path: 0.0 };
            Self { coordinates, reach: (0..8).map(|known| (PlaceId(known), far)).collect() }
        }

        /// Four views, each exactly like its neighbour in these rows, as turned as `turn` says of it.
        fn views(rows: &[u32], turn: impl Fn(u32) -> Option<f64>) -> Vec<View> {
            let view = |number: u32| {
                let likeness = |row: &u32| {
                    let turn = turn(number).map(|change| Turn { change, variance: 1e-4 });
                    let displacement = Displacement { turn, ..Displacement::isotropic(Vector2::zeros(), 0.02) };
                    let known = PlaceId(row + number);
                    Likeness { known, displacement: Some(displacement), log_ratio: 1.4, score: 0.8, decided: false }
                };
                let likenesses = rows.iter().map(likeness).collect();
                View { place: PlaceId(8 + number), likenesses, most_agreed: 0 }
            };
            (0..4).map(view).collect()
        }

        fn weighed(&self, views: &[View]) -> Vec<Hypothesis> {
            let doubt = Doubt::Held(Held::Scans, &self.reach);
            Weighing::new(views.iter().enumerate(), |_| true, &self.coordinates, doubt).hypotheses()
        }
    }

    #[test]
    fn views_that_agree_on_one_motion_weigh_together() {
        let midway = Midway::new();
        let found = midway.weighed(&Midway::views(&ROWS[..1], |_| None));
        assert_eq!((found.len(), found[0].agreeing.len()), (1, 4));
        approx::assert_relative_eq!(found[0].motion.translation.vector, Vector2::new(-2.0, 0.0), epsilon = 1e-2);
        // Four views of 1.4 each, less the doubt: a shift of 2 m where 2 m are the standard deviation.
        approx::assert_relative_eq!(found[0].log_weight, 5.6 - 0.5, epsilon = 0.05);
    }

    #[test]
    fn two_rows_that_look_alike_are_as_likely_as_each_other() {
        let midway = Midway::new();
        let found = midway.weighed(&Midway::views(&ROWS, |_| None));
        assert_eq!(found.len(), 2);
        approx::assert_relative_eq!(found[0].log_weight, found[1].log_weight, epsilon = 1e-6);
    }

    #[test]
    fn views_that_turn_differently_do_not_agree() {
        let midway = Midway::new();
        let same = midway.weighed(&Midway::views(&ROWS[..1], |_| Some(0.0)));
        assert_eq!(same[0].agreeing.len(), 4);
        let all_ways = midway.weighed(&Midway::views(&ROWS[..1], |number| Some(1.5 * f64::from(number))));
        assert!(all_ways.iter().all(|found| found.agreeing.len() < 2 && found.log_weight < 1.4), "{all_ways:?}");
    }

    #[test]
    fn the_surer_the_coordinates_the_less_they_are_moved() {
        let mut midway = Midway::new();
        let views = Midway::views(&ROWS[..1], |_| None);
        let before = midway.weighed(&views)[0].log_weight;
        midway.reach.values_mut().for_each(|reach| reach.position_variance = 0.25);
        let after = midway.weighed(&views)[0].log_weight;
        assert!(before > 4.6 && after < 0.0, "{before} and {after}");
    }
}

use std::collections::BTreeMap;

use nalgebra::{Isometry2, Point2};
use serde::Serialize;

use super::pairing::{Pairing, pair};
use super::path::TimedPath;
use super::recognition::Contingency;

/// How well a robot knows where it is, in the measure of Duckett & Nehmzow (1998).
///
/// The floor is cut into square cells. Each time that the robot has truly gone a cell's width, one answer is counted:
/// in which cell it was, and in which it believed to be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Localization {
    /// Edge of the cells in metres.
    pub cell_m: f64,
    /// Answers counted.
    pub answers: usize,
    /// Different cells in which the robot was.
    pub locations: usize,
    /// `U(L|R)`, see [`Contingency::uncertainty_coefficient`]; `None` below two locations.
    pub uncertainty_coefficient: Option<f64>,
    /// The share of the answers that name the true cell.
    pub accuracy: Option<f64>,
}

/// Judges where `estimate` believes the robot to be, moved into the frame of `reference` by `reference_from_estimate`.
///
/// `None` where the two paths have no stamp in common, or the cells are not larger than 0.
#[must_use]
pub fn localization(
    estimate: &TimedPath,
    reference: &TimedPath,
    reference_from_estimate: &Isometry2<f64>,
    pairing: Pairing,
    cell: f64,
) -> Option<Localization> {
    let pairs = pair(estimate, reference, pairing);
    let mut last = Point2::from(pairs.first().filter(|_| cell > 0.0)?.reference.translation.vector);
    let mut table = Contingency::default();
    let mut numbers: BTreeMap<[i64; 2], usize> = BTreeMap::new();
    let mut number = |point: Point2<f64>| {
        let count = numbers.len();
        *numbers.entry(cell_of(point, cell)).or_insert(count)
    };
    let (mut answers, mut there) = (0, std::collections::BTreeSet::new());
    for (index, pair) in pairs.iter().enumerate() {
        let here = Point2::from(pair.reference.translation.vector);
        if index > 0 && (here - last).norm() < cell {
            continue;
        }
        last = here;
        let location = number(here);
        let believed = reference_from_estimate * Point2::from(pair.estimate.translation.vector);
        table.push(location, number(believed));
        there.insert(location);
        answers += 1;
    }
    Some(Localization {
        cell_m: cell,
        answers,
        locations: there.len(),
        uncertainty_coefficient: table.uncertainty_coefficient(),
        accuracy: table.accuracy(),
    })
}

fn cell_of(point: Point2<f64>, cell: f64) -> [i64; 2] {
    #[expect(clippy::cast_possible_truncation, reason = "saturates, far beyond any floor")]
    [point.x, point.y].map(|coordinate| (coordinate / cell).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot at 0.5 m/s along `x`, as one would have it who is `off` metres ahead.
    fn drive(off: impl Fn(f64) -> f64) -> TimedPath {
        TimedPath::new((0..200).map(|k| {
            let stamp = 0.25 + f64::from(k);
            (stamp, Isometry2::translation(0.5 * stamp + off(stamp), 0.25))
        }))
    }

    fn judged(estimate: &TimedPath) -> Localization {
        localization(estimate, &drive(|_| 0.0), &Isometry2::identity(), Pairing::default(), 1.0).unwrap()
    }

    #[test]
    fn who_knows_the_place_takes_all_uncertainty_away() {
        let right = judged(&drive(|_| 0.2));
        assert_eq!((right.uncertainty_coefficient, right.accuracy), (Some(1.0), Some(1.0)));
        assert_eq!((right.answers, right.locations), (100, 100));
        let relabelled = judged(&drive(|_| 7.0));
        assert_eq!((relabelled.uncertainty_coefficient, relabelled.accuracy), (Some(1.0), Some(0.0)));
    }

    #[test]
    fn who_always_says_the_same_takes_none_away() {
        let lost = judged(&drive(|stamp| -0.5 * stamp));
        assert_eq!(lost.uncertainty_coefficient, Some(0.0));
        assert!(lost.accuracy.unwrap() < 0.02);
    }

    #[test]
    fn nothing_in_common_is_no_answer() {
        let late = TimedPath::new([(9000.0, Isometry2::identity())]);
        let found = localization(&late, &drive(|_| 0.0), &Isometry2::identity(), Pairing::default(), 1.0);
        assert_eq!(found, None);
    }
}

use std::collections::BTreeMap;

use nalgebra::{Isometry2, Point2};
use serde::Serialize;

use super::pairing::{Pair, Pairing, pair};
use super::path::TimedPath;
use super::recognition::Contingency;

/// How well a robot knows where it is, in the measure of Duckett & Nehmzow (1998).
///
/// The floor is cut into square cells. Each time that the robot has truly gone a cell's width, one answer is counted:
/// in which cell it was, and in which it believed to be. A belief in a cell where the robot never was is one answer, "nowhere":
/// a drifting path would otherwise give every moment a name of its own, and take all uncertainty away by saying nothing.
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
    let answers = answers(&pair(estimate, reference, pairing), reference_from_estimate, cell)?;
    let mut numbers: BTreeMap<[i64; 2], usize> = BTreeMap::new();
    for (location, _) in &answers {
        let count = numbers.len();
        numbers.entry(*location).or_insert(count);
    }
    let mut table = Contingency::default();
    for (location, believed) in &answers {
        table.push(numbers[location], numbers.get(believed).copied().unwrap_or(NOWHERE));
    }
    Some(Localization {
        cell_m: cell,
        answers: answers.len(),
        locations: numbers.len(),
        uncertainty_coefficient: table.uncertainty_coefficient(),
        accuracy: table.accuracy(),
    })
}

/// The answer of a robot that believes to be where it never was.
const NOWHERE: usize = usize::MAX;

/// The true cell and the believed one, each time that the robot has gone a cell's width; `None` without a pose.
fn answers(pairs: &[Pair], reference_from_estimate: &Isometry2<f64>, cell: f64) -> Option<Vec<([i64; 2], [i64; 2])>> {
    let mut last: Option<Point2<f64>> = None;
    let mut answers = Vec::new();
    for pair in pairs.iter().filter(|_| cell > 0.0) {
        let here = Point2::from(pair.reference.translation.vector);
        if last.is_some_and(|last| (here - last).norm() < cell) {
            continue;
        }
        last = Some(here);
        let believed = reference_from_estimate * Point2::from(pair.estimate.translation.vector);
        answers.push((cell_of(here, cell), cell_of(believed, cell)));
    }
    (!answers.is_empty()).then_some(answers)
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
        assert_eq!(relabelled.accuracy, Some(0.0));
        // Seven answers are "nowhere", as good as none of them: (100 ln 100 − 7 ln 7) / (100 ln 100).
        let rest = 1.0 - 7.0 * 7f64.ln() / (100.0 * 100f64.ln());
        approx::assert_relative_eq!(relabelled.uncertainty_coefficient.unwrap(), rest, epsilon = 1e-9);
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

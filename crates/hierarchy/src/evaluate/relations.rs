use std::io::{self, BufRead};

use nalgebra::{Isometry2, Vector2};
use serde::Serialize;

use super::path::TimedPath;

/// A true relation: the pose of the robot at stamp `to` in the frame of the robot at stamp `from` (Kümmerle et al. 2009).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relation {
    /// Seconds.
    pub from: f64,
    /// Seconds.
    pub to: f64,
    /// The true pose of the later robot relative to the earlier one.
    pub from_to: Isometry2<f64>,
}

/// Why relations could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RelationsParseError {
    /// The source failed.
    #[error("reading failed after line {line}")]
    Read {
        /// Lines read before.
        line: usize,
        /// The cause.
        #[source]
        source: io::Error,
    },
    /// A line that is no relation.
    #[error("line {line}: expected `stamp stamp x y z roll pitch yaw`, eight finite numbers, found `{found}`")]
    Line {
        /// Counted from 1.
        line: usize,
        /// Its beginning.
        found: String,
    },
    /// Nothing in it.
    #[error("the file holds no relation")]
    Empty,
}

/// Reads relations: `stamp stamp x y z roll pitch yaw` per line, metres and radians, `#` comments.
///
/// # Errors
///
/// A line that is no relation, none at all, a failing source.
pub fn read_relations(input: impl BufRead) -> Result<Vec<Relation>, RelationsParseError> {
    let mut relations = Vec::new();
    for (index, line) in input.lines().enumerate() {
        let text = line.map_err(|source| RelationsParseError::Read { line: index, source })?;
        let text = text.trim();
        if text.is_empty() || text.starts_with('#') {
            continue;
        }
        let numbers: Vec<f64> = text.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
        let [from, to, x, y, _, _, _, yaw] = numbers[..] else {
            return Err(RelationsParseError::Line { line: index + 1, found: text.chars().take(60).collect() });
        };
        if !numbers.iter().all(|number| number.is_finite()) || text.split_ascii_whitespace().count() != 8 {
            return Err(RelationsParseError::Line { line: index + 1, found: text.chars().take(60).collect() });
        }
        relations.push(Relation { from, to, from_to: Isometry2::new(Vector2::new(x, y), yaw) });
    }
    if relations.is_empty() { Err(RelationsParseError::Empty) } else { Ok(relations) }
}

/// How relations are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelationsOptions {
    /// Relations whose stamps lie so many seconds outside of the path are still compared, with its first or last pose.
    pub beyond: f64,
    /// Relations over more seconds than this tell of the whole map, the others of the path from one scan to the next.
    pub split: f64,
}

impl Default for RelationsOptions {
    fn default() -> Self {
        Self { beyond: 2.0, split: 15.0 }
    }
}

/// How well relations are met.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RelationsError {
    /// All that the path covers.
    pub all: Option<ErrorParts>,
    /// Those over short times.
    pub near: Option<ErrorParts>,
    /// Those over long times.
    pub far: Option<ErrorParts>,
}

/// The mean errors of a set of relations, translation and rotation apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorParts {
    /// How many.
    pub relations: usize,
    /// Mean absolute translational error in metres.
    pub translation_mean_m: f64,
    /// Its standard deviation in metres.
    pub translation_std_m: f64,
    /// Its median in metres.
    pub translation_median_m: f64,
    /// Mean squared translational error in square metres.
    pub translation_squared_m2: f64,
    /// Mean absolute rotational error in degrees.
    pub rotation_mean_deg: f64,
    /// Mean squared rotational error in square degrees.
    pub rotation_squared_deg2: f64,
}

/// How well `estimate` meets `relations`: `(true relation)⁻¹ · (estimated relation)`, by its length and its angle.
///
/// Poses at the stamps are interpolated. Where `odometry` is given, it carries the pose from the nearest pose of the estimate to the
/// stamp instead, so that an estimate with few poses is not punished for what lies between them.
#[must_use]
pub fn relations_error(
    estimate: &TimedPath,
    relations: &[Relation],
    odometry: Option<&TimedPath>,
    options: &RelationsOptions,
) -> RelationsError {
    let mut errors = Vec::new();
    if let (Some(first), Some(last)) = (estimate.stamps().first(), estimate.stamps().last()) {
        for relation in relations {
            let (early, late) = (relation.from.min(relation.to), relation.from.max(relation.to));
            if early < first - options.beyond || late > last + options.beyond {
                continue;
            }
            let (Some(from), Some(to)) =
                (pose_at(estimate, odometry, relation.from), pose_at(estimate, odometry, relation.to))
            else {
                continue;
            };
            let error = relation.from_to.inv_mul(&from.inv_mul(&to));
            errors.push((late - early, error.translation.vector.norm(), error.rotation.angle().abs().to_degrees()));
        }
    }
    let part = |keep: &dyn Fn(f64) -> bool| {
        parts(
            errors.iter().filter(|(span, ..)| keep(*span)).map(|(_, translation, rotation)| (*translation, *rotation)),
        )
    };
    RelationsError {
        all: part(&|_| true),
        near: part(&|span| span <= options.split),
        far: part(&|span| span > options.split),
    }
}

/// The robot at `stamp`.
fn pose_at(estimate: &TimedPath, odometry: Option<&TimedPath>, stamp: f64) -> Option<Isometry2<f64>> {
    let Some(odometry) = odometry else { return estimate.at(stamp) };
    let nearest = estimate.nearest(stamp)?;
    let moved = odometry.at(estimate.stamps()[nearest])?.inv_mul(&odometry.at(stamp)?);
    Some(estimate.poses()[nearest] * moved)
}

fn parts(errors: impl Iterator<Item = (f64, f64)>) -> Option<ErrorParts> {
    let (translations, rotations): (Vec<f64>, Vec<f64>) = errors.unzip();
    let translation = super::Statistics::of(&translations)?;
    let rotation = super::Statistics::of(&rotations)?;
    Some(ErrorParts {
        relations: translations.len(),
        translation_mean_m: translation.mean,
        translation_std_m: translation.std,
        translation_median_m: translation.median,
        translation_squared_m2: translation.rmse.powi(2),
        rotation_mean_deg: rotation.mean,
        rotation_squared_deg2: rotation.rmse.powi(2),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(speed: f64, step: f64) -> TimedPath {
        TimedPath::new(
            (0..=60).map(|k| (step * f64::from(k), Isometry2::translation(speed * step * f64::from(k), 0.0))),
        )
    }

    const TEXT: &str = "# true\n1 3 2 0 0 0 0 0\n0 20 20 0 0 0 0 0.1\n55 70 15 0 0 0 0 0\n";

    #[test]
    fn relations_are_met_or_missed_by_what_they_say() {
        let relations = read_relations(TEXT.as_bytes()).unwrap();
        let error = relations_error(&line(1.1, 1.0), &relations, None, &RelationsOptions::default());
        let all = error.all.unwrap();
        assert_eq!(all.relations, 2, "the third ends after the path");
        approx::assert_relative_eq!(all.translation_mean_m, (0.2 + 2.0) / 2.0, epsilon = 1e-9);
        approx::assert_relative_eq!(error.near.unwrap().translation_mean_m, 0.2, epsilon = 1e-9);
        approx::assert_relative_eq!(error.far.unwrap().rotation_mean_deg, 0.1f64.to_degrees(), epsilon = 1e-9);
        approx::assert_relative_eq!(error.far.unwrap().translation_squared_m2, 4.0, epsilon = 1e-9);
    }

    #[test]
    fn odometry_carries_between_the_poses_of_a_sparse_estimate() {
        // The robot waits, then leaps; only the odometry knows when.
        let odometry = TimedPath::new(
            [0.0, 0.0, 0.0, 0.0, 10.0]
                .into_iter()
                .zip(0..)
                .map(|(x, k)| (f64::from(k), Isometry2::translation(x, 0.0))),
        );
        let sparse = TimedPath::new([(0.0, Isometry2::identity()), (4.0, Isometry2::translation(10.0, 0.0))]);
        let relation = [Relation { from: 0.0, to: 3.0, from_to: Isometry2::identity() }];
        let error = |odometry| {
            relations_error(&sparse, &relation, odometry, &RelationsOptions::default()).all.unwrap().translation_mean_m
        };
        approx::assert_relative_eq!(error(None), 7.5, epsilon = 1e-12);
        approx::assert_relative_eq!(error(Some(&odometry)), 0.0, epsilon = 1e-12);
    }

    proptest::proptest! {
        #[test]
        fn nearly_right_files_never_panic(words in proptest::collection::vec(
            proptest::sample::select(vec!["1", "-0", "nan", "inf", "1e308", "1e999", "#", "\n", "é", "0x1", "\u{0}"]), 0..60,
        )) {
            let text = words.join(" ");
            if let Ok(relations) = read_relations(text.as_bytes()) {
                proptest::prop_assert!(relations.iter().all(|relation| relation.from.is_finite() && relation.to.is_finite()));
                let _ = relations_error(&line(1.0, 1.0), &relations, None, &RelationsOptions::default());
            }
            if let Ok(path) = TimedPath::read_tum(text.as_bytes()) {
                proptest::prop_assert!(path.stamps().windows(2).all(|pair| pair[0] < pair[1]));
                proptest::prop_assert!(path.at(0.5).is_some());
            }
        }
    }

    #[test]
    fn what_is_no_relation_is_refused_with_its_line() {
        for text in ["1 2 3 4 5 6 7\n", "1 2 3 4 5 6 7 x\n", "1 2 3 4 5 6 7 8 9\n", "1 2 nan 4 5 6 7 8\n"] {
            assert!(read_relations(text.as_bytes()).unwrap_err().to_string().starts_with("line 1"), "{text}");
        }
        assert!(matches!(read_relations("".as_bytes()), Err(RelationsParseError::Empty)));
    }
}

use std::io::BufRead;
use std::path::Path;

use nalgebra::{Isometry2, UnitComplex, Vector2};

use crate::exit::Exit;
use crate::failure::{Failure, Place};

/// Poses by their stamps, in seconds.
#[derive(Debug, Default)]
pub(crate) struct Trajectory {
    samples: Vec<(f64, Isometry2<f64>)>,
}

impl Trajectory {
    /// Reads `stamp x y z qx qy qz qw`, one pose per line; `#` starts a comment.
    pub(crate) fn read(path: &Path, input: &mut impl BufRead) -> Result<Self, Failure> {
        let mut trajectory = Self::default();
        for (number, line) in (1..).zip(input.lines()) {
            let line = line.map_err(|error| Failure::reading(path, &error))?;
            let text = line.split('#').next().unwrap_or_default().trim();
            if text.is_empty() {
                continue;
            }
            let wrong = |expected: &str| {
                let message = format!("could not read {}: expected {expected}", path.display());
                let place = Place { file: path.display().to_string(), line: number, ..Place::default() };
                Failure::new(Exit::Rejected, "trajectory.line", message).at(place)
            };
            let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
            let numbers = numbers.ok().filter(|numbers| numbers.iter().all(|number| number.is_finite()));
            let Some(&[stamp, x, y, _, qx, qy, qz, qw]) = numbers.as_deref() else {
                return Err(wrong("eight finite numbers: stamp x y z qx qy qz qw"));
            };
            if trajectory.samples.last().is_some_and(|last| last.0 > stamp) {
                return Err(wrong("stamps that do not run backwards"));
            }
            // The heading of a pose that lies in the plane, or nearly so.
            let heading = (2.0 * (qw * qz + qx * qy)).atan2(1.0 - 2.0 * (qy * qy + qz * qz));
            trajectory.push(stamp, Isometry2::new(Vector2::new(x, y), heading));
        }
        Ok(trajectory)
    }

    /// Appends a pose; stamps must not run backwards.
    pub(crate) fn push(&mut self, stamp: f64, pose: Isometry2<f64>) {
        self.samples.push((stamp, pose));
    }

    /// The pose at a moment, between the poses before and after it; `None` outside the time that they span.
    pub(crate) fn at(&self, stamp: f64) -> Option<Isometry2<f64>> {
        let after = self.samples.partition_point(|sample| sample.0 < stamp);
        let next = self.samples.get(after)?;
        if next.0 <= stamp {
            return Some(next.1);
        }
        let last = &self.samples[after.checked_sub(1)?];
        let share = (stamp - last.0) / (next.0 - last.0);
        let at = last.1.translation.vector.lerp(&next.1.translation.vector, share);
        let turn = UnitComplex::new(share * last.1.rotation.angle_to(&next.1.rotation));
        Some(Isometry2::from_parts(at.into(), last.1.rotation * turn))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_between_are_between() {
        let text = "# stamp x y z qx qy qz qw\n1 0 0 0 0 0 0 1\n3 2 0 0 0 0 0.7071067811865476 0.7071067811865476\n";
        let trajectory = Trajectory::read(Path::new("a.tum"), &mut text.as_bytes()).unwrap();
        let middle = trajectory.at(2.0).unwrap();
        assert!((middle.translation.x - 1.0).abs() < 1e-9);
        assert!((middle.rotation.angle() - std::f64::consts::FRAC_PI_4).abs() < 1e-9);
        assert_eq!(trajectory.at(3.0).unwrap().translation.x, 2.0);
        assert!(trajectory.at(0.9).is_none() && trajectory.at(3.1).is_none());
    }

    #[test]
    fn broken_lines_are_named() {
        for text in ["1 2 3\n", "1 0 0 0 0 0 0 nan\n", "2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"] {
            let failure = Trajectory::read(Path::new("a.tum"), &mut text.as_bytes()).unwrap_err();
            assert!(failure.render(false).unwrap().contains("a.tum:"), "{text}");
        }
    }
}

use std::io::{self, BufRead, Write};

use nalgebra::{Isometry2, UnitComplex, Vector2};

/// Poses of a robot by stamp: stamps in seconds, strictly increasing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TimedPath {
    stamps: Vec<f64>,
    poses: Vec<Isometry2<f64>>,
}

/// Why a path could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// The source failed.
    #[error("reading failed after line {line}")]
    Read {
        /// Lines read before.
        line: usize,
        /// The cause.
        #[source]
        source: io::Error,
    },
    /// A line that is no pose.
    #[error("line {line}: expected `stamp x y z qx qy qz qw`, eight finite numbers, found `{found}`")]
    Line {
        /// Counted from 1.
        line: usize,
        /// Its beginning.
        found: String,
    },
    /// Nothing in it.
    #[error("the trajectory holds no pose")]
    Empty,
}

impl TimedPath {
    /// The path through `poses`, put in the order of their stamps; of poses with equal stamps the first counts, stamps that are not finite do not.
    #[must_use]
    pub fn new(poses: impl IntoIterator<Item = (f64, Isometry2<f64>)>) -> Self {
        let mut poses: Vec<_> = poses.into_iter().filter(|(stamp, _)| stamp.is_finite()).collect();
        poses.sort_by(|a, b| a.0.total_cmp(&b.0));
        poses.dedup_by(|b, a| a.0 == b.0);
        let (stamps, poses) = poses.into_iter().unzip();
        Self { stamps, poses }
    }

    /// Reads a trajectory in TUM form: `stamp x y z qx qy qz qw` per line, `#` comments. Of the attitude the yaw counts.
    ///
    /// # Errors
    ///
    /// A line that is no pose, no pose at all, a failing source.
    pub fn read_tum(input: impl BufRead) -> Result<Self, PathError> {
        let mut poses = Vec::new();
        for (index, line) in input.lines().enumerate() {
            let text = line.map_err(|source| PathError::Read { line: index, source })?;
            let text = text.trim();
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let pose = tum_pose(text)
                .ok_or_else(|| PathError::Line { line: index + 1, found: text.chars().take(60).collect() })?;
            poses.push(pose);
        }
        if poses.is_empty() { Err(PathError::Empty) } else { Ok(Self::new(poses)) }
    }

    /// Writes the path in TUM form, stamps with six decimals.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn write_tum(&self, out: &mut impl Write) -> io::Result<()> {
        for (stamp, pose) in self.iter() {
            let (sin, cos) = (pose.rotation.angle() / 2.0).sin_cos();
            let at = pose.translation;
            writeln!(out, "{stamp:.6} {:.9} {:.9} 0 0 0 {sin:.12} {cos:.12}", at.x, at.y)?;
        }
        Ok(())
    }

    /// How many poses there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// The stamps in seconds.
    #[must_use]
    pub fn stamps(&self) -> &[f64] {
        &self.stamps
    }

    /// The poses.
    #[must_use]
    pub fn poses(&self) -> &[Isometry2<f64>] {
        &self.poses
    }

    /// Stamps with poses.
    pub fn iter(&self) -> impl Iterator<Item = (f64, &Isometry2<f64>)> + '_ {
        self.stamps.iter().copied().zip(&self.poses)
    }

    /// Summed length of the steps in metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.poses.windows(2).map(|pair| (pair[1].translation.vector - pair[0].translation.vector).norm()).sum()
    }

    /// From the first pose to the last, in metres; `None` on an empty path.
    #[must_use]
    pub fn start_to_end(&self) -> Option<f64> {
        let (first, last) = (self.poses.first()?, self.poses.last()?);
        Some((last.translation.vector - first.translation.vector).norm())
    }

    /// The longer and the shorter side of the smallest box that holds the path, among boxes turned by whole degrees, in metres.
    #[must_use]
    pub fn extent(&self) -> [f64; 2] {
        let side = |degrees: u32| {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let along = self.poses.iter().map(|pose| pose.translation.x * cos + pose.translation.y * sin);
            let (low, high) = along.fold((f64::MAX, f64::MIN), |(low, high), at| (low.min(at), high.max(at)));
            (high - low).max(0.0)
        };
        let boxes = (0..90).map(|degrees| (side(degrees), side(degrees + 90)));
        let (a, b) = boxes.min_by(|a, b| (a.0 * a.1).total_cmp(&(b.0 * b.1))).unwrap_or_default();
        [a.max(b), a.min(b)]
    }

    /// The index of the pose whose stamp is nearest; the earlier of two that are equally near. `None` on an empty path.
    #[must_use]
    pub fn nearest(&self, stamp: f64) -> Option<usize> {
        let after = self.stamps.partition_point(|other| *other < stamp);
        match (after.checked_sub(1), after < self.len()) {
            (None, false) => None,
            (None, true) => Some(after),
            (Some(before), false) => Some(before),
            (Some(before), true) if stamp - self.stamps[before] <= self.stamps[after] - stamp => Some(before),
            _ => Some(after),
        }
    }

    /// The pose at `stamp`: between two poses position and heading are interpolated, before the first and after the last they stay.
    /// `None` on an empty path.
    #[must_use]
    pub fn at(&self, stamp: f64) -> Option<Isometry2<f64>> {
        let after = self.stamps.partition_point(|other| *other < stamp);
        let Some(to) = self.poses.get(after) else { return self.poses.last().copied() };
        let Some(before) = after.checked_sub(1) else { return Some(*to) };
        let from = &self.poses[before];
        let share = (stamp - self.stamps[before]) / (self.stamps[after] - self.stamps[before]);
        let turn = from.rotation.angle_to(&to.rotation);
        let at = from.translation.vector.lerp(&to.translation.vector, share);
        Some(Isometry2::from_parts(at.into(), from.rotation * UnitComplex::new(share * turn)))
    }

    /// The pose at `stamp`, interpolated where two poses at most `gap` seconds apart enclose it; `None` elsewhere.
    #[must_use]
    pub fn between(&self, stamp: f64, gap: f64) -> Option<Isometry2<f64>> {
        let after = self.stamps.partition_point(|other| *other < stamp);
        let later = *self.stamps.get(after)?;
        let enclosed = later == stamp || (after > 0 && later - self.stamps[after - 1] <= gap);
        enclosed.then(|| self.at(stamp)).flatten()
    }
}

/// `stamp x y z qx qy qz qw` as a pose in the plane.
fn tum_pose(text: &str) -> Option<(f64, Isometry2<f64>)> {
    let mut numbers = [0.0; 8];
    let mut words = text.split_ascii_whitespace();
    for number in &mut numbers {
        *number = words.next()?.parse().ok().filter(|value: &f64| value.is_finite())?;
    }
    let [stamp, x, y, _, qx, qy, qz, qw] = numbers;
    let norm = qx * qx + qy * qy + qz * qz + qw * qw;
    if words.next().is_some() || norm < 1e-6 {
        return None;
    }
    let yaw = f64::atan2(2.0 * (qw * qz + qx * qy), norm - 2.0 * (qy * qy + qz * qz));
    Some((stamp, Isometry2::new(Vector2::new(x, y), yaw)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_interpolated_along_the_shorter_turn() {
        let path = TimedPath::new([
            (0.0, Isometry2::new(Vector2::zeros(), 3.0)),
            (2.0, Isometry2::new(Vector2::new(2.0, 0.0), -3.0)),
        ]);
        let middle = path.at(1.0).unwrap();
        approx::assert_relative_eq!(middle.translation.x, 1.0);
        approx::assert_relative_eq!(middle.rotation.angle().abs(), std::f64::consts::PI, epsilon = 1e-12);
        assert_eq!(path.at(-5.0), path.at(0.0));
        assert_eq!(path.at(9.0), path.at(2.0));
    }

    #[test]
    fn the_extent_of_a_path_does_not_depend_on_its_axes() {
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 1.0)];
        for turn in [0.0f64, 30.0, -77.0] {
            let axes = Isometry2::rotation(turn.to_radians());
            let poses =
                corners.iter().zip(0..).map(|((x, y), k)| (f64::from(k), axes * Isometry2::translation(*x, *y)));
            let path = TimedPath::new(poses);
            let [long, short] = path.extent();
            approx::assert_relative_eq!(long, 4.0, epsilon = 1e-9);
            approx::assert_relative_eq!(short, 3.0, epsilon = 1e-9);
            approx::assert_relative_eq!(path.start_to_end().unwrap(), 1.0, epsilon = 1e-9);
        }
        assert_eq!((TimedPath::default().extent(), TimedPath::default().start_to_end()), ([0.0; 2], None));
    }

    #[test]
    fn tum_is_read_back_as_written() {
        let path = TimedPath::new((0..20).map(|k| {
            let k = f64::from(k);
            (k * 0.5, Isometry2::new(Vector2::new(k, -k * k), 0.7 * k))
        }));
        let mut text = Vec::new();
        path.write_tum(&mut text).unwrap();
        let back = TimedPath::read_tum(text.as_slice()).unwrap();
        assert_eq!(back.stamps(), path.stamps());
        back.poses().iter().zip(path.poses()).for_each(|(a, b)| approx::assert_relative_eq!(a, b, epsilon = 1e-8));
    }

    #[test]
    fn what_is_no_trajectory_is_refused_with_its_line() {
        let refused = |text: &str| TimedPath::read_tum(text.as_bytes()).unwrap_err().to_string();
        assert!(refused("# x\n1 2 3 0 0 0 0 1\n2 2 nan 0 0 0 0 1\n").starts_with("line 3"));
        assert!(refused("1 2 3 0 0 0 0 0\n").starts_with("line 1"), "a zero quaternion is no attitude");
        assert!(refused("1 2 3\n").contains("eight finite numbers"));
        assert!(refused("\n").contains("no pose"));
    }

    #[test]
    fn the_nearest_pose_is_found() {
        let path =
            TimedPath::new([(1.0, Isometry2::identity()), (2.0, Isometry2::identity()), (2.0, Isometry2::identity())]);
        assert_eq!(path.len(), 2);
        assert_eq!(
            [0.0, 1.4, 1.5, 1.6, 9.0].map(|stamp| path.nearest(stamp)),
            [Some(0), Some(0), Some(0), Some(1), Some(1)]
        );
        assert_eq!(TimedPath::default().nearest(1.0), None);
    }
}
